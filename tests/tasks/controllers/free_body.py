"""Holding, capturing, flipping, stopping and turning a free body.

All laws take states y = (w, x, y, z, omega1, omega2, omega3), shape (..., 7), and return actions,
shape (..., n): what they ask for beyond the action space is left to the environment to clip. They
know the moments of the middle of the task's ranges.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_continuous_are

from rigid_envs import rotations
from rigid_envs.tasks import (
    AxisFlip,
    Detumble,
    IntermediateAxis,
    IntermediateAxisSingle,
    Reorient,
    SpinCapture,
)

__all__ = [
    "Saddle",
    "brake",
    "energy_casimir",
    "energy_casimir_single",
    "force_flip",
    "hold_by_lqr",
    "lqr_gain",
    "quaternion_pd",
    "riccati_gain",
    "riccati_law",
    "saddle",
    "separatrix_steering",
    "timed_flip",
]

Array = npt.NDArray[np.float64]


class Saddle(NamedTuple):
    """Coordinates in which the motion about the intermediate axis is as simple as it can be.

    With d = omega1 - ratio omega3 and s = omega1 + ratio omega3 Euler's equations read::

        d' = growth omega2 d,  s' = -growth omega2 s,  omega2' = bend (s^2 - d^2)

    exactly, not only near e2; so d is the unstable and s the stable direction at e2, and the
    other way round at -e2. Without torque the product s d = (2 T I2 - L^2) / (I1 (I2 - I1)) is
    kept, and so is ``omega2^2 + (bend / growth) (d^2 + s^2)``, the square of the rate at which a
    motion with s d = 0 arrives at e2 or -e2.

    Attributes:
        ratio: sqrt(I3 (I3 - I2) / (I1 (I2 - I1))).
        growth: growth rate over the rate of the spin, sqrt((I2 - I1)(I3 - I2) / (I1 I3)).
        bend: (I3 - I1) / (4 ratio I2).
    """

    ratio: float
    growth: float
    bend: float

    def coordinates(self, omega: Array) -> tuple[Array, Array]:
        """(d, s) of angular velocities, shape (..., 3)."""
        side = self.ratio * omega[..., 2]
        return omega[..., 0] - side, omega[..., 0] + side


def saddle(moments: Array) -> Saddle:
    """The saddle of a body with principal moments I1 < I2 < I3 [kg m^2]."""
    I1, I2, I3 = moments
    ratio = np.sqrt(I3 * (I3 - I2) / (I1 * (I2 - I1)))
    return Saddle(ratio, np.sqrt((I2 - I1) * (I3 - I2) / (I1 * I3)), (I3 - I1) / (4 * ratio * I2))


def lqr_gain(task: IntermediateAxis, price: float = 1.0) -> Array:
    """K of tau = -K (omega - Omega e2), least integral of |omega - Omega e2|^2 + price |tau|^2.

    For the exact linearisation of Euler's equations about spin at the rate Omega.
    """
    system = task.system()
    A, B = system.linearize(system.state(omega_body=[0.0, task.spin_rate, 0.0]))
    A, B = A[4:, 4:], B[4:]
    P = solve_continuous_are(A, B, np.eye(3), price * np.eye(3))
    return np.asarray(B.T @ P / price)


def hold_by_lqr(task: IntermediateAxis, y: Array) -> Array:
    """Spin about e2 held by linear feedback; see `lqr_gain`."""
    error = y[..., 4:7] - [0.0, task.spin_rate, 0.0]
    return -error @ lqr_gain(task).T / task.torque


def energy_casimir_single(
    task: IntermediateAxisSingle | IntermediateAxis,
    y: Array,
    strength: float = 3.0,
    damping: float = 5.0 / 3.0,
) -> Array:
    """tau3 = eps omega1 omega2 - k omega3, eps = strength (I2 - I1), k = damping I3 Omega.

    The first term changes I1 - I2 to I1 - I2 + eps in Euler's third equation. If that is positive
    (strength > 1), energy and Casimir function of a body whose e2 is the axis of an extreme moment
    are kept, and e2 is stable; the second term makes it attract.

    Source: Bloch & Marsden 1990, doi:10.1016/0167-6911(90)90055-Y.
    """
    I1, I2, I3 = task.system().moments
    w1, w2, w3 = np.moveaxis(y[..., 4:7], -1, 0)
    torque = strength * (I2 - I1) * w1 * w2 - damping * I3 * task.spin_rate * w3
    return np.asarray(torque / task.torque)[..., None]


def energy_casimir(task: IntermediateAxis, y: Array, damping: float = 5.0 / 3.0) -> Array:
    """`energy_casimir_single` with the other two torques against what is left of the error."""
    I1, I2, _ = damping * task.spin_rate * task.system().moments / task.torque
    third = energy_casimir_single(task, y, damping=damping)
    first, second = -I1 * y[..., 4:5], -I2 * (y[..., 5:6] - task.spin_rate)
    return np.concatenate([first, second, third], axis=-1)


def separatrix_steering(task: SpinCapture, y: Array) -> Array:
    """Onto the motion that leads to e2 at the rate Omega, in the coordinates of `Saddle`.

    Motion is to arrive at the rate Omega: ``excess = (omega2^2 + (bend / growth) (d^2 + s^2)) /
    Omega^2 - 1`` is reduced along its gradient. It is to arrive at e2 and not to leave: d is
    reduced, which brings ``2 T I2 - L^2`` to zero, and close to e2 catches the spin, unless it
    is too slow or about to be caught with too high a rate: then it must leave e2 once more. At
    -e2, s is pushed, for the spin to leave.
    """
    on = np.array(task.torques()) > 0.0
    moments, rate = task.system().moments, task.spin_rate
    r, growth, bend = saddle(moments)
    omega = y[..., 4:7] / rate
    w2, (d, s) = omega[..., 1], saddle(moments).coordinates(omega)
    excess = w2**2 + bend / growth * (d**2 + s**2) - 1.0
    near = (w2 > 0.0) & (np.maximum(np.abs(d), np.abs(s)) < 0.5)
    leave = (excess < -0.08) | ((excess > 0.08) & near)
    out = 3.0 * np.abs(excess) * np.copysign(np.maximum(np.abs(d), 0.3), d)
    push = np.where(w2 < 0.0, np.maximum(0.3 - np.abs(s), 0.0), 0.0)
    d_rate = np.where(leave, out, -10.0 * d)
    s_rate = -3.0 * excess * s + 10.0 * np.copysign(push, s)
    turn = [0.5 * (s_rate + d_rate), -3.0 * excess * w2, 0.5 * (s_rate - d_rate) / r]
    return np.stack(turn, axis=-1) * moments * rate**2 / task.torque * on


def force_flip(task: AxisFlip, y: Array) -> Array:
    """From e2 to -e2 by brute force: tau = -4 Omega I (omega + Omega e2)."""
    error = y[..., 4:7] + [0.0, task.spin_rate, 0.0]
    return -4.0 * task.spin_rate * task.system().moments * error / task.torque


def timed_flip(task: AxisFlip, y: Array, time_left: Array) -> Array:
    """Along the free motion that flips in time: tau = -1.5 Omega I (omega - omega_free).

    On the separatrix with s = 0 (see `Saddle`), with t the time after the half flip,
    ``omega2 = -Omega tanh(growth Omega t)`` and ``d = +- D / cosh(growth Omega t)``, D = Omega
    sqrt(growth / bend): the motion that is 0.6 of the tolerance away from -e2 when no time is
    left. Afterwards d decreases by itself, and only s and the rate are held.

    Args:
        task: the task, with numbers for its parameters.
        y: states, shape (..., 7).
        time_left: until the commanded time [s], shape (...); 0 afterwards.
    """
    moments, rate = task.system().moments, task.spin_rate
    r, growth, bend = saddle(moments)
    omega = y[..., 4:7] / rate
    d, _ = saddle(moments).coordinates(omega)
    most = np.sqrt(growth / bend)
    last = 0.6 * task.tolerance * 2.0 / np.hypot(1.0, 1.0 / r)
    phase = growth * rate * time_left - np.arccosh(most / last)
    before = time_left > 0.0
    d_free = np.where(before, np.copysign(most / np.cosh(phase), d), d)
    w2_free = np.where(before, np.tanh(phase), -np.sqrt(np.maximum(1.0 - (d / most) ** 2, 0.0)))
    free = np.stack([0.5 * d_free, w2_free, -0.5 * d_free / r], axis=-1)
    return -1.5 * rate**2 * moments * (omega - free) / task.torque


def riccati_gain(task: Detumble) -> float:
    """g of the law j = -g L that costs least: with the costs a |L + j|^2 + b |j|^2 of a step.

    ``P = b g`` and ``g = (a + P) / (a + b + P)``, so ``g^2 + (g - 1) a / b = 0``.
    """
    a = task.weight_momentum / task.start_momentum**2
    b = task.weight_impulse / task.impulse**2
    return float(0.5 * (np.sqrt((a / b) ** 2 + 4.0 * a / b) - a / b))


def riccati_law(task: Detumble, y: Array) -> Array:
    """The optimal feedback j = -g L; see `riccati_gain`."""
    return -riccati_gain(task) * task.system().moments * y[..., 4:7] / task.impulse


def brake(task: Detumble, y: Array) -> Array:
    """Largest impulse against L, or all that there is of L: to rest in the least time."""
    momentum = task.system().moments * y[..., 4:7]
    size = np.linalg.norm(momentum, axis=-1, keepdims=True)
    return -momentum / np.maximum(size, task.impulse)


def quaternion_pd(task: Reorient, y: Array, goal: Array) -> Array:
    """tau = -I (2 k vec(e) + 2 sqrt(k) omega), e = goal^-1 q with the sign that makes w >= 0.

    Critically damped for small angles, with k = 6 torque / I_max [1/s^2]. Both signs of e are the
    same attitude; without the choice the body would unwind: turn the long way round.

    Args:
        task: the task, with numbers for its parameters.
        y: states, shape (..., 7).
        goal: attitudes to reach, shape (..., 4).

    Source: Wie & Barba 1985, doi:10.2514/3.19988; Bhat & Bernstein 2000,
    doi:10.1016/S0167-6911(99)00090-0.
    """
    moments = task.system().moments
    k = 6.0 * task.torque / moments.max()
    error = rotations.canonicalize(rotations.multiply(rotations.conjugate(goal), y[..., :4]))
    acceleration = 2.0 * k * error[..., 1:] + 2.0 * np.sqrt(k) * y[..., 4:7]
    return -moments * acceleration / task.torque
