"""Controllers of a rolling ball."""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base import checks
from rigid_envs.base.checks import Array, CheckedFields, Integers, array, positive, require
from rigid_envs.control.linear import Regulator, piecewise_constant
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball.system import RollingBall

# Rolling a ball along a polygon: as it is told, or pushed, from rest to rest along each side.


@dataclass(frozen=True)
class RollPlan:
    """A plan of balls along straight rolls.

    Attributes:
        actions: velocities as parts of the largest, in a disk; zero after a row has arrived, and at
            last for all rows; shape (T, ..., 2).
        length: of the path [m], shape (...).
        steps: number of steps until a row has arrived, shape (...).
    """

    actions: Array
    length: Array
    steps: Integers


def roll_along(rolls: npt.ArrayLike, reach: npt.ArrayLike) -> RollPlan:
    """Roll straight rolls one after the other, each in equal steps, as few as can be.

    A straight roll turns the ball about one axis, so its steps make up the whole exactly: the plan
    leads where the polygon leads.

    Args:
        rolls: displacements of the centre in turn, shape (..., K, 2) [m].
        reach: largest displacement in one step, shape (...) [m].

    Raises:
        ValueError: bad shapes or numbers.
    """
    sides, step = (
        array(rolls, "rolls", 2, entries="X, Y"),
        checks.positive_array(reach, "reach", "m"),
    )
    lengths = np.linalg.norm(sides, axis=-1)
    counts = np.ceil(lengths / step[..., None] - 1e-9).astype(np.int64)
    each = sides / (np.maximum(counts, 1) * step[..., None])[..., None]
    return RollPlan(
        piecewise_constant(each, counts), np.sum(lengths, axis=-1), np.sum(counts, axis=-1)
    )


# Relative poses of a rolling ball, and the pose after straight rolls. Lengths are in radii.

AXES = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 0.0]])
"""Rotation vector of a displacement, or rolling rate of a velocity, both in radii."""


def difference(
    start: npt.ArrayLike, goal: npt.ArrayLike, radius: npt.ArrayLike
) -> tuple[Array, Array]:
    """Relative pose: R_goal = R_turn R_start, p_goal = p_start + radius displacement.

    Args:
        start: states (w, x, y, z, X, Y) of `RollingBall`, shape (..., 6).
        goal: the same, broadcast against start.
        radius: of the balls, shape (...) [m].

    Returns:
        turn, world, shape (..., 4), and displacement of the centre [radii], shape (..., 2).

    Raises:
        ValueError: bad states, or a radius that is not positive.
    """
    size = checks.positive_array(radius, "radius", "m")
    begin, end, size = np.broadcast_arrays(
        RollingBall.checked_state(start), RollingBall.checked_state(goal), size[..., None]
    )
    turn = rotations.multiply(end[..., :4], rotations.conjugate(begin[..., :4]))
    return turn, (end[..., 4:] - begin[..., 4:]) / size[..., :2]


def rolled(rolls: Array) -> tuple[Array, Array]:
    """Turn by straight rolls one after the other, and its derivatives.

    A roll by d turns the ball by the rotation vector d* = (-d_y, d_x, 0). A change of it turns the
    ball by J dd* more, with the left Jacobian J of d*, carried along by the rolls that follow.

    Args:
        rolls: displacements of the centre in turn, shape (..., K, 2) [radii].

    Returns:
        turn, shape (..., 4), and the rotation vectors, world, per change of each roll, shape
        (..., K, 3, 2).
    """
    vectors = rolls @ AXES.T
    turns, jacobians = rotations.exp(vectors), rotations.left_jacobian(vectors) @ AXES
    total, after = turns[..., -1, :], [jacobians[..., -1, :, :]]
    for k in range(rolls.shape[-2] - 2, -1, -1):
        after.append(rotations.matrix_from_quaternion(total) @ jacobians[..., k, :, :])
        total = rotations.multiply(total, turns[..., k, :])
    return total, np.stack(after[::-1], axis=-3)


# Pose tracking of a rolling reference ball: damping control, and preview control.

_TINY = 1e-300  # no division by zero


