"""Parking an upright coin by two straight rolls, with turns before, between and after them."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, Integers, integer, positive
from rigid_envs.control.linear import piecewise_constant
from rigid_envs.systems.upright_coin.system import UprightCoin

_WHOLE = 2.0 * np.pi
_EXACT = 1e-9  # radii; plans that miss the place by more, as very long rolls do, are dropped
_ROLL_OR_STEER = np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 1.0]])  # by leg


@dataclass(frozen=True)
class CoinPlan:
    """A plan of coins to their goals.

    Attributes:
        actions: (roll, steer) as parts of the largest in a step, never both; zero after a row has
            arrived, and at last for all rows; shape (T, ..., 2).
        legs: turn, roll, turn, roll, turn [rad], shape (..., 5).
        length: of the path of the contact [m], shape (...).
        steps: number of steps until a row has arrived, shape (...).
    """

    actions: Array
    legs: Array
    length: Array
    steps: Integers


@dataclass(frozen=True)
class TwoRolls(CheckedFields):
    """Plans that park a coin: turn, roll straight, turn, roll straight, turn.

    Rolls by the angles a and b with headings phi_1 and phi_2 lead from the offset D (in radii, in
    the frame of the goal) and the phase psi to the goal if

        a u_1 + b u_2 = D   and   a + b = S,   u = (cos phi, sin phi),   S = -psi + 2 pi k,

    because the coin travels along -u. This is solved by construction: for every u_1 but those with
    D . u_1 = S,

        a = (S^2 - D^2) / (2 (S - D . u_1)),   b = S - a,   u_2 = (D - a u_1) / b,

    for then |D - a u_1| = |b|. So each pose can be reached from each other, to rounding, in the
    four dimensions that two controls have. What changes the phase at a given place is the
    commutator of rolling with the commutator of steering and rolling, the third order of the growth
    vector (2, 3, 4); the turn between the rolls makes room for it.

    Among `directions` headings phi_1, that at the start, those along D and the k for which S is
    nearest to the distance and to 0, the plan of fewest steps is taken, and of those the shortest.

    Attributes:
        coin: upright coin to park.
        roll_per_step: largest roll in one step [rad].
        steer_per_step: largest turn of the heading in one step [rad].
        directions: number of headings that are tried.

    Raises:
        ValueError: numbers that are not positive.

    Source: as Hammersley 1983 rolls a ball, "Oxford commemoration ball", LMS Lecture Notes 79;
    Murray & Sastry 1993, doi:10.1109/9.277235.
    """

    coin: UprightCoin
    roll_per_step: Annotated[float, positive, "rad"]
    steer_per_step: Annotated[float, positive, "rad"]
    directions: Annotated[int, integer, 1] = 180

    def __call__(self, y: npt.ArrayLike, goal: npt.ArrayLike | None = None) -> CoinPlan:
        """The plan that leads from y to the goal.

        Args:
            y: states of `UprightCoin`, shape (..., 8); the rates do not count.
            goal: the same, broadcast against y; the origin, heading and phase 0, if left out.

        Raises:
            ValueError: bad states.
        """
        end = self.coin.state(q=self.coin.attitude(0.0, 0.0)) if goal is None else goal
        poses = self._pose(self.coin.checked_state(y), self.coin.checked_state(end))
        lead = poses.shape[:-1]
        rows = poses.reshape(-1, 4)
        legs = np.array([self._best(_legs(row, self.directions)) for row in rows])
        legs = legs.reshape(*lead, 5)
        counts = self._counts(legs)
        each = legs / (np.maximum(counts, 1) * self._sizes)
        return CoinPlan(
            piecewise_constant(each[..., None] * _ROLL_OR_STEER, counts),
            legs,
            self.coin.radius * np.sum(np.abs(legs[..., 1::2]), axis=-1),
            np.sum(counts, axis=-1),
        )

    @property
    def _sizes(self) -> Array:
        """Largest change of the angle of each leg in one step [rad]."""
        steer, roll = self.steer_per_step, self.roll_per_step
        return np.array([steer, roll, steer, roll, steer])

    def _pose(self, y: Array, end: Array) -> Array:
        """Offset [radii], heading and phase [rad] as seen from the goal, shape (..., 4)."""
        away = (y[..., 4:6] - end[..., 4:6]) / self.coin.radius
        phi = self.coin.heading(end)
        along = away[..., 0] * np.cos(phi) + away[..., 1] * np.sin(phi)
        aside = away[..., 1] * np.cos(phi) - away[..., 0] * np.sin(phi)
        heading, phase = self.coin.heading(y) - phi, self.coin.phase(y) - self.coin.phase(end)
        return np.stack([along, aside, heading, _short(phase)], axis=-1)

    def _best(self, legs: Array) -> Array:
        """The plan of fewest steps, shape (5,); among those, of the shortest path."""
        steps = np.sum(self._counts(legs), axis=-1)
        length = np.sum(np.abs(legs[:, 1::2]), axis=-1)
        return np.asarray(legs[np.lexsort((length, steps))[0]])

    def _counts(self, legs: Array) -> Integers:
        """Steps that each leg takes, shape (..., 5)."""
        return np.ceil(np.abs(legs) / self._sizes - 1e-9).astype(np.int64)


def _legs(pose: Array, directions: int) -> Array:
    """Turns and rolls (turn, a, turn, b, turn) [rad] that lead home, shape (n, 5)."""
    D, heading, phase = pose[:2], pose[2], pose[3]
    distance, along = np.hypot(*D), np.arctan2(D[1], D[0])
    even = np.linspace(0.0, _WHOLE, directions, endpoint=False)
    first = np.append(even, [heading, heading + np.pi, along])
    beyond = np.ceil((distance + phase) / _WHOLE), -np.ceil((distance - phase) / _WHOLE)
    k = np.unique([0.0, beyond[0] - 1.0, beyond[0], beyond[1], beyond[1] + 1.0])
    S = (_WHOLE * k - phase)[:, None]
    u = np.stack([np.cos(first), np.sin(first)], axis=-1)
    room = S - u @ D
    none = np.abs(room) < _EXACT  # then S^2 = D^2 where there is a plan, of a single roll
    a = np.where(none, S, (S**2 - distance**2) / (2.0 * np.where(none, 1.0, room)))
    b = S - a
    rest = D - a[..., None] * u
    second = np.arctan2(np.sign(b) * rest[..., 1], np.sign(b) * rest[..., 0])
    second = np.where(np.abs(b) < _EXACT, 0.0, second)
    first = np.broadcast_to(first, a.shape)
    legs = [_short(first - heading), a, _short(second - first), b, _short(-second)]
    missed = np.abs(np.hypot(rest[..., 0], rest[..., 1]) - np.abs(b))
    return np.asarray(np.stack(legs, axis=-1)[missed < _EXACT])


def _short(angle: Array) -> Array:
    """The same turn, by half a turn at most."""
    return np.asarray((angle + np.pi) % _WHOLE - np.pi)
