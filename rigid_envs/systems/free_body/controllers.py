"""Controllers of a free body."""

import abc
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base import checks
from rigid_envs.control.linear import Regulator, clip_to_ball, clip_to_box, lqr, zero_order_hold
from rigid_envs.control.predictive import Symbols, size
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.symbolic import casadi
from rigid_envs.systems.free_body.saddle import Shape, saddle_shape
from rigid_envs.systems.free_body.system import FreeBody

# A spin about the intermediate axis e2, the unstable one.


class Saddle(Shape):
    """Coordinates along the unstable and stable directions of the intermediate axis."""

    def coordinates(self, omega: checks.Array) -> tuple[checks.Array, checks.Array]:
        """(d, s) of angular velocities, shape (..., 3)."""
        side = self.ratio * omega[..., 2]
        return omega[..., 0] - side, omega[..., 0] + side

    def flip(self, margin: float, phase: checks.Array) -> tuple[checks.Array, checks.Array]:
        """Phase and abs(d) / Omega on the free flip that ends `margin` away from -e2 at phase 0.

        Args:
            margin: norm(omega + Omega e2) / Omega.
            phase: growth Omega times the time that is left; the phase that is returned is reckoned
                from the middle of the flip, where it is 0.
        """
        most = 1.0 / math.sqrt(self.share)
        last = 2.0 * margin / math.hypot(1.0, 1.0 / self.ratio)  # omega1 = d / 2 = -ratio omega3
        phase = phase - math.acosh(most / last)
        return phase, np.asarray(most / np.cosh(phase))


def saddle(moments: npt.ArrayLike) -> Saddle:
    """The saddle of a body with principal moments I1 < I2 < I3 [kg m^2]."""
    return Saddle(*saddle_shape(*np.asarray(moments, dtype=np.float64).tolist()))


_SLOWEST = 0.1  # of Omega: the growth of d is reckoned with at least this omega2


def check_actuators(axes: tuple[bool, bool, bool]) -> None:
    """Refuse body axes by which a spin cannot be led to e2.

    Raises:
        ValueError: neither e1 nor e3 has an actuator.
    """
    expected = "an actuator about e1 or e3: torque about e2 alone keeps 2 T I2 - L^2"
    checks.require(axes[0] or axes[2], axes, "axes", expected)


@dataclass(frozen=True)
class SpinController(checks.CheckedFields):
    """Base of the controllers for a spin about the intermediate axis.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].

    Raises:
        ValueError: moments in another order, a rate or a torque that is not positive.
    """

    body: FreeBody
    rate: Annotated[float, checks.positive, "rad/s"]
    torque: Annotated[float, checks.positive, "N m"]

    def __post_init__(self) -> None:
        """Check the order of the moments, the rate and the torque."""
        super().__post_init__()
        ordered = self.body.I1 < self.body.I2 < self.body.I3
        checks.require(ordered, self.body, "body", "I1 < I2 < I3: e2 is the intermediate axis")

    def inputs(self, action: npt.ArrayLike) -> checks.Array:
        """Input u of `FreeBody` [N m], shape (..., 3), of actions."""
        return self.torque * np.asarray(action, dtype=np.float64)

    def omega(self, y: npt.ArrayLike) -> checks.Array:
        """Angular velocity of states y, shape (..., 7), which are checked; body axes [rad/s]."""
        return self.body.checked_state(y)[..., 4:7]

    def error(self, y: npt.ArrayLike) -> checks.Array:
        """Error omega - Omega e2 of states y, shape (..., 7); body axes [rad/s]."""
        return self.omega(y) - [0.0, self.rate, 0.0]

    @cached_property
    def saddle(self) -> Saddle:
        """The saddle of the body."""
        return saddle(self.body.moments)

    def _growth(self, omega: checks.Array) -> checks.Array:
        """Growth rate lambda of d [1/s]."""
        return np.asarray(self.saddle.growth * np.maximum(omega[..., 1], _SLOWEST * self.rate))

    def _cancelling(self, omega: checks.Array, b: checks.Array, dt: float) -> checks.Array:
        """Impulses along b, of which one of 1 changes d by b . b, that cancel d within a period."""
        d, _ = self.saddle.coordinates(omega)
        grown = self._growth(omega) * dt
        return np.asarray((d * grown / np.expm1(-grown))[..., None] * b / (b @ b))


# Holding the spin by linear feedback.