def pose_error(ball: RollingBall, y: npt.ArrayLike, reference: npt.ArrayLike) -> Array:
    """Pose error of the ball: offset p [radii], rotation vector theta of q q_ref^-1 [rad], world.

    Args:
        ball: either ball.
        y: states of `RollingBall`, shape (..., 6).
        reference: the same.

    Returns:
        (p, theta), shape (..., 5).

    Raises:
        ValueError: bad states.
    """
    turn, offset = difference(reference, y, ball.radius)
    return np.concatenate([offset, rotations.log(turn)], axis=-1)


@dataclass(frozen=True)
class DampedFollower(CheckedFields):
    """Follows by the reference's own velocity and a correction down the slope of the error.

    With p the offset in radii, theta the rotation vector from its attitude to the ball's and w the
    velocity relative to it in radii, ``p' = w`` and ``theta . theta' = theta . (-w_y, w_x, 0)``:
    how the reference turns makes no difference to the angle. So for

        V = (|p|^2 + turn |theta|^2) / 2,   w = -gain s (p_x + turn theta_y, p_y - turn theta_x)

    V' = -|w|^2 / (gain s): the Lyapunov function V does not grow, from any start with an angle
    below pi (where theta jumps). s, at most 1, is the largest for which the whole velocity is
    possible. V tends to 0 where the path bends: straight on, theta_y - p_x, x along the line, would
    stay.

    Attributes:
        ball: both balls.
        rate: largest rolling rate [rad/s].
        gain: of the correction [1/s].
        turn: weight of the attitude against the position.

    Raises:
        ValueError: numbers that are not positive.

    Source: damping control, Jurdjevic & Quinn 1978, doi:10.1016/0022-0396(78)90135-3.
    """

    ball: RollingBall
    rate: Annotated[float, positive, "rad/s"]
    gain: Annotated[float, positive, "1/s"] = 0.6
    turn: Annotated[float, positive, "1"] = 1.2

    def __call__(
        self, y: npt.ArrayLike, reference: npt.ArrayLike, velocity: npt.ArrayLike
    ) -> Array:
        """Velocity of the centre over the largest, in the unit disk.

        Args:
            y: states of `RollingBall`, shape (..., 6).
            reference: those of the ball ahead, shape (..., 6).
            velocity: at which it goes on, shape (..., 2) [m/s].

        Returns:
            Actions, shape (..., 2).

        Raises:
            ValueError: bad states, or a reference faster than the ball can be.
        """
        p_x, p_y, theta_x, theta_y, _ = np.moveaxis(pose_error(self.ball, y, reference), -1, 0)
        slope = np.stack([p_x + self.turn * theta_y, p_y - self.turn * theta_x], axis=-1)
        return _added(self.ball, self.rate, velocity, -self.gain * slope)

    def lyapunov(self, y: npt.ArrayLike, reference: npt.ArrayLike) -> Array:
        """V of the error, shape (...); arguments as above."""
        square = pose_error(self.ball, y, reference) ** 2
        weighed = np.sum(square[..., :2], axis=-1) + self.turn * np.sum(square[..., 2:], axis=-1)
        return np.asarray(0.5 * weighed)


