"""Symmetries of a ball on a table that is tilted, relative to a commanded point."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks.symmetry import Point, Symmetry, everywhere, reversed_in, signs, where_still

# with the sign of X, and with that of Y; what is about the normal has both
_ALONG_X = ("X", "VX", "point_X", "y", "alpha_y", "rate_y", "z", "spin")
_ALONG_Y = ("Y", "VY", "point_Y", "x", "alpha_x", "rate_x", "z", "spin")


def _reverse(point: Point, along_x: Array, along_y: Array) -> Point:
    """X and Y multiplied by the two signs.

    Rotation vectors are axial: what is about x is multiplied by the sign of Y and that of the
    determinant, which is the other way round than for a vector. The plate Rx(alpha_x) Ry(alpha_y)
    stays a product in this order, which an exchange of x and y would reverse.
    """

    def change(row: Any) -> Any:
        return reversed_in(reversed_in(row, _ALONG_X, along_x), _ALONG_Y, along_y)

    return everywhere(point, change)


def _half_turn(point: Point, sign: Array) -> Point:
    return _reverse(point, sign, sign)


def _across_x(point: Point, sign: Array) -> Point:
    return _reverse(point, where_still(point.parameters, sign), np.ones_like(sign))


def _across_y(point: Point, sign: Array) -> Point:
    return _reverse(point, np.ones_like(sign), where_still(point.parameters, sign))


HALF_TURN = Symmetry("half a turn about the normal of the table", _half_turn, signs)
ACROSS_X = Symmetry("reflection $X -> -X$ where the table does not turn", _across_x, signs)
ACROSS_Y = Symmetry("reflection $Y -> -Y$ where the table does not turn", _across_y, signs)