@dataclass(frozen=True)
class SpinRegulator(SpinController):
    """Holds the spin by linear feedback, optimal near it: tau = -K (omega - Omega e2).

    K minimises the sum of ``|omega - Omega e2|^2 + input_weight |tau|^2`` over the control periods
    for Euler's equations linearised about the spin, ``I1 x1' = -(I3 - I2) Omega x3 + tau1``,
    ``I2 x2' = tau2`` and ``I3 x3' = -(I2 - I1) Omega x1 + tau3``, under torques that are held.

    Certificate: the Riccati matrix P, ``value(y) = x P x`` with x = omega - Omega e2, the sum from
    there on and a Lyapunov function.

    Region: measured for the body (1, 2, 3), Omega = 1 and 0.2 N m, perturbations up to 0.26 rad/s
    are brought back while omega2 stays positive. Along the unstable direction, d = omega1 - r
    omega3 with r = sqrt(I3 (I3 - I2) / (I1 (I2 - I1))), that is d up to 0.55, and at constant
    omega2 no controller holds more than ``torque (1 / I1 + r / I3) / growth``, 0.546 here. From
    further away the body flips first, and is caught later.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].
        dt: control period [s].
        input_weight: weight of the torque [rad^2/s^2 / (N m)^2].

    Raises:
        ValueError: moments in another order, or numbers that are not positive.

    Source: Anderson & Moore, *Optimal Control: Linear Quadratic Methods*, section 3.3.
    """

    dt: Annotated[float, checks.positive, "s"]
    input_weight: Annotated[float, checks.positive, "rad^2/s^2 / (N m)^2"] = 0.03

    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7)."""
        return clip_to_box(self.regulator.feedback(self.error(y)) / self.torque)

    def value(self, y: npt.ArrayLike) -> checks.Array:
        """Cost to go of states y, shape (..., 7), without limits; shape (...) [rad^2/s^2]."""
        return self.regulator.value(self.error(y))

    @cached_property
    def regulator(self) -> Regulator:
        """K and P in x = omega - Omega e2."""
        A, B = self.body.linearize(self.body.state(omega_body=[0.0, self.rate, 0.0]))
        F, G = zero_order_hold(A[4:, 4:], B[4:], self.dt)
        return lqr(F, G, np.ones(3), np.full(3, self.input_weight))


# Holding spin about the intermediate axis e2 at the least torque impulse.

_HOLDABLE = 0.999  # of the reach: a larger d is taken for this one
_TINY = 1e-300  # in place of a length of 0 that divides 0


@dataclass(frozen=True)
class MinimumFuelSpin(SpinController):
    """Brings the spin within a tolerance at the least torque impulse, the integral of |tau|.

    In coordinates d and s of `Saddle`, in rad/s, Euler's equations near e2 read

        d' = lambda d + b . tau,   b = (1 / I1, 0, -r / I3),   lambda = growth omega2.

    So d has to be cancelled. The stable s decays by itself, and meanwhile omega2 goes over into
    ``sqrt(omega2^2 + share s^2)``. So after the time `settle` the error of the spin is

        e = sqrt((sqrt(omega2^2 + share s^2) - Omega)^2 + c s^2),
        c = (1 + 1 / r^2) exp(-2 growth Omega settle) / 4.

    In every control period the least impulses are found that cancel d within the period, J_d along
    b, and that bring e to the edge of the tolerance, J_e at right angles to b: together they cost
    ``sqrt(J_d^2 + J_e^2)``, not the sum. If the limits allow them, they are given.

    Else it takes several periods. By Pontryagin's principle the torque is at any time that of the
    largest ``p . tau - |tau|`` within the limits. The costate p has length 1 when the torque ends;
    before, its part along b was larger by exp(lambda T), with T the time that is left: with full
    torque

        exp(-lambda T) = 1 - |d| / reach,   reach = torque (1 / I1 + r / I3) / lambda.

    So full torque about e1 and e3 comes first, then less and less about that of the two axes by
    which d costs more. All of this is computed anew in every period, from the state.

    Region: measured for the body (1, 2, 3), Omega = 1, 0.2 N m and a tolerance of 0.05,
    perturbations up to 0.32 rad/s are brought back while omega2 stays positive. From further away
    the body flips first, and is caught later. At rest, and in a steady spin about -e2, there is no
    torque.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].
        dt: control period [s].
        tolerance: norm(omega - Omega e2) / Omega that may be left.
        settle: time after which it may be left [s].

    Raises:
        ValueError: moments in another order, or numbers that are not positive.

    Source: Athans & Falb, *Optimal Control*, chapter 8, for least fuel; Landau & Lifshitz,
    *Mechanics*, section 37, for the growth.
    """

    dt: Annotated[float, checks.positive, "s"]
    tolerance: Annotated[float, checks.positive, "1"]
    settle: Annotated[float, checks.positive, "s"]

    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7)."""
        omega = self.omega(y)
        cancel, correct = self.impulses(y)
        whole = cancel + correct
        length = np.linalg.norm(whole, axis=-1, keepdims=True)
        earlier = self._growth_left(omega)[..., None] * cancel + correct
        action = whole / (self.torque * self.dt)
        limited = np.max(np.abs(action), axis=-1, keepdims=True) > 1.0
        return clip_to_box(
            np.where(limited, _least_fuel(earlier / np.maximum(length, _TINY)), action)
        )

    def impulses(self, y: npt.ArrayLike) -> tuple[checks.Array, checks.Array]:
        """J_d and J_e [N m s] of states y, shape (..., 7), without limits; shapes (..., 3)."""
        omega, b = self.omega(y), self._pull
        cancel = self._cancelling(omega, b, self.dt)
        error, slope = self._error_left(omega + cancel / self.body.moments)
        slope -= (slope @ b)[..., None] * b / (b @ b)
        excess = np.maximum(error - self.tolerance * self.rate, 0.0)
        steepness = np.maximum(np.sum(slope**2, axis=-1), _TINY)
        return cancel, -(error * excess / steepness)[..., None] * slope

    def _error_left(self, omega: checks.Array) -> tuple[checks.Array, checks.Array]:
        """Error e after the time `settle`, and the slope of e^2 / 2 by impulses."""
        r, growth, share = self.saddle
        (_, s), w2 = self.saddle.coordinates(omega), omega[..., 1]
        decay = math.exp(-growth * self.rate * self.settle)
        left = 0.25 * (1.0 + r**-2) * decay**2
        final = np.maximum(np.hypot(w2, math.sqrt(share) * s), _TINY)
        off = final - self.rate
        by_s, by_w2 = (off / final * share + left) * s, off / final * w2
        slope = np.stack([by_s, by_w2, r * by_s], axis=-1) / self.body.moments
        return np.sqrt(off**2 + left * s**2), slope

    def _growth_left(self, omega: checks.Array) -> checks.Array:
        """Growth of d until the last period that cancels it, exp(lambda (T - dt)), or 1."""
        d, _ = self.saddle.coordinates(omega)
        growth = self._growth(omega)
        reach = self.torque * np.sum(np.abs(self._pull)) / growth
        left = 1.0 - np.minimum(np.abs(d) / reach, _HOLDABLE)
        return np.asarray(np.maximum(np.exp(-growth * self.dt) / left, 1.0))

    @property
    def _pull(self) -> checks.Array:
        """Change b of d by an impulse [1 / (kg m^2)]."""
        return np.array([1.0, 0.0, -self.saddle.ratio]) / self.body.moments


