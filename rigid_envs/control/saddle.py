"""Steering a spin through the saddle at the intermediate axis: capture by weak torque."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import positive, require
from rigid_envs.control.linear import Regulator, lqr, zero_order_hold
from rigid_envs.control.saturation import clip_to_box
from rigid_envs.control.spin import SpinLaw
from rigid_envs.kernels.saddle import Shape, saddle_shape

__all__ = ["Saddle", "SeparatrixSteering", "saddle"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
_NEAR = 0.3  # of Omega: how far along the stable direction from e2 a spin may be caught,
_OFF = 0.08  # and how far from 1 the square of its rate over Omega may then be
_STUCK = 0.2  # of Omega: how far along the unstable direction of -e2 a spin is pushed


class Saddle(Shape):
    """Coordinates along the unstable and stable directions of the intermediate axis."""

    def coordinates(self, omega: Array) -> tuple[Array, Array]:
        """(d, s) of angular velocities, shape (..., 3)."""
        side = self.ratio * omega[..., 2]
        return omega[..., 0] - side, omega[..., 0] + side


def saddle(moments: npt.ArrayLike) -> Saddle:
    """The saddle of a body with principal moments I1 < I2 < I3 [kg m^2]."""
    return Saddle(*saddle_shape(*np.asarray(moments, dtype=np.float64).tolist()))


@dataclass(frozen=True)
class SeparatrixSteering(SpinLaw):
    """Brings any spin to e2 at the rate Omega by torques much weaker than the tumbling.

    In the coordinates of `Saddle`, over Omega, the motions that arrive at e2 or -e2 at that rate
    are those with ``p = s d = 0`` and ``E = omega2^2 + share (d^2 + s^2) - 1 = 0``. Both
    are constant without torque, so only torque changes ``W = (p^2 + E^2) / 2``, and each torque is
    set against what it would add:

        tau_k = -torque sat(gain I2 / I_k dW/domega_k),   W' = sum of dW/domega_k tau_k / I_k <= 0,

    with sat the limits of the actuator. A motion that comes near e2 at the right rate, and with an
    abs(d) that torque can hold, is caught by the feedback of least ``|omega - Omega e2|^2 +
    input_weight |tau|^2``. Near -e2 it is pushed along s, the unstable direction there.

    Certificate: `lyapunov`, W, never increases while the law steers, limits and missing actuators
    included (pushing and catching may add to it). With two actuators it rests only on the motions
    that lead to e2 or -e2, and on steady spins about an axis.

    Region: measured for the body (1, 2, 3), Omega = 1 and 0.1 N m, all spins of 0.5 to 1.5 rad/s in
    any direction are captured within 150 s by any two actuators or three. Within 60 s all are by
    three and by e1 and e3, 97 % by e2 and e3, 95 % by e1 and e2; the others spin fast about e3.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].
        dt: control period [s].
        axes: which body axes have an actuator.
        gain: action for a unit gradient of W.
        input_weight: weight of the torque that holds the spin [rad^2/s^2 / (N m)^2].

    Raises:
        ValueError: moments in another order, numbers that are not positive, or neither e1 nor e3
            with an actuator: torque about e2 alone keeps 2 T I2 - L^2.

    Source: Jurdjevic & Quinn 1978, doi:10.1016/0022-0396(78)90135-3, for feedback by the gradient
    of what the free motion keeps.
    """

    dt: float
    axes: tuple[bool, bool, bool] = (True, True, True)
    gain: float = 7.5
    input_weight: float = 0.3

    def __post_init__(self) -> None:
        """Check the numbers and the actuators too."""
        super().__post_init__()
        positive(self.dt, "dt", "s")
        positive(self.gain, "gain", "1")
        positive(self.input_weight, "input_weight", "rad^2/s^2 / (N m)^2")
        expected = "an actuator about e1 or e3: torque about e2 alone keeps 2 T I2 - L^2"
        require(self.axes[0] or self.axes[2], self.axes, "axes", expected)

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7).

        Entries without an actuator are 0.
        """
        w = self.omega(y) / self.rate
        _, s = self.saddle.coordinates(w)
        push = np.where(self._stuck(w), np.copysign(1.0, s), 0.0)[..., None] * [1.0, 0.0, 1.0]
        steer = push - self.gain * self.body.I2 / self.body.moments * self._gradient(w)
        action = np.where(self._caught(w)[..., None], self._hold(self.error(y)), steer)
        return clip_to_box(action) * self.axes

    def lyapunov(self, y: npt.ArrayLike) -> Array:
        """W of states y, shape (..., 7); of shape (...)."""
        p, E = self._invariants(self.omega(y) / self.rate)
        return np.asarray(0.5 * (p**2 + E**2))

    def steers(self, y: npt.ArrayLike) -> Bools:
        """Whether states y, shape (..., 7), are neither caught nor pushed out of -e2."""
        w = self.omega(y) / self.rate
        return np.asarray(~(self._caught(w) | self._stuck(w)))

    @cached_property
    def saddle(self) -> Saddle:
        """The saddle of the body."""
        return saddle(self.body.moments)

    @cached_property
    def regulator(self) -> Regulator:
        """K and P of the catch, in those components of omega - Omega e2 that can be controlled."""
        A, B = self.body.linearize(self.body.state(omega_body=[0.0, self.rate, 0.0]))
        states, inputs = 4 + self._controlled, np.flatnonzero(self.axes)
        F, G = zero_order_hold(A[np.ix_(states, states)], B[np.ix_(states, inputs)], self.dt)
        return lqr(F, G, np.ones(len(states)), np.full(len(inputs), self.input_weight))

    @property
    def reach(self) -> float:
        """The abs(d) that torque can hold: more than it takes away grows beyond that [rad/s]."""
        first, _, third = self.torque * np.array(self.axes) / self.body.moments
        return float(first + self.saddle.ratio * third) / (self.saddle.growth * self.rate)

    @property
    def _controlled(self) -> npt.NDArray[np.int64]:
        """Components of omega that torque can change near e2: omega2 only by torque about e2."""
        return np.array([0, 1, 2] if self.axes[1] else [0, 2])

    def _invariants(self, w: Array) -> tuple[Array, Array]:
        """(p, E) of w = omega / Omega."""
        d, s = self.saddle.coordinates(w)
        return s * d, w[..., 1] ** 2 + self.saddle.share * (d**2 + s**2) - 1.0

    def _gradient(self, w: Array) -> Array:
        """Derivatives of W along w: p = w1^2 - r^2 w3^2, d^2 + s^2 = 2 (w1^2 + r^2 w3^2)."""
        p, E = self._invariants(w)
        square, share = self.saddle.ratio**2, self.saddle.share
        of_p, of_E = [2.0, 0.0, -2.0 * square], [4.0 * share, 2.0, 4.0 * share * square]
        return np.asarray((p[..., None] * of_p + E[..., None] * of_E) * w)

    def _stuck(self, w: Array) -> Bools:
        _, s = self.saddle.coordinates(w)
        return np.asarray((w[..., 1] < 0.0) & (np.abs(s) < _STUCK))

    def _caught(self, w: Array) -> Bools:
        d, s = self.saddle.coordinates(w)
        _, E = self._invariants(w)
        near = (np.abs(d) < self.reach / self.rate) & (np.abs(s) < _NEAR)
        return np.asarray(near & (np.abs(E) < _OFF) & (w[..., 1] > 0.0))

    def _hold(self, error: Array) -> Array:
        """Actions of the catch."""
        action = np.zeros_like(error)
        feedback = self.regulator.feedback(error[..., self._controlled])
        action[..., np.flatnonzero(self.axes)] = feedback / self.torque
        return action
