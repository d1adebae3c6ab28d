"""Controllers of a satellite that is turned by wheels."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, positive
from rigid_envs.control.linear import clip_to_box
from rigid_envs.mechanics import rotations
from rigid_envs.systems.gyrostat.system import Gyrostat

_SMALL = 1e-3  # rad: turns that are not worth a turn


@dataclass(frozen=True)
class Wheels(CheckedFields):
    """A satellite, and the limits of the motors of its wheels.

    Attributes:
        satellite: to control.
        torque: largest torque of each motor [N m].
        capacity: largest spin momentum of each wheel [N m s].
        dt: control period [s].

    Raises:
        ValueError: numbers that are not positive.
    """

    satellite: Gyrostat
    torque: Annotated[float, positive, "N m"]
    capacity: Annotated[float, positive, "N m s"]
    dt: Annotated[float, positive, "s"]

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `Gyrostat` [N m], shape (..., 6), of actions."""
        u = np.asarray(action, dtype=np.float64)
        return np.concatenate(
            [self.torque * u, np.zeros((*u.shape[:-1], 6 - u.shape[-1]))], axis=-1
        )

    def _next_rate(self, left: Array, rate: Array, acceleration: Array, most: Array) -> Array:
        """Rate after a period [rad/s] from which it can just brake to rest at the goal.

        The largest w up to `most` with ``w^2 / (2 a) + w dt / 2 <= left - dt (rate + w) / 2``:
        braking from w takes the angle on the left at most, in whole periods.
        """
        a, dt = acceleration, self.dt
        room = np.maximum(left - 0.5 * dt * rate, 0.0)
        return np.minimum(a * (np.sqrt(dt**2 + 2.0 / a * room) - dt), most)