def _least_fuel(costate: checks.Array) -> checks.Array:
    """The tau of the largest ``p . tau - |tau|`` with entries within [-1, 1], of p, |p| >= 1.

    It is clip(k p) with k = |tau|. Of the n larger entries at their limits, and a sum q of the
    squares of the others in p, ``k^2 = n / (1 - q)``; the n with the least k counts.
    """
    squares = np.sort(costate**2, axis=-1)
    others = np.cumsum(squares, axis=-1) - squares
    k = np.sqrt(np.min([3.0, 2.0, 1.0] / np.maximum(1.0 - others, _TINY), axis=-1, keepdims=True))
    return clip_to_box(k * costate)


# Steering a spin through the saddle at the intermediate axis: capture by weak torque.

_NEAR = 0.3  # of Omega: how far along the stable direction from e2 a spin may be caught,
_OFF = 0.08  # and how far from 1 the square of its rate over Omega may then be
_STUCK = 0.2  # of Omega: how far along the unstable direction of -e2 a spin is pushed


@dataclass(frozen=True)
class SeparatrixSteering(SpinController):
    """Brings any spin to e2 at the rate Omega by torques much weaker than the tumbling.

    In the coordinates of `Saddle`, over Omega, the motions that arrive at e2 or -e2 at that rate
    are those with ``p = s d = 0`` and ``E = omega2^2 + share (d^2 + s^2) - 1 = 0``. Both
    are constant without torque, so only torque changes ``W = (p^2 + E^2) / 2``, and each torque is
    set against what it would add:

        tau_k = -torque sat(gain I2 / I_k dW/domega_k),   W' = sum of dW/domega_k tau_k / I_k <= 0,

    with sat the limits of the actuator. A motion that comes near e2 at the right rate, and with an
    abs(d) that torque can hold, is caught by the feedback of least ``|omega - Omega e2|^2 +
    input_weight |tau|^2``. Near -e2 it is pushed along s, the unstable direction there.

    Certificate: `lyapunov`, W, never increases while the controller steers, limits and missing
    actuators included (pushing and catching may add to it). With two actuators it rests only on the
    motions that lead to e2 or -e2, and on steady spins about an axis.

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

    dt: Annotated[float, checks.positive, "s"]
    axes: tuple[bool, bool, bool] = (True, True, True)
    gain: Annotated[float, checks.positive, "1"] = 7.5
    input_weight: Annotated[float, checks.positive, "rad^2/s^2 / (N m)^2"] = 0.3

    def __post_init__(self) -> None:
        """Check the numbers and the actuators too."""
        super().__post_init__()
        check_actuators(self.axes)

    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7).

        Entries without an actuator are 0.
        """
        w = self.omega(y) / self.rate
        _, s = self.saddle.coordinates(w)
        push = np.where(self._stuck(w), np.copysign(1.0, s), 0.0)[..., None] * [1.0, 0.0, 1.0]
        steer = push - self.gain * self.body.I2 / self.body.moments * self._gradient(w)
        action = np.where(self._caught(w)[..., None], self._hold(self.error(y)), steer)
        return clip_to_box(action) * self.axes

    def lyapunov(self, y: npt.ArrayLike) -> checks.Array:
        """W of states y, shape (..., 7); of shape (...)."""
        p, E = self._invariants(self.omega(y) / self.rate)
        return np.asarray(0.5 * (p**2 + E**2))

    def steers(self, y: npt.ArrayLike) -> checks.Bools:
        """Whether states y, shape (..., 7), are neither caught nor pushed out of -e2."""
        w = self.omega(y) / self.rate
        return np.asarray(~(self._caught(w) | self._stuck(w)))

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

    def _invariants(self, w: checks.Array) -> tuple[checks.Array, checks.Array]:
        """(p, E) of w = omega / Omega."""
        d, s = self.saddle.coordinates(w)
        return s * d, w[..., 1] ** 2 + self.saddle.share * (d**2 + s**2) - 1.0

    def _gradient(self, w: checks.Array) -> checks.Array:
        """Derivatives of W along w: p = w1^2 - r^2 w3^2, d^2 + s^2 = 2 (w1^2 + r^2 w3^2)."""
        p, E = self._invariants(w)
        square, share = self.saddle.ratio**2, self.saddle.share
        of_p, of_E = [2.0, 0.0, -2.0 * square], [4.0 * share, 2.0, 4.0 * share * square]
        return np.asarray((p[..., None] * of_p + E[..., None] * of_E) * w)

    def _stuck(self, w: checks.Array) -> checks.Bools:
        _, s = self.saddle.coordinates(w)
        return np.asarray((w[..., 1] < 0.0) & (np.abs(s) < _STUCK))

    def _caught(self, w: checks.Array) -> checks.Bools:
        d, s = self.saddle.coordinates(w)
        _, E = self._invariants(w)
        near = (np.abs(d) < self.reach / self.rate) & (np.abs(s) < _NEAR)
        return np.asarray(near & (np.abs(E) < _OFF) & (w[..., 1] > 0.0))

    def _hold(self, error: checks.Array) -> checks.Array:
        """Actions of the catch."""
        action = np.zeros_like(error)
        feedback = self.regulator.feedback(error[..., self._controlled])
        action[..., np.flatnonzero(self.axes)] = feedback / self.torque
        return action


