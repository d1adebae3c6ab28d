"""The way home of a ball that rolls by quarter turns: breadth-first search, so the shortest."""

from collections.abc import Callable
from functools import cache

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations

__all__ = ["SIDES", "attitudes", "cells_and_attitudes", "fewest_moves", "way_home"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

SIDES = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
"""Cells that each of the four moves goes on."""
_HOME = 0  # number of the attitude upright


@cache
def attitudes() -> Array:
    """The 24 attitudes of a cube on its faces, upright first, shape (24, 4): products of rolls."""
    eighth = np.sqrt(0.5)
    rolls = eighth * np.array([[1.0, 0.0, 1.0, 0.0], [1.0, -1.0, 0.0, 0.0]])
    found = [rotations.identity()]
    for q in found:  # grows while it is walked through
        for roll in rolls:
            new = rotations.normalize(rotations.multiply(roll, q))
            if np.all(rotations.distance(np.array(found), new) > 0.1):
                found.append(new)
    return np.array(found)


def cells_and_attitudes(y: Array, radius: float) -> tuple[Integers, Integers]:
    """Cells, shape (..., 2), and numbers of the attitudes, shape (...), of states (..., 6)."""
    cells = np.rint(y[..., 4:6] / (0.5 * np.pi * radius)).astype(int)
    return cells, np.argmax(np.abs(y[..., :4] @ attitudes().T), axis=-1)


def fewest_moves(rolled: Integers, reach: int) -> Integers:
    """Fewest moves home, shape (2 reach + 1, 2 reach + 1, 24); -1 where there is no way.

    A move is undone by the opposite one, so the ways home are the ways from home, backwards. Ways
    that leave the square are not looked for: from k cells away they take 2 (reach + 1) - k moves or
    more, so smaller numbers are exact.

    Args:
        rolled: number of the attitude after each move, shape (24, 4).
        reach: cells on each side of home.
    """
    moves = np.full((2 * reach + 1, 2 * reach + 1, 24), -1)
    edge = np.array([[reach, reach, _HOME]])
    n = 0
    while len(edge):
        moves[tuple(edge.T)] = n
        n += 1
        cells = (edge[:, None, :2] + SIDES).reshape(-1, 2)
        turned = rolled[edge[:, 2]].reshape(-1)
        inside = np.all((cells >= 0) & (cells <= 2 * reach), axis=1)
        ahead = np.unique(np.column_stack([cells, turned])[inside], axis=0)
        edge = ahead[moves[tuple(ahead.T)] < 0]
    return moves


def way_home(rolled: Integers, reach: int) -> Callable[[Integers, Integers], Integers]:
    """The policy that takes a shortest way: of cells (N, 2) and attitudes (N,), moves (N,)."""
    moves = fewest_moves(rolled, reach)

    def policy(cells: Integers, number: Integers) -> Integers:
        ahead = cells[:, None] + SIDES + reach
        after = moves[ahead[..., 0], ahead[..., 1], rolled[number]]
        return np.argmin(after, axis=1)

    return policy
