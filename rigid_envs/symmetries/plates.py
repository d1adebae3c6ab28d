"""Symmetries of a ball on a table that is tilted, relative to a commanded point."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rigid_envs.symmetries.symmetry import Point, Symmetry, signs

__all__ = ["ACROSS_X", "ACROSS_Y", "HALF_TURN"]

Array = npt.NDArray[np.float64]


def _reverse(point: Point, along_x: Array, along_y: Array) -> Point:
    """X and Y multiplied by the two signs.

    Rotation vectors are axial: what is about x is multiplied by the sign of Y and that of the
    determinant, which is the other way round than for a vector. The plate Rx(alpha_x) Ry(alpha_y)
    stays a product in this order, which an exchange of x and y would reverse.
    """
    y, aux, action = point.y, point.aux, point.action
    both = along_x * along_y
    y = y._replace(
        x=along_y * y.x,
        y=along_x * y.y,
        z=both * y.z,
        X=along_x * y.X,
        Y=along_y * y.Y,
        VX=along_x * y.VX,
        VY=along_y * y.VY,
        spin=both * y.spin,
        alpha_x=along_y * y.alpha_x,
        alpha_y=along_x * y.alpha_y,
        rate_x=along_y * y.rate_x,
        rate_y=along_x * y.rate_y,
    )
    aux = aux._replace(point_X=along_x * aux.point_X, point_Y=along_y * aux.point_Y)
    action = action._replace(rate_x=along_y * action.rate_x, rate_y=along_x * action.rate_y)
    return point._replace(y=y, aux=aux, action=action)


def _where_still(point: Point, sign: Array) -> Array:
    """The sign; 1 on a turntable, which turns in one sense."""
    return np.where(point.parameters["turntable_rate"] == 0.0, sign, 1.0)


def _half_turn(point: Point, sign: Array) -> Point:
    return _reverse(point, sign, sign)


def _across_x(point: Point, sign: Array) -> Point:
    return _reverse(point, _where_still(point, sign), np.ones_like(sign))


def _across_y(point: Point, sign: Array) -> Point:
    return _reverse(point, np.ones_like(sign), _where_still(point, sign))


HALF_TURN = Symmetry("half a turn about the normal of the table", _half_turn, signs)
ACROSS_X = Symmetry("reflection X -> -X where the table does not turn", _across_x, signs)
ACROSS_Y = Symmetry("reflection Y -> -Y where the table does not turn", _across_y, signs)