# Holding spin about the intermediate axis e2 by torques that keep a changed energy.


@dataclass(frozen=True)
class SingleTorque(SpinController):
    """Aligns the spin with e2 by one torque: tau3 = eps omega1 omega2 - k omega3.

    With ``a = eps - (I2 - I1)``, Euler's third equation becomes ``I3 omega3' = a omega1 omega2 - k
    omega3``. If a > 0 the gyroscopic term has changed its sign: e2 is stable, if a < 0 it is not.
    Under any torque about e3 ``C = I1 (I3 - I1) omega1^2 + I2 (I3 - I2) omega2^2`` is constant, so
    the rate at the end is sqrt(C / (I2 (I3 - I2))), whatever Omega is.

    Certificate: the Lyapunov function

        D = a I1 omega1^2 / 2 + (I3 - I2) I3 omega3^2 / 2,   D' = -(I3 - I2) k omega3^2.

    Where ``D < a C / (2 (I3 - I1))``, omega2 cannot change its sign, as all of C would have to be
    in omega1; so where omega2 > 0 too the spin is led to e2 (LaSalle), from as far away as that:
    `certified`. That is without limits. Measured for the body (1, 2, 3), Omega = 1 and 0.45 N m,
    perturbations up to 0.22 rad/s are brought back while omega2 stays positive; along the unstable
    direction (see `SpinRegulator`) d up to 0.46, where 0.45 can be held at constant omega2.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about e3 [N m].
        strength: eps / (I2 - I1); above 1.
        damping: k / (I3 Omega).

    Raises:
        ValueError: moments in another order, or numbers that are not positive.

    Source: Bloch & Marsden 1990, doi:10.1016/0167-6911(90)90055-Y.
    """

    # a controller that is too weak may be made, to see it fail
    strength: Annotated[float, checks.positive, "1"] = 3.0
    damping: Annotated[float, checks.positive, "1"] = 5.0 / 3.0

    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 1), of states y, shape (..., 7)."""
        w1, w2, w3 = np.moveaxis(self.omega(y), -1, 0)
        torque = self.eps * w1 * w2 - self.k * w3
        return clip_to_box(np.asarray(torque / self.torque)[..., None])

    def inputs(self, action: npt.ArrayLike) -> checks.Array:
        """Input u of `FreeBody` [N m], shape (..., 3), of actions (..., 1)."""
        return super().inputs(action) * [0.0, 0.0, 1.0]

    @property
    def threshold(self) -> float:
        """Stability threshold of eps, I2 - I1 [kg m^2]."""
        return self.body.I2 - self.body.I1

    @property
    def eps(self) -> float:
        """Strength of the first term [kg m^2]."""
        return self.strength * self.threshold

    @property
    def k(self) -> float:
        """Strength of the damping [N m s]."""
        return self.damping * self.body.I3 * self.rate

    def exponents(self) -> npt.NDArray[np.complex128]:
        """Characteristic exponents mu of small departures from e2 [1/s], shape (2,), complex.

        ``mu^2 + k mu / I3 + a (I3 - I2) Omega^2 / (I1 I3) = 0``.
        """
        I1, I2, I3 = self.body.moments
        stiffness = (self.eps - self.threshold) * (I3 - I2) * self.rate**2 / (I1 * I3)
        half = 0.5 * self.k / I3
        root = np.sqrt(complex(half**2 - stiffness))
        return np.array([-half + root, -half - root])

    def lyapunov(self, y: npt.ArrayLike) -> checks.Array:
        """D of states y, shape (..., 7); of shape (...) [kg^2 m^4/s^2]."""
        I1, I2, I3 = self.body.moments
        w1, _, w3 = np.moveaxis(self.omega(y), -1, 0)
        return np.asarray(0.5 * ((self.eps - self.threshold) * I1 * w1**2 + (I3 - I2) * I3 * w3**2))

    def certified(self, y: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether states y, shape (..., 7), lead to e2 without limits; shape (...)."""
        I1, I2, I3 = self.body.moments
        w1, w2, _ = np.moveaxis(self.omega(y), -1, 0)
        level = (
            0.5 * (self.eps - self.threshold) * (I1 * w1**2 + I2 * (I3 - I2) / (I3 - I1) * w2**2)
        )
        return np.asarray((self.lyapunov(y) < level) & (w2 > 0.0))


