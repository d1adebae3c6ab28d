"""Symmetries of a ball that rolls on a plane, and of what it is to follow or to reach.

A task's goal or reference is in its auxiliary state, under the names of the ball's pose with a
prefix. It moves with the ball.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.symmetries.symmetry import Point, Symmetry, angles, signs

__all__ = ["BODY_AXES", "REFLECTION", "TRANSLATION", "TURN"]

Array = npt.NDArray[np.float64]
Rows = Callable[[Any], Any]

_POSITIONS = (("X", "Y"), ("goal_X", "goal_Y"), ("reference_X", "reference_Y"))
_PATH = (("heading_X", "heading_Y"), ("force_X", "force_Y"))
_VECTORS = (*_POSITIONS, *_PATH, ("VX", "VY"), ("FX", "FY"))
_ATTITUDES = ("", "goal_", "reference_")
_SENSES = ("spin", "curvature")  # turn about the vertical: a reflection reverses them
_FARTHEST = 3.0  # of the translations that are drawn, in metres


def _names(row: Any) -> tuple[str, ...]:
    names: tuple[str, ...] = getattr(row, "_fields", ())
    return names


def _attitudes(row: Any) -> list[str]:
    return [prefix for prefix in _ATTITUDES if f"{prefix}w" in _names(row)]


def _vectors(row: Any) -> list[tuple[str, str]]:
    return [pair for pair in _VECTORS if pair[0] in _names(row)]


def _everywhere(point: Point, change: Rows) -> Point:
    return point._replace(
        y=change(point.y), aux=change(point.aux) if point.aux else (), action=change(point.action)
    )


def _turn(point: Point, angle: Array) -> Point:
    # R -> S R S^-1: the axis of the rotation turns like a vector, its angle stays
    c, s = np.cos(angle), np.sin(angle)

    def change(row: Any) -> Any:
        new: dict[str, Array] = {}
        for a, b in (*_vectors(row), *((f"{k}x", f"{k}y") for k in _attitudes(row))):
            x, y = getattr(row, a), getattr(row, b)
            new |= {a: c * x - s * y, b: s * x + c * y}
        return row._replace(**new)

    return _everywhere(point, change)


def _reflect(point: Point, sign: Array) -> Point:
    # a turntable turns in one sense, which a reflection would reverse
    table = np.asarray(point.parameters.get("turntable_rate", 0.0))
    sign = np.where(table == 0.0, sign, 1.0)

    def change(row: Any) -> Any:
        # y -> -y: the axis of a rotation is an axial vector, reversed in the plane of the mirror
        new = {b: sign * getattr(row, b) for _, b in _vectors(row)}
        new |= {f"{k}{a}": sign * getattr(row, f"{k}{a}") for k in _attitudes(row) for a in "xz"}
        new |= {name: sign * getattr(row, name) for name in _SENSES if name in _names(row)}
        return row._replace(**new)

    return _everywhere(point, change)


def _move(point: Point, offset: Array) -> Point:
    def change(row: Any) -> Any:
        pairs = [pair for pair in _POSITIONS if pair[0] in _names(row)]
        return row._replace(
            **{name: getattr(row, name) + offset[:, k] for a in pairs for k, name in enumerate(a)}
        )

    return point._replace(y=change(point.y), aux=change(point.aux))


def _other_body_axes(point: Point, p: Array) -> Point:
    # R -> R P with the same P for the ball and its goal
    b0, b1, b2, b3 = p.T

    def change(row: Any) -> Any:
        new = {}
        for k in _attitudes(row):
            a0, a1, a2, a3 = (getattr(row, k + name) for name in "wxyz")
            new[f"{k}w"] = a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3
            new[f"{k}x"] = a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2
            new[f"{k}y"] = a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1
            new[f"{k}z"] = a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0
        return row._replace(**new)

    return point._replace(y=change(point.y), aux=change(point.aux))


def _offsets(rng: np.random.Generator, n: int) -> Array:
    return rng.uniform(-_FARTHEST, _FARTHEST, (n, 2))


def _rotations(rng: np.random.Generator, n: int) -> Array:
    q = rng.standard_normal((n, 4))
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True))


TURN = Symmetry("turn about the vertical through the origin", _turn, angles)
REFLECTION = Symmetry("reflection in a vertical plane through the origin", _reflect, signs)
TRANSLATION = Symmetry("translation in the plane", _move, _offsets)
BODY_AXES = Symmetry("choice of the body axes", _other_body_axes, _rotations)
