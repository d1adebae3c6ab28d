"""Motion planning of a rolling ball by three straight rolls."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.control.rolling import difference, rolled

__all__ = ["three_rolls"]

Array = npt.NDArray[np.float64]

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
        ArithmeticError: no plan was found after 800 guesses.

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