@dataclass(frozen=True)
class EnergyCasimir(SpinController):
    """Holds the spin by `SingleTorque` about e3, and by damping about e1 and e2.

    ``tau = (-k1 omega1, -k2 (omega2 - Omega), eps omega1 omega2 - k3 omega3)``, each k_j = damping
    Omega I_j. Energy and Casimir function of the body that the eps-term makes of this one,

        V = ((a + s) I1 omega1^2 + s (I3 - I2) / (I3 - I1) I2 (omega2 - Omega)^2
             + (I3 - I2) I3 omega3^2) / 2,

    with a = eps - (I2 - I1) > 0 and any s > 0, change under these torques only through

        V' = -(a + s) k1 omega1^2 - s (I3 - I2) / (I3 - I1) k2 (omega2 - Omega)^2
             - (I3 - I2) (k3 omega3^2 + s Omega omega1 omega3).

    Certificate: with ``s = 2 damping^2 I1 I3 / (I3 - I2)`` V' is negative everywhere but at the
    spin: without limits it is reached from every state there is. Measured for the body (1, 2, 3),
    Omega = 1 and 0.2 N m, perturbations up to 0.26 rad/s are brought back while omega2 stays
    positive.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].
        strength: eps / (I2 - I1), above 1.
        damping: rate of the decay over Omega.

    Raises:
        ValueError: moments in another order, a strength up to 1, or numbers that are not positive.

    Source: Bloch & Marsden 1990, doi:10.1016/0167-6911(90)90055-Y; V' from Euler's equations.
    """

    strength: float = 3.0
    damping: Annotated[float, checks.positive, "1"] = 3.0

    def __post_init__(self) -> None:
        """Check the gains too."""
        super().__post_init__()
        strong = checks.number(self.strength, "strength", "1") > 1.0
        checks.require(strong, self.strength, "strength", "more than 1, the threshold")

    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7)."""
        w1, w2, _ = np.moveaxis(self.omega(y), -1, 0)
        eps = self.strength * (self.body.I2 - self.body.I1)
        torque = -self.damping * self.rate * self.body.moments * self.error(y)
        torque[..., 2] += eps * w1 * w2
        return clip_to_box(torque / self.torque)

    def lyapunov(self, y: npt.ArrayLike) -> checks.Array:
        """V of states y, shape (..., 7); of shape (...) [kg^2 m^4/s^2]."""
        return np.asarray(0.5 * np.sum(self._weights * self.body.moments * self.error(y) ** 2, -1))

    def lyapunov_rate(self, y: npt.ArrayLike) -> checks.Array:
        """V' of states y, shape (..., 7), without limits; of shape (...) [kg^2 m^4/s^3]."""
        e1, e2, e3 = np.moveaxis(self.error(y), -1, 0)
        k = self.damping * self.rate * self.body.moments
        lost = np.sum(self._weights * k * np.stack([e1, e2, e3], axis=-1) ** 2, axis=-1)
        return np.asarray(-lost - self._share * (self.body.I3 - self.body.I2) * self.rate * e1 * e3)

    @property
    def _share(self) -> float:
        """Share s of the Casimir function, in the middle of those that V' allows."""
        return 2.0 * self.damping**2 * self.body.I1 * self.body.I3 / (self.body.I3 - self.body.I2)

    @property
    def _weights(self) -> checks.Array:
        """Of I_j times the squares in 2 V."""
        I1, I2, I3 = self.body.moments
        s, a = self._share, (self.strength - 1.0) * (I2 - I1)
        return np.array([a + s, s * (I3 - I2) / (I3 - I1), I3 - I2])


