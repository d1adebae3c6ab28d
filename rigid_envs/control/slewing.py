"""Slewing a body from rest to rest: quaternion feedback, and a lower bound on the time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.checks import array, positive, positive_array
from rigid_envs.control.saturation import clip_to_box
from rigid_envs.systems import FreeBody

__all__ = ["QuaternionPD", "least_slew_time", "slew_acceleration"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class QuaternionPD:
    """Turns a body to an attitude by the smaller angle: tau = -I (2 k vec(e) + c omega).

    e = goal^-1 q is the error with the sign that makes its w >= 0. Both signs are one attitude;
    without the choice the body would unwind: turn by the larger angle. For small angles this is
    ``angle'' = -k angle - c angle'``, critically damped with c = 2 sqrt(k).

    Certificate: the Lyapunov function ``V = |omega|^2 / (4 k) + 2 (1 - |w|)``, which is 0 at the
    goal and 2 at most at rest. With ``n = (I1 - I2)(I2 - I3)(I3 - I1) / (I1 I2 I3)`` and no limits

        V' = -(c / 2 k) |omega|^2 - (n / 2 k) omega1 omega2 omega3 < 0

    while |omega| < 3 sqrt(3) c / |n|, which is beyond the rates that a turn takes.

    Region: the torque is not limited from where ``V <= limit_free``. From further away it is, and
    that every turn from rest arrives within 10 s is measured: for the body (1, 2, 3) and 0.5 N m.

    Attributes:
        body: rigid body to control.
        torque: largest torque about each axis [N m].
        stiffness: k I_max / torque. The torque is at its limits for large errors, so that time is
            spent in between; the larger it is the later it brakes.

    Raises:
        ValueError: numbers that are not positive.

    Source: Wie & Barba 1985, doi:10.2514/3.19988; Bhat & Bernstein 2000,
    doi:10.1016/S0167-6911(99)00090-0.
    """

    body: FreeBody
    torque: float
    stiffness: float = 6.0

    def __post_init__(self) -> None:
        """Check the torque and the stiffness."""
        positive(self.torque, "torque", "N m")
        positive(self.stiffness, "stiffness", "1")

    def __call__(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: states, shape (..., 7).
            goal: attitudes to reach (w, x, y, z), body to world, shape (..., 4).
        """
        e, omega = self._error(y, goal)
        acceleration = 2.0 * self.k * e[..., 1:] + self.c * omega
        return clip_to_box(-self.body.moments * acceleration / self.torque)

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `FreeBody` [N m], shape (..., 3), of actions."""
        return self.torque * np.asarray(action, dtype=np.float64)

    @property
    def k(self) -> float:
        """Square of the frequency for small angles [1/s^2]."""
        return self.stiffness * self.torque / float(self.body.moments.max())

    @property
    def c(self) -> float:
        """Critical damping 2 sqrt(k) [1/s]."""
        return 2.0 * math.sqrt(self.k)

    @property
    def limit_free(self) -> float:
        """Level of V below which the torque is not saturated.

        ``|2 k vec(e) + c omega| <= 2 k sqrt(5 V)``, as ``V >= |omega|^2 / (4 k) + |vec(e)|^2``.
        """
        most = self.torque / (2.0 * self.k * float(self.body.moments.max()))
        return most**2 / 5.0

    def lyapunov(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> Array:
        """V of states (..., 7) and goals (..., 4); of shape (...)."""
        e, omega = self._error(y, goal)
        return np.asarray(np.sum(omega**2, axis=-1) / (4.0 * self.k) + 2.0 * (1.0 - e[..., 0]))

    def lyapunov_rate(self, y: npt.ArrayLike) -> Array:
        """V' of states (..., 7) without limits; of shape (...) [1/s]. The goal is not in it."""
        omega = self.body.checked_state(y)[..., 4:7]
        I1, I2, I3 = self.body.moments
        n = (I1 - I2) * (I2 - I3) * (I3 - I1) / (I1 * I2 * I3)
        lost = self.c * np.sum(omega**2, axis=-1) + n * np.prod(omega, axis=-1)
        return np.asarray(-lost / (2.0 * self.k))

    def _error(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> tuple[Array, Array]:
        """The error e, w >= 0, and omega."""
        state = self.body.checked_state(y)
        e = rotations.multiply(rotations.conjugate(goal), state[..., :4])
        return rotations.canonicalize(e), state[..., 4:]


def slew_acceleration(moments: npt.ArrayLike, torque: float) -> Array:
    """Bound on the growth of a body's rate from rest [rad/s^2].

    ``a = torque sqrt((1 / I1 + 1 / I2 + 1 / I3) / I_min)``: the energy grows by
    ``(sqrt(2 T))' = omega . tau / sqrt(2 T) <= torque sqrt(sum 1 / I_k)`` (Cauchy and Schwarz), and
    ``|omega| <= sqrt(2 T / I_min)``, so that ``|omega| <= a t``.

    Args:
        moments: principal moments [kg m^2], shape (3, ...).
        torque: largest torque about each axis [N m].

    Returns:
        Shape (...).

    Raises:
        ValueError: moments or torque that are not positive and finite.
    """
    positive(torque, "torque", "N m")
    inverse = 1.0 / positive_array(moments, "moments", "kg m^2")
    return np.asarray(torque * np.sqrt(inverse.sum(axis=0) * inverse.max(axis=0)))


def least_slew_time(body: FreeBody, torque: float, angle: npt.ArrayLike) -> Array:
    """Lower bound [s] on the time of a turn from rest to rest by an angle: ``2 sqrt(angle / a)``.

    The rate is at most a t (`slew_acceleration`), backwards from the goal likewise, and the angle
    is at most the integral of the smaller of both.

    Args:
        body: rigid body to control.
        torque: largest torque about each axis [N m].
        angle: angle between the attitudes [rad], shape (...).

    Returns:
        Times of the shape of angle.
    """
    a = slew_acceleration(body.moments, torque)
    return np.asarray(2.0 * np.sqrt(array(angle, "angle") / a))
