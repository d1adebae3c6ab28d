"""Symmetries of a ball that rolls on a plane, and of what it is to follow or to reach.

A task's goal or reference is in its auxiliary state, under the names of the ball's pose with a
prefix. It moves with the ball.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.symmetries.changes import attitudes, reversed_in, turned, where_still
from rigid_envs.symmetries.symmetry import Point, Symmetry, angles, offsets, rotations, signs

__all__ = ["BODY_AXES", "REFLECTION", "TRANSLATION", "TURN"]

Array = npt.NDArray[np.float64]

_POSITIONS = (("X", "Y"), ("goal_X", "goal_Y"), ("reference_X", "reference_Y"))
_PATH = (("heading_X", "heading_Y"), ("force_X", "force_Y"))
_VECTORS = (*_POSITIONS, *_PATH, ("VX", "VY"), ("FX", "FY"))
_AXES = (("x", "y"), ("goal_x", "goal_y"), ("reference_x", "reference_y"))  # of attitudes
# the mirror y = 0: of polar vectors it reverses y, of axial ones x and z
_REVERSED = (
    *(b for _, b in _VECTORS),
    *(prefix + a for prefix in ("", "goal_", "reference_") for a in "xz"),
    "spin",
    "curvature",
)


def _everywhere(point: Point, change: Callable[[Any], Any]) -> Point:
    aux = change(point.aux) if point.aux else ()
    return point._replace(y=change(point.y), aux=aux, action=change(point.action))


def _turn(point: Point, angle: Array) -> Point:
    # R -> S R S^-1: the axis of the rotation turns like a vector, its angle stays
    return _everywhere(point, lambda row: turned(row, (*_VECTORS, *_AXES), angle))


def _reflect(point: Point, sign: Array) -> Point:
    sign = where_still(point.parameters, sign)
    return _everywhere(point, lambda row: reversed_in(row, _REVERSED, sign))


def _move(point: Point, offset: Array) -> Point:
    def change(row: Any) -> Any:
        places = [(a, k) for pair in _POSITIONS for k, a in enumerate(pair) if a in row._fields]
        return row._replace(**{name: getattr(row, name) + offset[:, k] for name, k in places})

    return point._replace(y=change(point.y), aux=change(point.aux))


def _choose_axes(point: Point, q: Array) -> Point:
    # R -> R P with the same P for the ball and its goal
    P = (q[:, 0], q[:, 1], q[:, 2], q[:, 3])
    return point._replace(y=attitudes(point.y, right=P), aux=attitudes(point.aux, right=P))


TURN = Symmetry("turn about the vertical through the origin", _turn, angles)
REFLECTION = Symmetry("reflection in a vertical plane through the origin", _reflect, signs)
TRANSLATION = Symmetry("translation in the plane", _move, offsets)
BODY_AXES = Symmetry("choice of the body axes", _choose_axes, rotations)