# Reversing a spin in the body: by the free flip, timed, and by brute force.


@dataclass(frozen=True)
class ForcedFlip(SpinController):
    """Turns the spin to -e2 by brute force: tau = -gain Omega I (omega + Omega e2).

    Certificate: the kinetic energy of the error e = omega + Omega e2, ``V = e . I e / 2``. With
    tau, Euler's equations give ``V' = Omega (I3 - I1) e1 e3 - 2 gain Omega V <= -(2 gain - (I3 -
    I1) / sqrt(I1 I3)) Omega V``: without limits -e2 is reached from everywhere. From e2 it costs
    the torque impulse 2 I2 Omega, twice the angular momentum.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega [rad/s].
        torque: largest torque about each axis [N m].
        gain: rate of the approach over Omega.

    Raises:
        ValueError: moments in another order, numbers that are not positive, or a gain that does not
            make V decrease.

    Source: Landau & Lifshitz, *Mechanics*, section 36, for Euler's equations.
    """

    gain: float = 4.0

    def __post_init__(self) -> None:
        """Check the gain too."""
        super().__post_init__()
        I1, _, I3 = self.body.moments
        _check_gain(self.gain, 0.5 * (I3 - I1) / math.sqrt(I1 * I3))

    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7)."""
        torque = -self.gain * self.rate * self.body.moments * self._error(y)
        return clip_to_box(torque / self.torque)

    def lyapunov(self, y: npt.ArrayLike) -> checks.Array:
        """V of states y, shape (..., 7); of shape (...) [J]."""
        return np.asarray(0.5 * np.sum(self.body.moments * self._error(y) ** 2, axis=-1))

    def _error(self, y: npt.ArrayLike) -> checks.Array:
        return self.omega(y) - [0.0, -self.rate, 0.0]


@dataclass(frozen=True)
class TimedFlip(SpinController):
    """Lets the spin flip from e2 to -e2 by itself, in time: tau = -gain Omega I (omega - f).

    f is a free motion. On the separatrix with s = 0 (see `Saddle`), with t the time after the half
    flip and D = 1 / sqrt(share),

        f2 = -Omega tanh(growth Omega t),   d = +- Omega D / cosh(growth Omega t),

    the one of these that is `margin` away from -e2 when no time is left, with the sign of d that
    omega has. Afterwards d decreases by itself, and only s and the rate are held. The only effort
    is that of joining f, and that falls like exp(-growth Omega T) with the time T that is given.

    Certificate: the kinetic energy of the difference e = omega - f, ``V = e . I e / 2``. With tau,
    until the commanded time,

        V' = f . (e x I e) - 2 gain Omega V <= -(2 gain - c) Omega V,
        c = sqrt(I2 / I1) (I3 - I1) / sqrt(I1 I3),

    as ``|f| <= sqrt(I2 / I1) Omega`` by its energy, and ``|e x I e| <= (I3 - I1) / sqrt(I1 I3) V``
    by Kantorovich's inequality: without limits f is joined from everywhere. (The sign of d decides
    between two f, of which the nearer one is taken.)

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega [rad/s].
        torque: largest torque about each axis [N m].
        margin: norm(omega + Omega e2) / Omega that is left at the commanded time.
        gain: rate at which f is joined over Omega.

    Raises:
        ValueError: moments in another order, numbers that are not positive, or a gain that does not
            make V decrease.

    Source: Landau & Lifshitz, *Mechanics*, section 37; Van Damme, Mardesic & Sugny 2017,
    arXiv:1606.08237.
    """

    margin: Annotated[float, checks.positive, "1"] = 0.03
    gain: float = 1.5

    def __post_init__(self) -> None:
        """Check the margin and the gain too."""
        super().__post_init__()
        I1, I2, I3 = self.body.moments
        _check_gain(self.gain, 0.5 * math.sqrt(I2 / I1) * (I3 - I1) / math.sqrt(I1 * I3))

    def __call__(self, y: npt.ArrayLike, time_left: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: states, shape (..., 7).
            time_left: until the commanded time [s], shape (...); 0 or less afterwards.
        """
        error = self.omega(y) - self.reference(y, time_left)
        return clip_to_box(-self.gain * self.rate * self.body.moments * error / self.torque)

    def lyapunov(self, y: npt.ArrayLike, time_left: npt.ArrayLike) -> checks.Array:
        """V of states y, shape (..., 7); of shape (...) [J]."""
        error = self.omega(y) - self.reference(y, time_left)
        return np.asarray(0.5 * np.sum(self.body.moments * error**2, axis=-1))

    def reference(self, y: npt.ArrayLike, time_left: npt.ArrayLike) -> checks.Array:
        """The free motion f to join [rad/s], shape (..., 3); arguments as of a call."""
        r, growth, share = self.saddle
        d, _ = self.saddle.coordinates(self.omega(y) / self.rate)
        left = checks.array(time_left, "time_left")
        phase, free = self.saddle.flip(self.margin, growth * self.rate * np.maximum(left, 0.0))
        before = left > 0.0
        d_free = np.where(before, np.copysign(free, d), d)
        late = -np.sqrt(np.maximum(1.0 - (d * math.sqrt(share)) ** 2, 0.0))
        w2_free = np.where(before, np.tanh(phase), late)
        return self.rate * np.stack([0.5 * d_free, w2_free, -0.5 * d_free / r], axis=-1)


