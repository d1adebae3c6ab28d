"""Symmetries of a ball that rolls on a plane."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.symmetries.symmetry import Point, Symmetry, angles, signs

__all__ = ["REFLECTION", "TURN"]

Array = npt.NDArray[np.float64]


def _turned(pairs: tuple[tuple[str, str], ...], row: Any, angle: Array) -> Any:
    """Horizontal components, given by pairs of names, turned about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    new: dict[str, Array] = {}
    for a, b in pairs:
        x, y = getattr(row, a), getattr(row, b)
        new |= {a: c * x - s * y, b: s * x + c * y}
    return row._replace(**new)


def _turn(point: Point, angle: Array) -> Point:
    # R -> S R S^-1: the axis of the rotation turns, its angle stays
    y = _turned((("x", "y"), *_pairs(point.y)), point.y, angle)
    action = _turned((point.action._fields[:2],), point.action, angle)
    return point._replace(y=y, action=action)


def _reflect(point: Point, sign: Array) -> Point:
    # a turntable turns in one sense, which a reflection reverses
    table = point.parameters.get("turntable_rate", 0.0)
    sign = np.where(np.asarray(table) == 0.0, sign, 1.0)
    # y -> -y; rotation vectors and spins are axial: their components in the plane of the mirror,
    # x and z, are reversed
    y, left = point.y, point.action._fields[1]
    new = {"x": sign * y.x, "z": sign * y.z}
    new |= {b: sign * getattr(y, b) for _, b in _pairs(y)}
    if "spin" in y._fields:
        new["spin"] = sign * y.spin
    action = point.action._replace(**{left: sign * getattr(point.action, left)})
    return point._replace(y=y._replace(**new), action=action)


def _pairs(y: Any) -> tuple[tuple[str, str], ...]:
    """Horizontal vectors of a state."""
    known = (("X", "Y"), ("VX", "VY"))
    return tuple(pair for pair in known if pair[0] in y._fields)


TURN = Symmetry("turn about the vertical through the goal", _turn, angles)
REFLECTION = Symmetry("reflection in a vertical plane through the goal", _reflect, signs)