@dataclass(frozen=True)
class FarSightedFollower(CheckedFields):
    """Follows by the linear-quadratic regulator along the known path of the reference.

    The error e = (p, theta) of small size changes in a period dt, in which the reference rolls by
    the rotation vector a and the ball by J w dt more,

        p+ = p + w dt,   theta+ = exp(a) theta + J(a) (-w_y, w_x, 0) dt,

    with J the left Jacobian: only where the reference rolls on, and bends, is every error within
    reach. With e+ = F_k e + G_k w, ``w = -K_k e`` minimises the sum of ``|e|^2 + r |w|^2`` over the
    horizon, r the `input_weight`,

        K_k = (r + G_k' P G_k)^-1 G_k' P F_k,   P_k = 1 + F_k' P (F_k - G_k K_k)

    with P = P_(k+1), and ``e P_k e`` is the cost to go. As in `DampedFollower`, w is cut to
    what is possible. Region, measured: all errors up to 1 radius and 1 rad, behind a reference that
    rolls at half of the largest rate along waves, loops and curls.

    Attributes:
        ball: both balls.
        rate: largest rolling rate [rad/s].
        dt: control period [s].
        input_weight: weight of the correcting velocity, in radii, against the error [s^2].

    Raises:
        ValueError: numbers that are not positive.

    Source: Anderson & Moore, *Optimal Control: Linear Quadratic Methods*, sections 2.4 and 4.1.
    """

    ball: RollingBall
    rate: Annotated[float, positive, "rad/s"]
    dt: Annotated[float, positive, "s"]
    input_weight: Annotated[float, positive, "s^2"] = 0.03

    def __call__(
        self,
        y: npt.ArrayLike,
        reference: npt.ArrayLike,
        velocity: npt.ArrayLike,
        gain: npt.ArrayLike,
    ) -> Array:
        """Velocity of the centre over the largest, in the unit disk.

        Args:
            y: states of `RollingBall`, shape (..., 6).
            reference: those of the ball ahead, shape (..., 6).
            velocity: at which it goes on in this period, shape (..., 2) [m/s].
            gain: K of this period from `regulator`, shape (..., 2, 5).

        Returns:
            Actions, shape (..., 2).

        Raises:
            ValueError: bad states, or a reference faster than the ball can be.
        """
        error = pose_error(self.ball, y, reference)
        correction = -np.einsum("...ij,...j->...i", array(gain, "gain", 2, 5), error)
        return _added(self.ball, self.rate, velocity, correction)

    def regulator(self, velocities: npt.ArrayLike) -> Regulator:
        """Gains K_k and matrices P_k for each period of the path ahead.

        Args:
            velocities: of the reference in the T periods to come, shape (T, ..., 2) [m/s].

        Returns:
            `Regulator` with arrays of shapes (T, ..., 2, 5) and (T, ..., 5, 5).

        Raises:
            ValueError: bad shapes or numbers.
        """
        F, G = self._steps(array(velocities, "velocities", 2, entries="VX, VY"))
        P = np.broadcast_to(np.eye(5), F.shape[1:])
        gains, values = [], []
        for f, g in zip(F[::-1], G[::-1], strict=True):
            back = np.swapaxes(g, -1, -2) @ P
            K = np.linalg.solve(self.input_weight * np.eye(2) + back @ g, back @ f)
            P = np.eye(5) + np.swapaxes(f, -1, -2) @ P @ (f - g @ K)
            P = 0.5 * (P + np.swapaxes(P, -1, -2))
            gains.append(K)
            values.append(P)
        return Regulator(np.stack(gains[::-1]), np.stack(values[::-1]))

    def _steps(self, velocities: Array) -> tuple[Array, Array]:
        """F_k, shape (T, ..., 5, 5), and G_k, shape (T, ..., 5, 2), of each period."""
        turns = self.dt / self.ball.radius * velocities @ AXES.T
        F = np.zeros((*turns.shape[:-1], 5, 5))
        F[..., :2, :2] = np.eye(2)
        F[..., 2:, 2:] = rotations.matrix_from_quaternion(rotations.exp(turns))
        rolled = rotations.left_jacobian(turns) @ AXES
        straight = np.broadcast_to(np.eye(2), (*turns.shape[:-1], 2, 2))
        return F, self.dt * np.concatenate([straight, rolled], axis=-2)


def elastica_headings(
    heading: Array, curvature: Array, force: Array, side: npt.ArrayLike, n: int
) -> Array:
    """Headings of n sides of a polygon along Euler's elastica, each as long as `side`.

    ``heading' = curvature``, ``curvature' = heading x force`` with a constant force: half a change
    of curvature, a turn, and another half; symmetric, so of second order.

    Args:
        heading: unit vector of the first side, shape (..., 2).
        curvature: there, shape (...) [1/m].
        force: shape (..., 2) [1/m^2].
        side: length of each side, shape (...) [m].
        n: number of sides.

    Returns:
        Unit vectors, shape (n, ..., 2).

    Source: Love, *Mathematical Theory of Elasticity*, section 262.
    """
    step, found = np.asarray(side, dtype=np.float64), [heading]
    for _ in range(n - 1):
        h_x, h_y = np.moveaxis(found[-1], -1, 0)
        curvature = curvature + 0.5 * step * (h_x * force[..., 1] - h_y * force[..., 0])
        c, s = np.cos(step * curvature), np.sin(step * curvature)
        h_x, h_y = c * h_x - s * h_y, s * h_x + c * h_y
        curvature = curvature + 0.5 * step * (h_x * force[..., 1] - h_y * force[..., 0])
        found.append(np.stack([h_x, h_y], axis=-1))
    return np.stack(found)


