"""Symmetries of balls on a plane and on a grid."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks.symmetry import (
    Point,
    Symmetry,
    angles,
    attitudes,
    offsets,
    quarter_turns,
    reversed_in,
    rotations,
    signs,
    turned,
    where_still,
)

# Symmetries of a ball that rolls on a plane, and of what it is to follow or to reach.
#
# A task's goal or reference is in its auxiliary state, under the names of the ball's pose with a
# prefix. It moves with the ball.

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


# Symmetries of a ball that is rolled on a grid of squares: those of the square, D4.

_QUARTER = 0.5 * np.pi


class _Direction(NamedTuple):
    """Direction of a roll as a vector."""

    VX: Array
    VY: Array


def _of_a_square(
    apply: Callable[[Point, Array], Point], unit: float
) -> Callable[[Point, Array], Point]:
    """The same change with side k as the direction at k quarter turns, elements times `unit`."""

    def changed(point: Point, element: Array) -> Point:
        angle = _QUARTER * point.action.side
        direction = _Direction(np.cos(angle), np.sin(angle))
        new = apply(point._replace(action=direction), unit * element)
        side = np.rint(np.arctan2(new.action.VY, new.action.VX) / _QUARTER) % 4.0
        return new._replace(action=point.action._replace(side=side))

    return changed


QUARTER_TURN = Symmetry(
    "quarter turns about the vertical through home",
    _of_a_square(TURN.apply, _QUARTER),
    quarter_turns,
)
GRID_REFLECTION = Symmetry(
    "reflection in the plane through home and +x", _of_a_square(REFLECTION.apply, 1.0), signs
)
