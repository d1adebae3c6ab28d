"""Symmetries of balls on a plane and on a grid."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks import symmetry

# Symmetries of a ball that rolls on a plane, and of what it is to follow or to reach.
#
# A task's goal or reference is in its auxiliary state, under the names of the ball's pose with a
# prefix. It moves with the ball.

_PATH = (("heading_X", "heading_Y"), ("force_X", "force_Y"))
_VECTORS = (*symmetry.POSITIONS, *_PATH, ("VX", "VY"), ("FX", "FY"))
_AXES = (("x", "y"), ("goal_x", "goal_y"), ("reference_x", "reference_y"))  # of attitudes
# the mirror y = 0: of polar vectors it reverses y, of axial ones x and z
_REVERSED = (
    *(b for _, b in _VECTORS),
    *(prefix + a for prefix in ("", "goal_", "reference_") for a in "xz"),
    "spin",
    "curvature",
)


def _turn(point: symmetry.Point, angle: Array) -> symmetry.Point:
    # R -> S R S^-1: the axis of the rotation turns like a vector, its angle stays
    return symmetry.everywhere(point, lambda row: symmetry.turned(row, (*_VECTORS, *_AXES), angle))


def _reflect(point: symmetry.Point, sign: Array) -> symmetry.Point:
    sign = symmetry.where_still(point.parameters, sign)
    return symmetry.everywhere(point, lambda row: symmetry.reversed_in(row, _REVERSED, sign))


def _choose_axes(point: symmetry.Point, q: Array) -> symmetry.Point:
    # R -> R P with the same P for the ball and its goal
    return symmetry.everywhere(point, lambda row: symmetry.attitudes(row, right=q.T))


TURN = symmetry.Symmetry("turn about the vertical through the origin", _turn, symmetry.angles)
REFLECTION = symmetry.Symmetry(
    "reflection in a vertical plane through the origin", _reflect, symmetry.signs
)
BODY_AXES = symmetry.Symmetry("choice of the body axes", _choose_axes, symmetry.rotations)


# Symmetries of a ball that is rolled on a grid of squares: those of the square, D4.

_QUARTER = 0.5 * np.pi


class _Direction(NamedTuple):
    """Direction of a roll as a vector."""

    VX: Array
    VY: Array


def _of_a_square(
    apply: Callable[[symmetry.Point, Array], symmetry.Point], unit: float
) -> Callable[[symmetry.Point, Array], symmetry.Point]:
    """The same change with side k as the direction at k quarter turns, elements times `unit`."""

    def changed(point: symmetry.Point, element: Array) -> symmetry.Point:
        angle = _QUARTER * point.action.side
        direction = _Direction(np.cos(angle), np.sin(angle))
        new = apply(point._replace(action=direction), unit * element)
        side = np.rint(np.arctan2(new.action.VY, new.action.VX) / _QUARTER) % 4.0
        return new._replace(action=point.action._replace(side=side))

    return changed


QUARTER_TURN = symmetry.Symmetry(
    "quarter turns about the vertical through home",
    _of_a_square(TURN.apply, _QUARTER),
    symmetry.quarter_turns,
)
GRID_REFLECTION = symmetry.Symmetry(
    "reflection in the plane through home and $+x$",
    _of_a_square(REFLECTION.apply, 1.0),
    symmetry.signs,
)