def _added(ball: RollingBall, rate: float, velocity: npt.ArrayLike, correction: Array) -> Array:
    """Action for a velocity [m/s] and as much of a correction [radii/s] as is possible."""
    velocity = array(velocity, "velocity", 2, entries="VX, VY")
    first = velocity / (ball.radius * rate)
    more = correction / rate
    room = 1.0 - np.sum(first**2, axis=-1)
    expected = f"at most radius * rate = {ball.radius * rate:.6g} [m/s]"
    require(room >= -1e-6, velocity, "velocity", expected)
    # the largest s <= 1 with |first + s more| <= 1, written without cancellation
    room = np.maximum(room, 0.0)
    a, b = np.sum(more**2, axis=-1), np.sum(first * more, axis=-1)
    root = np.sqrt(b**2 + a * room)
    inward = (root - b) / np.maximum(a, _TINY)
    s = np.minimum(1.0, np.where(b < 0.0, inward, room / np.maximum(root + b, _TINY)))
    return np.asarray(first + s[..., None] * more)


# Quarter rolls on a grid: a ball's shortest path to any pose on it, by breadth-first search.

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
def attitudes_after() -> Integers:
    """Number among `attitudes` after each of the four moves, shape (24, 4)."""
    after = rotations.multiply(_ROLLS, attitudes()[:, None])
    return np.asarray(np.argmax(np.abs(after @ attitudes().T), axis=-1))


@dataclass(frozen=True)
class QuarterRolls(CheckedFields):
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
    reach: Annotated[int, checks.integer, 0]

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
        after = self._count(cells[..., None, :] + SIDES, attitudes_after()[number])
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
            turned = attitudes_after()[edge[:, 2]].reshape(-1)
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


# Motion planning of a rolling ball by three straight rolls.

_EXACT = 1e-12  # rad; a plan is accepted if it misses the attitude by no more
_N_GUESSES, _N_KEPT, _N_ROUNDS = 40, 5, 20
_ONTO, _ALONG = 20, 40  # iterations onto a plan, and along its family
_BLOCK = 1000  # rows that are planned at a time: some hundred MB


def three_rolls(
    start: npt.ArrayLike, goal: npt.ArrayLike, *, radius: npt.ArrayLike = 1.0, seed: int = 0
) -> Array:
    """Displacements of three straight rolls that lead a ball from one pose to another.

    Kendall's problem, solved by Hammersley: three rolls along straight lines are enough, and two
    are not. In radii, with the rotation vector d* = (-d_y, d_x, 0) of a roll by d,

        d1 + d2 + d3 = displacement   and   exp(d3*) exp(d2*) exp(d1*) = turn.

    With d3 = displacement - d1 - d2 there are three equations for four unknowns, so each plan
    belongs to a family of one parameter. Newton's method, with the smallest of all steps that solve
    the linearised equations, converges from nearly every guess. The best of the plans found are
    then shortened along their families, by steps against the part of the gradient of the length
    that keeps the equations, and the shortest of all is returned. Rows without a plan are tried
    again.

    What is rolled does not depend on how many rows there are. The polygon is a path like any other:
    `roll_along` lays it out in steps, `shortest_path` is never longer.

    Args:
        start: states (w, x, y, z, X, Y) of `RollingBall`, shape (..., 6).
        goal: as `start`, broadcast against it.
        radius: of the balls, shape (...) [m].
        seed: of the first guesses.

    Returns:
        Displacements of the centre, in the order in which they are rolled, shape (..., 3, 2) [m].
        They lead to the goal within 1e-12 rad, and in place within rounding.

    Raises:
        ValueError: bad states, or a radius that is not positive.
        ArithmeticError: no plan was found from any guess.

    Source: Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79.
    """
    turn, displacement = difference(start, goal, radius)
    turns, displacements = turn.reshape(-1, 4), displacement.reshape(-1, 2)
    rolls = np.empty((len(turns), 3, 2))
    for first in range(0, len(turns), _BLOCK):
        rows = slice(first, first + _BLOCK)
        rolls[rows] = _shortest(turns[rows], displacements[rows], np.random.default_rng(seed))
    scale = np.asarray(radius, dtype=np.float64)[..., None, None]
    return np.asarray(scale * rolls.reshape(*displacement.shape[:-1], 3, 2))


