"""Leading a rolling disk round a circle."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.systems import RollingDisk
from rigid_envs.tasks import DiskRoll
from tests.tasks.controllers.linear import lqr, scheduled, step_jacobian

__all__ = ["circle", "rates_of", "rolling_state"]

Array = npt.NDArray[np.float64]
_E_Z = np.array([0.0, 0.0, 1.0])


def rolling_state(lean: Array, rate: Array, wn: Array, w3: Array) -> Array:
    """State of a disk from lean theta - pi / 2, theta', wn and w3; heading and phase 0."""
    theta, zero = 0.5 * np.pi + lean, 0.0 * lean
    q = rotations.quaternion_from_euler(np.stack([zero, theta, zero], axis=-1))
    # with psi = 0 the radius that points up is n = e2, and l = e3 x n = -e1
    return np.concatenate([q, np.stack([rate, wn, w3, zero, zero], axis=-1)], axis=-1)


def rates_of(y: Array) -> tuple[Array, Array, Array, Array]:
    """The inverse of `rolling_state`: lean, theta', wn and w3."""
    G = rotations.rotate_inverse(y[..., :4], _E_Z)
    s = np.hypot(G[..., 0], G[..., 1])
    n1, n2 = G[..., 0] / s, G[..., 1] / s
    wn, wl = n1 * y[..., 4] + n2 * y[..., 5], n1 * y[..., 5] - n2 * y[..., 4]
    return np.arctan2(-G[..., 2], s), -wl, wn, y[..., 6]


def circle(task: DiskRoll) -> Callable[[Array, Array], Array]:
    """LQR of the lean about that with which the disk rolls on the commanded circle.

    The lean torque does not act on wn and w3: they follow the lean alone,

        d(wn sin(theta))/dtheta = (I3 / I1) w3 sin(theta),
        dw3/dtheta = m r^2 / (I3 + m r^2) wn.

    So the curvature wn / (sin(theta) r (w3 - wn cot(theta))) is a function of the lean, too: one
    Newton step leads to the lean it must have, where the torque ``-(I3 + m r^2) wn w3 + I1
    cot(theta) wn^2 - m g r cos(theta)`` holds the disk. The gain is that of straight rolling at the
    same w3.

    Args:
        task: the task; the middle of its ranges counts.

    Returns:
        Actions (N, 1) as a function of states (N, 9) and commanded curvatures times radius (N,).

    Source: Routh, *Advanced Rigid Dynamics*, section 244.
    """
    disk = task.system()
    assert isinstance(disk, RollingDisk)
    rim = disk.m * disk.radius**2
    ratio, slip = disk.I3 / disk.I1, rim / (disk.I3 + rim)

    def gain(w3: float) -> Array:
        def advance(x: Array, u: Array) -> Array:
            spin = np.full(len(x), w3)
            y = rolling_state(x[:, 0], x[:, 1], ratio * w3 * x[:, 0], spin)
            held = np.zeros((len(x), 3))
            held[:, 1:2] = u
            return np.stack(rates_of(disk.advance(y, held, task.dt, task.n_substeps))[:2], axis=-1)

        return lqr(*step_jacobian(advance, np.zeros(2), 1), np.array([3e4, 100.0]), np.array([1.0]))

    fastest = np.sqrt(disk.m * disk.g * disk.radius * disk.I1 / (disk.I3 * (disk.I3 + rim)))
    look_up = scheduled(gain, fastest * np.linspace(0.2, 1.5, 14))

    def law(y: Array, goal: Array) -> Array:
        lean, rate, wn, w3 = rates_of(y)
        s, c = np.cos(lean), -np.sin(lean)
        way = w3 - wn * c / s
        curvature = wn / (s * way)
        # derivatives along the lean
        wn_t, w3_t = ratio * w3 - wn * c / s, slip * wn
        way_t = w3_t - wn_t * c / s + wn / s**2
        slope = (wn_t / s - wn * c / s**2) / way - curvature * way_t / way
        step = np.clip((goal - curvature) / slope, -0.1, 0.1)
        wn, w3 = wn + wn_t * step, w3 + w3_t * step
        s, c = np.cos(lean + step), -np.sin(lean + step)
        weight = disk.m * disk.g * disk.radius * c
        hold = -(disk.I3 + rim) * wn * w3 + disk.I1 * c / s * wn**2 - weight
        error = np.stack([-step, rate], axis=-1)
        torque = hold - np.einsum("...ij,...j->...i", look_up(w3), error)[..., 0]
        return torque[..., None] / task.torque

    return law
