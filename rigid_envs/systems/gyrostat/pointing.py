"""Controllers of a satellite that keeps a camera, along e3, on a point of the ground."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, Integers, array, positive
from rigid_envs.control.linear import clip_to_box
from rigid_envs.mechanics import rotations
from rigid_envs.systems.gyrostat.controllers import Wheels

# The line of sight from a satellite to a point of the ground.


class Sight(NamedTuple):
    """A line of sight.

    Attributes:
        direction: from the satellite to its target, unit vectors, shape (..., 3).
        rate: angular velocity of the direction, across it, shape (..., 3) [rad/s].
        acceleration: derivative of the rate in space, shape (..., 3) [rad/s^2].
    """

    direction: Array
    rate: Array
    acceleration: Array

    @classmethod
    def checked(
        cls, direction: npt.ArrayLike, rate: npt.ArrayLike, acceleration: npt.ArrayLike
    ) -> "Sight":
        """A line of sight of vectors of any kind.

        Raises:
            ValueError: bad shapes or numbers.
        """
        parts = direction, rate, acceleration
        return cls(*(array(part, name, 3) for part, name in zip(parts, cls._fields, strict=True)))

    def seen(self, q: Array) -> "Sight":
        """The same vectors in other axes, which a rotation q leads to from the old ones."""
        return Sight(*(rotations.rotate(q, part) for part in self))

    @property
    def twist(self) -> Array:
        """Rate at which the direction of `rate` turns about the line of sight, shape (...)."""
        across = np.cross(self.rate, self.acceleration)
        turning = np.sum(across * self.direction, axis=-1)
        return np.asarray(turning / np.sum(self.rate**2, axis=-1))

    @property
    def roll(self) -> Array:
        """Angle from e1 to the rate, after the turn that leads the direction to e3, shape (...)."""
        a, b, _ = np.moveaxis(
            rotations.rotate(rotations.exp(-off_axis(self.direction)), self.rate), -1, 0
        )
        return np.asarray(np.arctan2(b, a))


def off_axis(direction: Array) -> Array:
    """Rotation vector about e1 and e2 that leads e3 to a direction, shape (..., 3) [rad]."""
    a, b, c = np.moveaxis(direction, -1, 0)
    sine = np.hypot(a, b)
    factor = np.arctan2(sine, c) / np.maximum(sine, 1e-300)
    return np.stack([-factor * b, factor * a, 0.0 * factor], axis=-1)


@dataclass(frozen=True)
class FlyOver(CheckedFields):
    """A satellite on a circle about a sphere that does not turn, and a point of the sphere.

    In the axes of the pass, x across, y along the flight in its middle and z up there, the
    satellite is at the angle phi from the middle, r (0, sin(phi), cos(phi)), and its target at the
    angle beta from the plane of the orbit, R (sin(beta), 0, cos(beta)).

    Attributes:
        rate: phi', angular velocity of the satellite about the centre [rad/s].
        height: altitude over the radius of the sphere.

    Raises:
        ValueError: numbers that are not positive.
    """

    rate: Annotated[float, positive, "rad/s"]
    height: Annotated[float, positive, "1"]

    def sight(self, phi: npt.ArrayLike, beta: npt.ArrayLike) -> Sight:
        """The line of sight in the axes of the pass.

        With the target at d, it turns at ``omega = d x d' / d^2``, and ``omega' = (d x d'' - 2 d .
        d' omega) / d^2``.

        Args:
            phi: angle of the satellite from the middle of the pass, shape (...) [rad].
            beta: angle of the target from the plane of the orbit, shape (...) [rad].
        """
        place, side = np.broadcast_arrays(array(phi, "phi"), array(beta, "beta"))
        zero, r = np.zeros(place.shape), 1.0 + self.height
        along, up = r * np.sin(place), r * np.cos(place)
        d = np.stack([np.sin(side), -along, np.cos(side) - up], axis=-1)
        velocity = self.rate * np.stack([zero, -up, along], axis=-1)
        acceleration = self.rate**2 * np.stack([zero, along, up], axis=-1)
        square = np.sum(d * d, axis=-1, keepdims=True)
        omega = np.cross(d, velocity) / square
        slowing = 2.0 * np.sum(d * velocity, axis=-1, keepdims=True) * omega
        change = (np.cross(d, acceleration) - slowing) / square
        return Sight(d / np.sqrt(square), omega, change)


# Controllers.


@dataclass(frozen=True)
class PointingFeedback(Wheels):
    """Feedback of pointing error and angular velocity, without knowledge of how the target moves.

    ``A omega' = A (k^2 theta - 2 k omega)``, critically damped where the target is at rest; behind
    a line of sight that turns at a constant rate it is left by the angle 2 rate / k.

    Attributes:
        gain: k [rad/s].
    """

    gain: Annotated[float, positive, "rad/s"] = 0.5

    def __call__(self, y: npt.ArrayLike, direction: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: states, shape (..., 10).
            direction: of the line of sight, body axes, shape (..., 3).
        """
        off = off_axis(array(direction, "direction", 3))
        wanted = self.gain**2 * off - 2.0 * self.gain * self.satellite.omega_body(y)
        return clip_to_box(-self.satellite.carrier_moments / self.torque * wanted)


@dataclass(frozen=True)
class SightFollower(Wheels):
    """Turns as the line of sight does, and closes the error at a rate that it can brake from.

    The rate of the camera is to be ``w = omega_sight + c theta / |theta|``, with ``c = min(k
    |theta| / 2, sqrt(2 a |theta|))`` and half of the acceleration a that the motors have; the
    motors give ``u = L x omega - A (omega_sight' + 2 k (w - omega))``, where the first term takes
    off what turns the momentum in the carrier. Near the line of sight the error is critically
    damped. Turns about e3 are stopped, or as they are asked for.

    Attributes:
        gain: k [rad/s].
    """

    gain: Annotated[float, positive, "rad/s"] = 0.2

    def __call__(
        self,
        y: npt.ArrayLike,
        direction: npt.ArrayLike,
        rate: npt.ArrayLike,
        acceleration: npt.ArrayLike,
        turn: npt.ArrayLike = 0.0,
    ) -> Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: states, shape (..., 10).
            direction: of the line of sight, body axes, shape (..., 3).
            rate: its angular velocity, body axes, shape (..., 3) [rad/s].
            acceleration: derivative of that in space, body axes, shape (..., 3) [rad/s^2].
            turn: rate at which the satellite is to turn about e3, shape (...) [rad/s].
        """
        sight = Sight.checked(direction, rate, acceleration)
        A, omega = self.satellite.carrier_moments, self.satellite.omega_body(y)
        off, brake = off_axis(sight.direction), 0.5 * self.torque / max(A[0], A[1])
        angle = np.linalg.norm(off, axis=-1, keepdims=True)
        closing = _closing(angle, 0.5 * self.gain, brake)
        wanted = sight.rate + closing / np.maximum(angle, 1e-300) * off
        wanted[..., 2] = array(turn, "turn")
        change = 2.0 * self.gain * (wanted - omega)
        change[..., :2] += sight.acceleration[..., :2]
        gyro = np.cross(self.satellite.L_body(y), omega)
        return clip_to_box((gyro - A * change) / self.torque)


def _closing(angle: Array, gain: float, brake: float) -> Array:
    """Rate at which an angle is to be closed [rad/s], so that it can be braked, shape (...)."""
    return np.asarray(np.minimum(gain * angle, np.sqrt(2.0 * brake * angle)))


_N_ROLLS = 72  # of a circle
_EVERY = 20  # periods between two rolls of a plan
_MOVES = np.arange(-2, 3)  # of the roll between them
_FILLED = 0.95  # of the capacity: above it a wheel counts as too full
_MOVED = 1e-3  # cost of a move, squared, beside a wheel that is too full by its capacity
_TURN = 0.6  # of the fastest turn about e3 that the wheels hold, to come to the roll of the plan
_SLACK, _BRAKE = 0.05, 0.3  # gain of that turn [1/s], and part of the torque that brakes it


class RollPlan(NamedTuple):
    """How a satellite turns about its line of sight.

    Attributes:
        rolls: in each control period, see `Sight.roll`, shape (T, ...) [rad].
        rates: their derivatives, shape (T, ...) [rad/s].
        cost: what the plan costs, shape (...).
    """

    rolls: Array
    rates: Array
    cost: Array


@dataclass(frozen=True)
class LookAhead(Wheels):
    """Follows the line of sight, rolled so that no wheel is too full during the pass ahead.

    Whoever follows the line of sight with the roll alpha, the angle from e1 to its rate w, turns at
    ``omega = (w cos(alpha), w sin(alpha), kappa - alpha')``, with kappa the twist of the line of
    sight. The wheels then hold ``l = L - A omega``, where L is constant in space, so known for the
    whole pass. Dynamic programming over a grid of rolls and times finds the rolls with the least
    sum of

        max(|l_k| / capacity - 0.95, 0) over k, and of 0.001 times the square of the moves,

    and `SightFollower` follows them.

    Source: Bellman & Dreyfus, *Applied Dynamic Programming*, chapter 2.
    """

    def __call__(
        self,
        y: npt.ArrayLike,
        direction: npt.ArrayLike,
        rate: npt.ArrayLike,
        acceleration: npt.ArrayLike,
        roll: npt.ArrayLike,
        rolling: npt.ArrayLike,
    ) -> Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: states, shape (..., 10).
            direction: of the line of sight, body axes, shape (..., 3).
            rate: its angular velocity, body axes, shape (..., 3) [rad/s].
            acceleration: derivative of that in space, body axes, shape (..., 3) [rad/s^2].
            roll: of the plan, shape (...) [rad].
            rolling: its derivative, shape (...) [rad/s].
        """
        sight = Sight.checked(direction, rate, acceleration)
        moment = self.satellite.carrier_moments[2]
        left = np.remainder(sight.roll - array(roll, "roll") + np.pi, 2.0 * np.pi) - np.pi
        closing = _closing(np.abs(left), _SLACK, _BRAKE * self.torque / moment)
        closing = np.copysign(np.minimum(closing, _TURN * self.capacity / moment), left)
        follow = SightFollower(self.satellite, self.torque, self.capacity, self.dt)
        return follow(y, *sight, sight.twist - array(rolling, "rolling") + closing)

    def plan(
        self, path: FlyOver, L: Array, phi: Array, beta: Array, roll: Array, n: int
    ) -> RollPlan:
        """Rolls from now on.

        Args:
            path: of the satellite.
            L: angular momentum in the axes of the pass, shape (N, 3) [N m s].
            phi: angle of the satellite from the middle of the pass, shape (N,) [rad].
            beta: angle of the target from the plane of the orbit, shape (N,) [rad].
            roll: now, shape (N,) [rad].
            n: number of control periods.
        """
        times = self.dt * _EVERY * np.arange(-(-n // _EVERY))[:, None]
        costs = self._costs(path.sight(phi + path.rate * times, beta), L)
        value, policy = np.zeros((_N_ROLLS, len(phi))), []
        for cost in costs[::-1]:
            after = [np.roll(value, -move, axis=0) for move in _MOVES]
            total = cost + np.stack(after)
            policy.append(np.argmin(total, axis=0))
            value = np.min(total, axis=0)
        at = np.rint(roll / (2.0 * np.pi) * _N_ROLLS).astype(np.int64) % _N_ROLLS
        rows, least, moves = np.arange(len(phi)), value[at, np.arange(len(phi))], []
        for choice in policy[::-1]:
            moves.append(_MOVES[choice[at, rows]])
            at = (at + moves[-1]) % _N_ROLLS
        rates = np.repeat(_rate(np.array(moves), self.dt), _EVERY, axis=0)
        rolls = roll + self.dt * (np.cumsum(rates, axis=0) - rates)
        return RollPlan(rolls, rates, least)

    def _costs(self, sight: Sight, L: Array) -> Array:
        """Costs of rolls and moves in the periods of a plan, shape (T, moves, rolls, N)."""
        A, w = self.satellite.carrier_moments, np.linalg.norm(sight.rate, axis=-1)
        ahead = sight.rate / w[..., None]
        side = np.cross(sight.direction, ahead)
        L1, L2, L3 = (np.sum(L * each, axis=-1) for each in (ahead, side, sight.direction))
        alpha = 2.0 * np.pi / _N_ROLLS * np.arange(_N_ROLLS)[:, None]
        c, s = np.cos(alpha), np.sin(alpha)
        l1 = c * (L1 - A[0] * w)[:, None] - s * L2[:, None]
        l2 = s * (L1 - A[1] * w)[:, None] + c * L2[:, None]
        rates = _rate(_MOVES, self.dt)[:, None]
        l3 = (L3 - A[2] * sight.twist)[:, None] + A[2] * rates
        turning = self._excess(l1) + self._excess(l2)
        return np.asarray(
            turning[:, None] + (self._excess(l3) + _MOVED * _MOVES[:, None] ** 2)[:, :, None]
        )

    def _excess(self, momentum: Array) -> Array:
        """By what part of its capacity a wheel is too full."""
        return np.maximum(np.abs(momentum) / self.capacity - _FILLED, 0.0)


def _rate(moves: Integers, dt: float) -> Array:
    """Rates of the roll [rad/s] of moves of a plan."""
    return np.asarray(2.0 * np.pi / _N_ROLLS / (_EVERY * dt) * moves)