def _check_gain(gain: float, least: float) -> None:
    expected = f"more than {least:.4g}, for the error of this body to decrease"
    checks.require(checks.number(gain, "gain") > least, gain, "gain", expected)


# Taking the angular momentum of a body by impulses: at least cost, and in least time.


@dataclass(frozen=True)
class ImpulseController(checks.CheckedFields, abc.ABC):
    """A controller for impulses on a body that drifts freely between them.

    The drift turns the angular momentum L in the body and keeps its size |L|. No impulse takes more
    from that than its own size, and only impulses against L take so much.

    Attributes:
        body: rigid body to control.
        impulse: largest impulse [N m s].

    Raises:
        ValueError: an impulse that is not positive.
    """

    body: FreeBody
    impulse: Annotated[float, checks.positive, "N m s"]

    @abc.abstractmethod
    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, impulses over the largest, shape (..., 3), of states y, shape (..., 7)."""

    def after(self, y: npt.ArrayLike, action: npt.ArrayLike) -> checks.Array:
        """States, shape (..., 7), after the impulses of actions, shape (..., 3); then it drifts."""
        state = self.body.checked_state(y).copy()
        kick = self.impulse * np.asarray(action, dtype=np.float64)
        state[..., 4:] += kick / self.body.moments
        return state

    def momentum(self, y: npt.ArrayLike) -> checks.Array:
        """L in body axes of states y, shape (..., 7), which are checked [N m s]."""
        return self.body.L_body(self.body.checked_state(y))


@dataclass(frozen=True)
class MomentumRegulator(ImpulseController):
    """Brings L to zero at the least cost: j = -g L.

    A step costs ``a |L + j|^2 + b |j|^2``. The cost to go is ``P |L|^2`` with the root P = b g of
    the scalar Riccati equation ``P = b (a + P) / (a + b + P)``, where

        g = (sqrt((a / b)^2 + 4 a / b) - a / b) / 2 = (a + P) / (a + b + P).

    Certificate: P, in closed form: ``value(y) = P |L|^2`` is the sum of all costs from there on,
    and no controller has a smaller one.

    Region: everywhere. The impulse stays in the ball, and the controller optimal, while |L| <=
    `reach`; beyond, the largest impulse against L is taken.

    Attributes:
        body: rigid body to control.
        impulse: largest impulse [N m s].
        weight_momentum: a [1 / (N m s)^2].
        weight_impulse: b [1 / (N m s)^2].

    Raises:
        ValueError: numbers that are not positive.

    Source: Bertsekas, *Dynamic Programming and Optimal Control*, volume I, section 4.1.
    """

    weight_momentum: Annotated[float, checks.positive, "1 / (N m s)^2"]
    weight_impulse: Annotated[float, checks.positive, "1 / (N m s)^2"]

    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, impulses over the largest, shape (..., 3), of states y, shape (..., 7)."""
        return clip_to_ball(-self.gain * self.momentum(y) / self.impulse)

    @property
    def gain(self) -> float:
        """Part g of L that is taken in a step."""
        ratio = self.weight_momentum / self.weight_impulse
        return 2.0 * ratio / (math.sqrt(ratio * (ratio + 4.0)) + ratio)  # nothing cancels

    @property
    def riccati(self) -> float:
        """P = b g [1 / (N m s)^2]."""
        return self.weight_impulse * self.gain

    @property
    def reach(self) -> float:
        """The |L| up to which the controller is not limited [N m s]."""
        return self.impulse / self.gain

    def value(self, y: npt.ArrayLike) -> checks.Array:
        """Cost to go of states y, shape (..., 7), with |L| <= `reach`; shape (...)."""
        return np.asarray(self.riccati * np.sum(self.momentum(y) ** 2, axis=-1))