@dataclass(frozen=True)
class EigenaxisSlew(Wheels):
    """Turns a satellite to rest at an attitude about the axis of the rotation that leads there.

    The rate along the axis e grows by what the weakest wheel allows, and falls so that it can just
    stop by `braking` of that. It stays below the rate at which a wheel would be full, and that at
    which it takes the share `turning` of a motor to turn the momentum in the carrier. What the
    carrier turns at across e is stopped. The motors give ``u = L x omega - A omega'``. Where a
    motor or a wheel is at its limit, omega' is made smaller, and keeps its direction.

    Attributes:
        braking: share of the largest acceleration that is counted on.
        turning: share of the torque, at most.

    Source: Wie, Weiss & Arapostathis 1989, doi:10.2514/3.20418.
    """

    braking: Annotated[float, positive, "1"] = 0.85
    turning: Annotated[float, positive, "1"] = 0.8

    def __call__(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: states, shape (..., 10).
            goal: attitudes to reach (w, x, y, z), body to world, shape (..., 4).
        """
        states, A = np.asarray(y, dtype=np.float64), self.satellite.carrier_moments
        omega, L = self.satellite.omega_body(states), self.satellite.L_body(states)
        theta = rotations.log(rotations.multiply(rotations.conjugate(states[..., :4]), goal))
        left = np.linalg.norm(theta, axis=-1, keepdims=True)
        e = theta / np.maximum(left, 1e-300)
        share = np.maximum(A * np.abs(e), 1e-300)
        fastest = np.min((self.capacity - np.abs(L)) / share, axis=-1, keepdims=True)
        largest = np.min(self.braking * self.torque / share, axis=-1, keepdims=True)
        rate = np.sum(omega * e, axis=-1, keepdims=True)
        across = np.linalg.norm(np.cross(L, e), axis=-1, keepdims=True)
        fastest = np.minimum(fastest, self.turning * self.torque / np.maximum(across, 1e-300))
        wanted = e * self._next_rate(left, rate, largest, np.maximum(fastest, 0.0))
        return self._limited(np.cross(L, omega), A * (omega - wanted) / self.dt, L - A * omega)

    def _limited(self, kept: Array, change: Array, stored: Array) -> Array:
        """Actions of the torque `kept` and as much of `change` as motors and wheels allow."""
        high = np.minimum(self.torque, (self.capacity - stored) / self.dt)
        low = np.maximum(-self.torque, (-self.capacity - stored) / self.dt)
        room = np.where(change > 0.0, high - kept, kept - low)
        ratios = np.maximum(room, 0.0) / np.maximum(np.abs(change), 1e-300)
        share = np.minimum(np.min(ratios, axis=-1, keepdims=True), 1.0)
        return clip_to_box((kept + share * change) / self.torque)


@dataclass(frozen=True)
class ThreeTurns(Wheels):
    """Turns a satellite without angular momentum by two wheels: about e1, e2 and e1 again.

    Or about e2, e1 and e2. Each of the two orders has two solutions for the angles. Of the four
    the one that takes the least time is taken; its first turn is made as fast as motor and wheel
    allow. As time goes on the first angle falls to 0, and the next turn is the first.
    """

    def __call__(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 2).

        Args:
            y: states, shape (..., 10).
            goal: attitudes to reach (w, x, y, z), body to world, shape (..., 4).
        """
        states, A = np.asarray(y, dtype=np.float64), self.satellite.carrier_moments[:2]
        rates = self.satellite.omega_body(states)[..., :2]
        off = rotations.multiply(rotations.conjugate(states[..., :4]), goal)
        plans = np.concatenate([_turns(off, 0), _turns(off, 1)], axis=-2)  # (..., 4, 3)
        time = np.stack([self._time(plans[..., k, :], rates, k // 2) for k in range(4)], axis=-1)
        best = np.argmin(time, axis=-1)
        angles = np.take_along_axis(plans, best[..., None, None], axis=-2)[..., 0, :]
        axis = np.where(best < 2, 0, 1)
        turning = np.take_along_axis(rates, axis[..., None], axis=-1)[..., 0]
        done = (np.abs(angles[..., 0]) < _SMALL) & (np.abs(turning) < _SMALL)
        axis, angle = np.where(done, 1 - axis, axis), np.where(done, angles[..., 1], angles[..., 0])
        left = np.where(np.arange(2) == axis[..., None], angle[..., None], 0.0)
        sense = np.where(left < 0.0, -1.0, 1.0)
        wanted = sense * self._next_rate(
            np.abs(left), sense * rates, self.torque / A, self.capacity / A
        )
        wanted = np.where(left == 0.0, 0.0, wanted)
        return clip_to_box(A * (rates - wanted) / (self.dt * self.torque))

    def _time(self, angles: Array, rates: Array, first: int) -> Array:
        """Least time of three turns [s], shape (...), the first at its rate; others are stopped."""
        at = rates[..., first]
        stop = np.abs(rates[..., 1 - first]) * self.satellite.carrier_moments[1 - first]
        turns = (
            self._turn_time(angles[..., 0], at, first),
            self._turn_time(angles[..., 1], 0.0 * at, 1 - first),
            self._turn_time(angles[..., 2], 0.0 * at, first),
        )
        return np.asarray(sum(turns) + stop / self.torque)

    def _turn_time(self, angle: Array, rate: Array, axis: int) -> Array:
        """Least time [s] to rest after a turn by an angle, from a rate."""
        A = self.satellite.carrier_moments[axis]
        a, most = self.torque / A, self.capacity / A
        sense = np.where(angle < 0.5 * rate * np.abs(rate) / a, -1.0, 1.0)
        angle, rate = sense * angle, sense * rate
        peak = np.sqrt(np.maximum(a * angle + 0.5 * rate**2, 0.0))
        coast = np.maximum(angle - (most**2 - 0.5 * rate**2) / a, 0.0) / most
        return np.asarray((2.0 * np.minimum(peak, most) - rate) / a + coast)


def _turns(q: Array, axis: int) -> Array:
    """Both triples of angles of turns about e1, e2, e1 (axis 0) or e2, e1, e2, shape (..., 2, 3).

    Where the second turn is none, or half a turn, the third is left out.
    """
    R, i, j = rotations.matrix_from_quaternion(q), axis, 1 - axis
    sign = 1.0 - 2.0 * axis
    middle = np.arccos(np.clip(R[..., i, i], -1.0, 1.0))
    one = np.arctan2(R[..., j, i], -sign * R[..., 2, i])
    two = np.arctan2(R[..., i, j], sign * R[..., i, 2])
    none, half = middle < _SMALL, middle > np.pi - _SMALL
    # there the sum or the difference alone is known: of e1 before and after none, or half a turn
    along = rotations.log(rotations.multiply(q, _about(1 - axis, -middle)))[..., i]
    one, two = np.where(none | half, along, one), np.where(none | half, 0.0, two)
    triples = (one, middle, two), (one + np.pi, -middle, two + np.pi)
    both = np.stack([np.stack(each, axis=-1) for each in triples], axis=-2)
    return np.asarray(np.remainder(both + np.pi, 2.0 * np.pi) - np.pi)


def _about(axis: int, angle: Array) -> Array:
    """Quaternions of turns about e1 (axis 0) or e2, shape (..., 4)."""
    q = np.zeros((*angle.shape, 4))
    q[..., 0], q[..., 1 + axis] = np.cos(0.5 * angle), np.sin(0.5 * angle)
    return q