def _shortest(turn: Array, displacement: Array, rng: np.random.Generator) -> Array:
    """The shortest plans found for turns, shape (N, 4), and displacements, (N, 2) [radii]."""
    rolls, length = np.zeros((len(turn), 3, 2)), np.full(len(turn), np.inf)
    for _ in range(_N_ROUNDS):
        rows = np.flatnonzero(np.isinf(length))
        if len(rows) == 0:
            return rolls
        rolls[rows], length[rows] = _best_of(
            _guesses(rng), turn[rows, None], displacement[rows, None]
        )
    raise ArithmeticError(
        f"no three rolls turn a ball by {turn[rows[0]]} over {displacement[rows[0]]}"
    )


def _guesses(rng: np.random.Generator) -> Array:
    """First two displacements: none, and of all sizes from a tenth of a radius on, shape (n, 4)."""
    size = np.concatenate([[0.0], np.geomspace(0.1, 5.0, _N_GUESSES - 1)])
    return size[:, None] * rng.uniform(-1.0, 1.0, (_N_GUESSES, 4))


def _best_of(guesses: Array, turn: Array, displacement: Array) -> tuple[Array, Array]:
    """The shortest plan of each row, and its length; infinite if none converged."""
    found = _solve(np.broadcast_to(guesses, (len(turn), *guesses.shape)), turn, displacement, _ONTO)
    best = np.argsort(_length(found, turn, displacement), axis=1)[:, :_N_KEPT, None]
    kept = np.take_along_axis(found, best, axis=1)
    short = _solve(_solve(kept, turn, displacement, _ALONG, shorten=1.0), turn, displacement, _ONTO)
    # a family may lead to where the equations are singular: the plans before count as well
    ends = np.concatenate([short, kept], axis=1)
    length = _length(ends, turn, displacement)
    row, first = np.arange(len(turn)), np.argmin(length, axis=1)
    return _rolls(ends, displacement)[row, first], length[row, first]


def _solve(free: Array, turn: Array, displacement: Array, n: int, shorten: float = 0.0) -> Array:
    """Newton steps on the first two displacements, and steps that shorten the plan besides."""
    for _ in range(n):
        rolls = _rolls(free, displacement)
        missing, jacobian = _linearise(rolls, turn)
        transposed = np.swapaxes(jacobian, -1, -2)
        inverse = transposed @ np.linalg.inv(jacobian @ transposed + 1e-12 * np.eye(3))
        ahead = rolls / np.maximum(np.linalg.norm(rolls, axis=-1, keepdims=True), 1e-12)
        downhill = shorten * (ahead[..., 2:, :] - ahead[..., :2, :]).reshape(free.shape)
        residual = missing - (jacobian @ downhill[..., None])[..., 0]
        move = downhill + (inverse @ residual[..., None])[..., 0]
        size = np.linalg.norm(move, axis=-1, keepdims=True)
        free = free + move / np.maximum(1.0, size / (0.5 if shorten else 1.5))
    return free


def _linearise(rolls: Array, turn: Array) -> tuple[Array, Array]:
    """Error of the turn, a rotation vector, and its Jacobian, shape (..., 3, 4)."""
    total, change = rolled(rolls)
    missing = rotations.log(rotations.multiply(turn, rotations.conjugate(total)))
    first, second, third = np.moveaxis(change, -3, 0)
    return missing, np.concatenate([first - third, second - third], axis=-1)


def _rolls(free: Array, displacement: Array) -> Array:
    """All three displacements of the first two, shape (..., 3, 2)."""
    two = free.reshape(*free.shape[:-1], 2, 2)
    last = displacement - np.sum(two, axis=-2)
    return np.concatenate([two, last[..., None, :]], axis=-2)


def _length(free: Array, turn: Array, displacement: Array) -> Array:
    """Length of the plans [radii]; infinite where a plan misses the turn."""
    rolls = _rolls(free, displacement)
    missing, _ = _linearise(rolls, turn)
    length = np.sum(np.linalg.norm(rolls, axis=-1), axis=-1)
    return np.where(np.linalg.norm(missing, axis=-1) <= _EXACT, length, np.inf)
