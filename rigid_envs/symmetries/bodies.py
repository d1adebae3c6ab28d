"""Symmetries of a free body: turns in space, half turns of the body about its principal axes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.symmetries.symmetry import Point, Symmetry, angles, signs

__all__ = ["HALF_TURN_1", "HALF_TURN_2", "TURNS_IN_SPACE"]

Array = npt.NDArray[np.float64]
_AXES = ("x", "y", "z")


def _turn(point: Point, angle: Array, axis: str) -> Point:
    # R -> S R, for the body and for its goal: what is seen from the body stays
    S = _about(axis, np.cos(0.5 * angle), np.sin(0.5 * angle))
    return point._replace(
        y=_attitudes(point.y, lambda q: _product(S, q)),
        aux=_attitudes(point.aux, lambda q: _product(S, q)),
    )


def _half_turn(point: Point, sign: Array, axis: str) -> Point:
    # R -> R D with D = diag(1, -1, -1) or the like: the same axes of the body, pointing elsewhere
    D = _about(axis, np.where(sign < 0.0, 0.0, 1.0), np.where(sign < 0.0, 1.0, 0.0))
    return point._replace(
        y=_reversed(_attitudes(point.y, lambda q: _product(q, D)), sign, axis),
        aux=_attitudes(point.aux, lambda q: _product(q, D)),
        action=_reversed(point.action, sign, axis),
    )


def _about(axis: str, scalar: Array, along: Array) -> Array:
    """Unit quaternions about an axis, shape (4, N)."""
    return np.stack([scalar, *(along if k == axis else np.zeros_like(along) for k in _AXES)])


def _product(a: Array, b: Array) -> Array:
    """Product of quaternions, shape (4, N)."""
    v = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:], axis=0)
    return np.concatenate([[a[0] * b[0] - (a[1:] * b[1:]).sum(axis=0)], v])


def _attitudes(row: Any, change: Callable[[Array], Array]) -> Any:
    """A row with all attitudes in it changed."""
    for prefix in ("", "goal_"):
        names = [prefix + k for k in ("w", *_AXES)]
        if set(names) <= set(getattr(row, "_fields", ())):
            q = change(np.stack([getattr(row, name) for name in names]))
            row = row._replace(**dict(zip(names, q, strict=True)))
    return row


def _reversed(row: Any, sign: Array, axis: str) -> Any:
    """A row with its components about the two other axes of the body reversed."""
    kept = str(1 + _AXES.index(axis))
    names = [name for name in row._fields if name[-1] in "123" and name[-1] != kept]
    return row._replace(**{name: sign * getattr(row, name) for name in names})


def _turn_about(axis: str) -> Symmetry:
    def apply(point: Point, angle: Array) -> Point:
        return _turn(point, angle, axis)

    return Symmetry(f"turn about the {axis}-axis in space", apply, angles)


def _half_turn_about(axis: str) -> Symmetry:
    def apply(point: Point, sign: Array) -> Point:
        return _half_turn(point, sign, axis)

    number = 1 + _AXES.index(axis)
    return Symmetry(f"half turn of the body about its axis e{number}", apply, signs)


TURNS_IN_SPACE = tuple(_turn_about(axis) for axis in _AXES)
HALF_TURN_1 = _half_turn_about("x")
HALF_TURN_2 = _half_turn_about("y")