@dataclass(frozen=True)
class MomentumBrake(ImpulseController):
    """Brings L to zero in the least time: the largest impulse against L, or all of L that is left.

    Certificate: ``n_steps(y) = ceil(|L| / impulse)`` decreases by one in every step, and no
    controller makes it decrease faster, since no impulse takes more than its size from |L|.

    Attributes:
        body: rigid body to control.
        impulse: largest impulse [N m s].

    Raises:
        ValueError: an impulse that is not positive.
    """

    def __call__(self, y: npt.ArrayLike) -> checks.Array:
        """Actions, impulses over the largest, shape (..., 3), of states y, shape (..., 7)."""
        return clip_to_ball(-self.momentum(y) / self.impulse)

    def n_steps(self, y: npt.ArrayLike) -> checks.Array:
        """Least number of impulses to rest of states y, shape (..., 7); of shape (...)."""
        return np.asarray(np.ceil(np.linalg.norm(self.momentum(y), axis=-1) / self.impulse))


# Slewing a body from rest to rest: quaternion feedback, and a lower bound on the time.


@dataclass(frozen=True)
class QuaternionPD(checks.CheckedFields):
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
    torque: Annotated[float, checks.positive, "N m"]
    stiffness: Annotated[float, checks.positive, "1"] = 6.0

    def __call__(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> checks.Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: states, shape (..., 7).
            goal: attitudes to reach (w, x, y, z), body to world, shape (..., 4).
        """
        e, omega = self._error(y, goal)
        acceleration = 2.0 * self.k * e[..., 1:] + self.c * omega
        return clip_to_box(-self.body.moments * acceleration / self.torque)

    def inputs(self, action: npt.ArrayLike) -> checks.Array:
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

    def lyapunov(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> checks.Array:
        """V of states (..., 7) and goals (..., 4); of shape (...)."""
        e, omega = self._error(y, goal)
        return np.asarray(np.sum(omega**2, axis=-1) / (4.0 * self.k) + 2.0 * (1.0 - e[..., 0]))

    def lyapunov_rate(self, y: npt.ArrayLike) -> checks.Array:
        """V' of states (..., 7) without limits; of shape (...) [1/s]. The goal is not in it."""
        omega = self.body.checked_state(y)[..., 4:7]
        I1, I2, I3 = self.body.moments
        n = (I1 - I2) * (I2 - I3) * (I3 - I1) / (I1 * I2 * I3)
        lost = self.c * np.sum(omega**2, axis=-1) + n * np.prod(omega, axis=-1)
        return np.asarray(-lost / (2.0 * self.k))

    def _error(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> tuple[checks.Array, checks.Array]:
        """The error e, w >= 0, and omega."""
        state = self.body.checked_state(y)
        e = rotations.multiply(rotations.conjugate(goal), state[..., :4])
        return rotations.canonicalize(e), state[..., 4:]


def slew_acceleration(moments: npt.ArrayLike, torque: float) -> checks.Array:
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
    checks.positive(torque, "torque", "N m")
    inverse = 1.0 / checks.positive_array(moments, "moments", "kg m^2")
    return np.asarray(torque * np.sqrt(inverse.sum(axis=0) * inverse.max(axis=0)))


def least_slew_time(body: FreeBody, torque: float, angle: npt.ArrayLike) -> checks.Array:
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
    return np.asarray(2.0 * np.sqrt(checks.array(angle, "angle") / a))


# Problems for predictive control: a spin about the middle axis, a top on its pivot, a ball.


@dataclass(frozen=True)
class HeldSpin(SpinController):
    """Holding a spin about the intermediate axis at the least torque impulse.

    Coordinates x: omega in body axes. Cost: ``|tau| + weight |omega - Omega e2|^2``.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].
        weight: of the deviation [N m / (rad/s)^2].

    Raises:
        ValueError: moments in another order, or numbers that are not positive.
    """

    weight: Annotated[float, checks.positive, "N m / (rad/s)^2"] = 1.0

    sizes: ClassVar[tuple[int, int, int]] = (3, 3, 0)

    def coordinates(self, y: npt.ArrayLike) -> checks.Array:
        """Angular velocity of states y."""
        return self.omega(y)

    def step(self, x: Symbols, a: Symbols, h: float) -> Symbols:
        """Angular velocity after a time h [s]; it does not depend on the attitude."""
        y = casadi().vertcat(casadi().DM(4, 1), x)
        return self.body.symbolic().step(h)(y, self.torque * a)[4:]

    def cost(self, x: Symbols, a: Symbols, goal: Symbols) -> Symbols:
        """Torque and deviation."""
        off = x - casadi().DM([0.0, self.rate, 0.0])
        return self.torque * size(a) + self.weight * casadi().sumsqr(off)

    def limits(self, x: Symbols, a: Symbols) -> Symbols:
        """None but those of the actions."""
        return casadi().SX(0, 1)
