"""Quarter rolls on a grid: a ball's shortest path to any pose on it, by breadth-first search."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.checks import integer, require
from rigid_envs.control.rolling import difference
from rigid_envs.systems import RollingBall

__all__ = ["SIDES", "QuarterRolls", "attitudes", "rolled"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

SIDES: Integers = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
"""Cells (i, j) that each of the four moves goes on: to +x, +y, -x and -y."""

_HALF = 0.5**0.5
_ROLLS = _HALF * np.array([[1, 0, 1, 0], [1, -1, 0, 0], [1, 0, -1, 0], [1, 1, 0, 0]])
_BEYOND = 3
"""Cells that are searched beyond the reach. From k = |i| + |j| cells away, no more than one beyond
the reach, a path that leaves this square takes k + 6 moves or more, and a shortest one no more."""
_OFF = 1e-6  # radii and rad; a ball that is further off the grid is refused


@cache
def attitudes() -> Array:
    """The 24 attitudes of a cube on its faces, upright first, shape (24, 4): products of rolls."""
    found = [rotations.identity()]
    for q in found:  # grows while it is walked through
        for roll in _ROLLS:
            new = rotations.normalize(rotations.multiply(roll, q))
            if np.all(rotations.distance(np.array(found), new) > 0.1):
                found.append(new)
    return np.array(found)


@cache
def rolled() -> Integers:
    """Number among `attitudes` after each of the four moves, shape (24, 4)."""
    after = rotations.multiply(_ROLLS, attitudes()[:, None])
    return np.asarray(np.argmax(np.abs(after @ attitudes().T), axis=-1))


@dataclass(frozen=True)
class QuarterRolls:
    """Rolls a ball by quarter turns to a goal on a shortest path.

    A move turns the attitude q to r q, r the quarter turn about a side, and goes on to the next of
    the square cells of side pi radius / 2. How the ball is marked makes no difference to it, so the
    path to a goal with cell c* and attitude q* is that from (c - c*, q q*^-1) to the cell 0,
    upright: home. A move is undone by the opposite one, so the paths home are those from home
    backwards, and one breadth-first search from there finds the fewest moves n of all poses. They
    solve Bellman's equation, which is the certificate,

        n(home) = 0,   n(c, q) = 1 + min of n over the poses after the four moves,

    and the move after which n is least is optimal. A ball that is home already moves: out, and back
    in the next step.

    Region: wherever there is a path at all. A quarter turn is an odd permutation of the four
    diagonals of a cube, so there is none from 12 of the 24 attitudes of each cell: the odd ones
    where i + j is even, the even ones where it is odd.

    Attributes:
        ball: kinematic rolling ball.
        reach: largest distance from the goal along each axis [cells].

    Raises:
        ValueError: a negative reach.

    Source: Cormen, Leiserson, Rivest & Stein, *Introduction to Algorithms*, section 20.2;
    Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79.
    """

    ball: RollingBall
    reach: int

    def __post_init__(self) -> None:
        """Check the reach."""
        integer(self.reach, "reach", 0)

    def __call__(self, y: npt.ArrayLike, goal: npt.ArrayLike | None = None) -> Integers:
        """The side to roll to: 0 for +x, 1 for +y, 2 for -x, 3 for -y.

        Args:
            y: states (w, x, y, z, X, Y) of `RollingBall`, shape (..., 6), on the grid.
            goal: the same, broadcast against y; the state at rest, home, if left out.

        Returns:
            Moves, integers of shape (...).

        Raises:
            ValueError: off the grid, beyond the reach, or without a path to the goal.
        """
        cells, number = self._pose(y, goal)
        expected = (
            "a pose from which quarter rolls lead to the goal: q q*^-1 is an even permutation of "
            "a cube's diagonals where the cells to go are even in number, else an odd one"
        )
        require(self._count(cells, number) >= 0, np.asarray(y), "y", expected)
        after = self._count(cells[..., None, :] + SIDES, rolled()[number])
        return np.asarray(np.argmin(after, axis=-1))

    def moves(self, y: npt.ArrayLike, goal: npt.ArrayLike | None = None) -> Integers:
        """Fewest moves to the goal, shape (...); -1 where there is no path.

        Args:
            y: states, shape (..., 6), on the grid.
            goal: the same, broadcast against y; home if left out.

        Raises:
            ValueError: off the grid, or beyond the reach.
        """
        return self._count(*self._pose(y, goal))

    def state(self, cells: npt.ArrayLike, number: npt.ArrayLike) -> Array:
        """States (..., 6) from cells (i, j), shape (..., 2), and numbers of attitudes (...)."""
        place = self._side * np.asarray(cells, dtype=np.float64)
        return self.ball.state(q=attitudes()[np.asarray(number)], position=place)

    @cached_property
    def table(self) -> Integers:
        """Fewest moves home by cell and attitude, -1 where there is no path, shape (n, n, 24).

        Home is in the middle. The search goes further than the reach: within it every number is
        that of the unbounded grid.
        """
        middle = self._middle
        found = np.full((2 * middle + 1, 2 * middle + 1, 24), -1)
        edge, n = np.array([[middle, middle, 0]]), 0
        while len(edge):
            found[tuple(edge.T)] = n
            n += 1
            cells = (edge[:, None, :2] + SIDES).reshape(-1, 2)
            inside = np.all((cells >= 0) & (cells <= 2 * middle), axis=1)
            turned = rolled()[edge[:, 2]].reshape(-1)
            ahead = np.unique(np.column_stack([cells, turned])[inside], axis=0)
            edge = ahead[found[tuple(ahead.T)] < 0]
        return found

    @property
    def _side(self) -> float:
        return 0.5 * np.pi * self.ball.radius

    @property
    def _middle(self) -> int:
        return self.reach + _BEYOND

    def _count(self, cells: Integers, number: Integers) -> Integers:
        i, j = np.moveaxis(cells + self._middle, -1, 0)
        return np.asarray(self.table[i, j, number])

    def _pose(self, y: npt.ArrayLike, goal: npt.ArrayLike | None) -> tuple[Integers, Integers]:
        """Cells to the goal, shape (..., 2), and the number of the attitude relative to it."""
        end = self.ball.state() if goal is None else goal
        turn, displacement = difference(end, y, self.ball.radius)
        number = np.argmax(np.abs(turn @ attitudes().T), axis=-1)
        place = displacement * (self.ball.radius / self._side)
        cells = np.rint(place).astype(np.int64)
        away = rotations.distance(attitudes()[number], turn)
        off = np.maximum(np.max(np.abs(place - cells), axis=-1), away)
        require(off <= _OFF, off, "offset_from_grid", f"at most {_OFF:g} [radii, rad]")
        far = np.max(np.abs(cells), axis=-1)
        expected = f"at most {self.reach} cells: take a larger reach"
        require(far <= self.reach, far, "cells_to_goal", expected)
        return cells, number
