"""Leading a rolling disk round a circle by leaning it: linear feedback about steady rolling."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, positive
from rigid_envs.control.linear import Regulator, clip_to_box, lqr, scheduled, zero_order_hold
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_disk.system import RollingDisk

_E_Z = np.array([0.0, 0.0, 1.0])
_LARGEST_STEP = 0.02  # rad; by how much the lean is asked to change at once
_TINY = 1e-18  # squares of rates [rad^2/s^2]: a disk that stands has no curvature
_STIFFNESS = np.linspace(-40.0, 40.0, 41)  # g / radius; for which there are gains


class DiskMotion(NamedTuple):
    """Rolling motion of a disk without its place, heading and phase; each of shape (...).

    Attributes:
        lean: theta - pi / 2 [rad].
        rate: theta' [rad/s].
        wn: angular velocity about the radius that points up [rad/s].
        w3: angular velocity about the axis [rad/s].
    """

    lean: Array
    rate: Array
    wn: Array
    w3: Array


def rolling(y: npt.ArrayLike) -> DiskMotion:
    """Rolling motion of disks in states y of `RollingDisk`, shape (..., 9)."""
    rows = np.asarray(y, dtype=np.float64)
    vertical = rotations.rotate_inverse(rows[..., :4], _E_Z)
    s = np.hypot(vertical[..., 0], vertical[..., 1])
    n1, n2 = vertical[..., 0] / s, vertical[..., 1] / s
    wn, wl = n1 * rows[..., 4] + n2 * rows[..., 5], n1 * rows[..., 5] - n2 * rows[..., 4]
    return DiskMotion(np.arctan2(-vertical[..., 2], s), -wl, wn, rows[..., 6])


def rolling_state(motion: DiskMotion) -> Array:
    """States of `RollingDisk`, shape (..., 9), of a motion at the origin, heading and phase 0."""
    lean, rate, wn, w3 = np.broadcast_arrays(*motion)
    zero = np.zeros_like(lean)
    q = rotations.quaternion_from_euler(np.stack([zero, 0.5 * np.pi + lean, zero], axis=-1))
    # with psi = 0 the radius that points up is n = e2, and l = e3 x n = -e1
    return np.concatenate([q, np.stack([rate, wn, w3, zero, zero], axis=-1)], axis=-1)


def curvature(now: DiskMotion) -> Array:
    """Curvature of the path of the contact, times the radius, shape (...); 0 if it stands."""
    s, c = np.cos(now.lean), -np.sin(now.lean)
    return _over(now.wn, s * now.w3 - now.wn * c)


def _over(a: Array, b: Array) -> Array:
    """The quotient a / b; 0 where b is."""
    return np.asarray(a * b / np.maximum(b * b, _TINY))


@dataclass(frozen=True)
class CircleRegulator(CheckedFields):
    """Leans a disk as its circle asks for, by a torque about the direction of travel.

    The torque tau does not act on wn and w3: they follow the lean alone,

        d(wn sin(theta))/dtheta = (I3 / I1) w3 sin(theta),
        dw3/dtheta = m r^2 / (I3 + m r^2) wn,

    as when a bicycle is steered by leaning. So the curvature of the path of the contact, times the
    radius, wn / (sin(theta) (w3 - wn cot(theta))), is a function of the lean, too, and the lean
    theta* at which it is the commanded one does not move whatever the torque is. One step of
    Newton's method leads from theta to it. With theta' = -wl,

        (I1 + m r^2) theta'' = -f(theta) - tau,
        f = (I3 + m r^2) wn w3 - I1 cot(theta) wn^2 + m g r cos(theta),

    is an equation for theta alone. The controller ``tau = -f(theta*) - K (theta - theta*, theta')``
    is the linear-quadratic regulator of it, linearised about theta* and sampled, K by the stiffness
    df/dtheta there. It minimises the sum of ``(theta - theta*)^2 + (theta' s)^2 / 300 +
    input_weight (tau + f(theta*))^2``.

    Certificate: the Riccati matrix P, with `value` x P x the sum from there on near the circle, and
    a Lyapunov function.

    Region: theta* counts no further than 0.02 rad away, so that the disk is never leaned on faster
    than it can be stopped. Measured, for a disk with 0.3 m g r of torque that is let go without
    turning, and curvatures up to 0.25: at leans of up to 0.15 rad where it rolls at half of the
    threshold of `RollingDisk` (at which it stands by itself), up to 0.2 rad at 0.7 of it.

    Attributes:
        disk: rolling disk to lead.
        torque: largest torque [N m].
        dt: control period [s].
        input_weight: weight of the torque [rad^2 / (N m)^2].

    Raises:
        ValueError: numbers that are not positive.

    Source: Routh, *Advanced Rigid Dynamics*, section 244; Anderson & Moore, *Optimal Control:
    Linear Quadratic Methods*, section 3.3.
    """

    disk: RollingDisk
    torque: Annotated[float, positive, "N m"]
    dt: Annotated[float, positive, "s"]
    input_weight: Annotated[float, positive, "rad^2 / (N m)^2"] = 1e-5

    def __call__(self, y: npt.ArrayLike, curvature: npt.ArrayLike) -> Array:
        """Torque as a part of the largest.

        Args:
            y: states of `RollingDisk`, shape (..., 9).
            curvature: commanded, of the path of the contact, times the radius, shape (...).

        Returns:
            Actions, shape (..., 1).

        Raises:
            ValueError: bad states.
        """
        now = rolling(self.disk.checked_state(y))
        step = np.clip(self.to_go(now, curvature), -_LARGEST_STEP, _LARGEST_STEP)
        push, stiffness = self._push(self._moved(now, step))
        error = np.stack([-step, now.rate], axis=-1)
        torque = self.regulator(stiffness).feedback(error) - push[..., None]
        return clip_to_box(torque / self.torque)

    def value(self, y: npt.ArrayLike, curvature: npt.ArrayLike) -> Array:
        """Cost to go x P x of states near the circle, shape (...)."""
        now = rolling(self.disk.checked_state(y))
        step = self.to_go(now, curvature)
        _, stiffness = self._push(self._moved(now, step))
        return self.regulator(stiffness).value(np.stack([-step, now.rate], axis=-1))

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `RollingDisk`, shape (..., 3), of actions."""
        lean = self.torque * np.asarray(action, dtype=np.float64)
        return np.concatenate([0.0 * lean, lean, 0.0 * lean], axis=-1)

    def to_go(self, now: DiskMotion, goal: npt.ArrayLike) -> Array:
        """Newton's step theta* - theta, shape (...) [rad]."""
        s, c = np.cos(now.lean), -np.sin(now.lean)
        wn_t, w3_t = self._slopes(now)
        roll_rate, found = s * now.w3 - now.wn * c, curvature(now)
        roll_rate_t = c * now.w3 + s * w3_t - wn_t * c + now.wn * s
        slope = _over(wn_t - found * roll_rate_t, roll_rate)
        return _over(np.asarray(goal) - found, slope)

    def _moved(self, now: DiskMotion, step: Array) -> DiskMotion:
        """The motion at a lean that is `step` further, at rest."""
        wn_t, w3_t = self._slopes(now)
        return DiskMotion(now.lean + step, 0.0 * step, now.wn + wn_t * step, now.w3 + w3_t * step)

    def _slopes(self, now: DiskMotion) -> tuple[Array, Array]:
        """Derivatives of wn and w3 along the lean."""
        cot, rim = -np.tan(now.lean), self.disk.m * self.disk.radius**2
        wn_t = self.disk.I3 / self.disk.I1 * now.w3 - now.wn * cot
        return wn_t, rim / (self.disk.I3 + rim) * now.wn

    def _push(self, at: DiskMotion) -> tuple[Array, Array]:
        """The push f [N m] and its stiffness df/dtheta [N m/rad]."""
        disk, s, c = self.disk, np.cos(at.lean), -np.sin(at.lean)
        rim, weight, cot = disk.m * disk.radius**2, disk.m * disk.g * disk.radius, c / s
        wn_t, w3_t = self._slopes(at)
        f = (disk.I3 + rim) * at.wn * at.w3 - disk.I1 * cot * at.wn**2 + weight * c
        f_t = (
            (disk.I3 + rim) * (wn_t * at.w3 + at.wn * w3_t)
            - disk.I1 * at.wn * (2.0 * cot * wn_t - at.wn / s**2)
            - weight * s
        )
        return f, f_t

    @cached_property
    def regulator(self) -> Callable[..., Regulator]:
        """K and P by the stiffness df/dtheta [N m/rad]."""
        disk = self.disk
        inertia = disk.I1 + disk.m * disk.radius**2
        B = np.array([[0.0], [-1.0 / inertia]])

        def about(stiffness: float) -> Regulator:
            A = np.array([[0.0, 1.0], [-stiffness / inertia, 0.0]])
            return lqr(*zero_order_hold(A, B, self.dt), [1.0, 1.0 / 300.0], [self.input_weight])

        return scheduled(about, disk.m * disk.g * disk.radius * _STIFFNESS)
