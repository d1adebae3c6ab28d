"""Controllers of a satellite that is turned by wheels."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, Integers, integer, positive, require
from rigid_envs.control.linear import clip_to_box
from rigid_envs.mechanics import rotations
from rigid_envs.systems.gyrostat.system import Gyrostat

# Turns from rest to rest, by three wheels and by two.

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


# The dual-spin turn, out of flat spin by a rotor.

_HELD = 10.0  # weight of the spin momentum in the choice of the end
_ACROSS = 1e-9  # of |L|: the least distance from e1 that is counted
_NEVER = np.iinfo(np.int64).max // 2


@dataclass(frozen=True)
class DualSpinTurn(CheckedFields):
    """Leads a satellite from a spin about any axis to rest, all its momentum in a rotor along e1.

    With ``L = |L| (tanh(s), cos(phi) / cosh(s), sin(phi) / cosh(s))`` in body axes

        s' = -(|L| / 2) (1 / A2 - 1 / A3) sin(2 phi),
        phi' = L1 (cos(phi)^2 / A2 + sin(phi)^2 / A3) - omega1,   A1 omega1 = L1 - l,

    and rest is at infinite s. The latitude s grows fastest at sin(2 phi) = -1. Half the way of the
    rotor is to where phi stays there: with l between ``|L| (1 - A1 / A2)`` and ``|L| (1 - A1 /
    A3)`` it rides on the stable manifold of the saddle that e1 along L is then. Longitude and its
    rate are led there, and held, by

        phi' = -gain e, at most sqrt(2 torque abs(e) / A1),

    with the angle e from there. From this ride on the rotor is spun up at full torque, as soon as
    that leads to rest within the tolerance, by steps of the integrator; meanwhile phi turns faster
    and faster, and s changes little. A run-up, some periods of torque the other way before,
    lets phi pass the best angle twice, and s gains a little more. Of the ends e1 and -e1 along L it
    takes the one with the sign of ``10 l / |L| + s - sin(2 phi)``. Region: any spin, with A1 < A2 <
    A3, from rest of L on -e1 or e1 apart.

    Attributes:
        satellite: with a rotor along e1.
        torque: largest torque of its motor [N m].
        dt: control period [s].
        tolerance: largest rate at rest [rad/s].
        n_substeps: steps of the integrator in a period.
        gain: of the longitude [1/s].
        run_up: number of periods that the longest run-up has.

    Raises:
        ValueError: numbers that are not positive, moments in another order, no rotor.

    Source: the saddle and the separatrices of gyrostats: Hughes, *Spacecraft Attitude Dynamics*,
    chapter 6.
    """

    satellite: Gyrostat
    torque: Annotated[float, positive, "N m"]
    dt: Annotated[float, positive, "s"]
    tolerance: Annotated[float, positive, "rad/s"]
    n_substeps: Annotated[int, integer, 1] = 8
    gain: Annotated[float, positive, "1/s"] = 0.4
    run_up: Annotated[int, integer, 0] = 3

    def __post_init__(self) -> None:
        """Check numbers and satellite."""
        super().__post_init__()
        A = self.satellite.carrier_moments
        require(bool(A[0] < A[1] < A[2]), A, "satellite.carrier_moments", "A1 < A2 < A3")
        positive(self.satellite.J1, "satellite.J1", "kg m^2")

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 1).

        Args:
            y: states, shape (..., 10).
        """
        states = np.asarray(y, dtype=np.float64)
        rows = states.reshape(-1, states.shape[-1])
        sense = self.side(rows)
        action = self._ride(rows, sense)
        near = np.flatnonzero(self._within_reach(rows, sense))
        wait = self._wait(rows[near], sense[near])
        action[near] = np.select([wait == 0, wait > 0], [sense[near], -sense[near]], action[near])
        return action.reshape(*states.shape[:-1], 1)

    def latitude(self, y: Array) -> Array:
        """Isometric latitude s of L about e1, shape (...)."""
        L = self.satellite.L_body(y)
        size = np.maximum(np.linalg.norm(L, axis=-1), 1e-300)
        across = np.maximum(np.hypot(L[..., 1], L[..., 2]), _ACROSS * size)
        return np.asarray(np.copysign(np.log((size + np.abs(L[..., 0])) / across), L[..., 0]))

    def side(self, y: Array) -> Array:
        """1 where L is to be led to e1, -1 where it is to -e1, shape (...)."""
        L = self.satellite.L_body(y)
        size = np.maximum(np.linalg.norm(L, axis=-1), 1e-300)
        stored = self.satellite.spin_momenta(y)[..., 0] / size
        lean = _HELD * stored + self.latitude(y) - np.sin(_twice_longitude(L))
        return np.where(lean < 0.0, -1.0, 1.0)

    def _ride(self, y: Array, sense: Array) -> Array:
        """Actions that lead phi to the angle at which s changes fastest, and hold it there."""
        A1, A2, A3 = self.satellite.carrier_moments
        L, omega1 = self.satellite.L_body(y), self.satellite.omega_body(y)[..., 0]
        twice = _twice_longitude(L)
        off = 0.5 * (np.remainder(twice + (0.5 * sense + 1.0) * np.pi, 2.0 * np.pi) - np.pi)
        fastest = np.sqrt(2.0 * self.torque / A1 * np.abs(off))
        wanted = -np.sign(off) * np.minimum(self.gain * np.abs(off), fastest)
        cosine = np.cos(twice)
        drift = 0.5 * L[..., 0] * ((1.0 + cosine) / A2 + (1.0 - cosine) / A3)
        return clip_to_box(A1 * (omega1 + wanted - drift) / (self.dt * self.torque))

    def _within_reach(self, y: Array, sense: Array) -> npt.NDArray[np.bool_]:
        """Where s may still grow to that of rest, ``cosh(s) = |L| / (A3 tolerance)``.

        At full torque it grows for ``sqrt(pi A1 / torque)`` or so, the largest size of an integral
        of ``exp(2 i phi)`` with phi'' = torque / A1.
        """
        A1, A2, A3 = self.satellite.carrier_moments
        size = np.linalg.norm(self.satellite.L_body(y), axis=-1)
        omega1 = sense * self.satellite.omega_body(y)[..., 0]
        goal = np.arccosh(np.maximum(size / (A3 * self.tolerance), 1.0))
        time = np.sqrt(np.pi * A1 / self.torque) + self.run_up * self.dt
        fastest = 0.5 * size * (1.0 / A2 - 1.0 / A3)
        ahead = omega1 > -self.tolerance
        return np.asarray(ahead & (goal - sense * self.latitude(y) <= fastest * time))

    def _wait(self, y: Array, sense: Array) -> Integers:
        """Periods of run-up before full torque that lead to rest first; -1 where none does."""
        if not len(y):
            return np.zeros(0, dtype=np.int64)
        starts, waits = [y], np.arange(self.run_up + 1)
        for _ in range(self.run_up):
            starts.append(self._turned(starts[-1], -sense))
        times = self._time_to_rest(np.concatenate(starts), np.tile(sense, len(starts)))
        times = times.reshape(len(starts), -1) + waits[:, None]
        return np.where(times.min(axis=0) < _NEVER, times.argmin(axis=0), -1)

    def _turned(self, y: Array, action: Array) -> Array:
        """States after a period of full torque, of the sign of the action."""
        u = np.zeros((len(y), 6))
        u[:, 0] = self.torque * action
        return self.satellite.advance(y, u, self.dt, self.n_substeps)

    def _time_to_rest(self, y: Array, sense: Array) -> Integers:
        """Periods of full torque until rest, shape (N,); as good as infinite where it is missed."""
        periods, going = np.full(len(y), _NEVER), np.arange(len(y))
        k = 0
        while len(going):
            y, k = self._turned(y, sense), k + 1
            omega = self.satellite.omega_body(y)
            rest = np.linalg.norm(omega, axis=-1) <= self.tolerance
            periods[going[rest]] = k
            left = ~rest & (sense * omega[..., 0] > -self.tolerance)
            y, sense, going = y[left], sense[left], going[left]
        return periods


def _twice_longitude(L: Array) -> Array:
    """2 phi of L about e1 [rad], shape (...)."""
    return 2.0 * np.arctan2(L[..., 2], L[..., 1])
