"""Changes of rows of numbers by their names: vectors turned, components reversed, attitudes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = [
    "Quaternions",
    "about_z",
    "attitude",
    "attitudes",
    "product",
    "reversed_in",
    "turned",
    "where_still",
]

Array = npt.NDArray[np.float64]
Quaternions = tuple[Array, Array, Array, Array]
"""Components w, x, y, z, each of shape (N,)."""

_PREFIXES = ("", "goal_", "reference_")


def turned(row: Any, pairs: Iterable[tuple[str, str]], angle: Array) -> Any:
    """A row with those of its vectors turned that are among the pairs of names."""
    c, s = np.cos(angle), np.sin(angle)
    new: dict[str, Array] = {}
    for a, b in pairs:
        if a in row._fields:
            x, y = getattr(row, a), getattr(row, b)
            new |= {a: c * x - s * y, b: s * x + c * y}
    return row._replace(**new)


def reversed_in(row: Any, names: Iterable[str], sign: Array) -> Any:
    """A row with those of its numbers that are among the names times a sign."""
    return row._replace(
        **{name: sign * getattr(row, name) for name in names if name in row._fields}
    )


def where_still(parameters: Mapping[str, Array], sign: Array) -> Array:
    """The sign; 1 on a turntable, which turns in one sense, so that no reflection is a symmetry."""
    return np.where(np.asarray(parameters.get("turntable_rate", 0.0)) == 0.0, sign, 1.0)


def product(p: Quaternions, q: Quaternions) -> Quaternions:
    """Product p q of quaternions."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def about_z(angle: Array) -> Quaternions:
    """Turns about the z-axis."""
    zero = np.zeros_like(angle)
    return np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)


def attitude(row: Any, prefix: str = "") -> Quaternions:
    """The attitude in a row, under names with a prefix."""
    w, x, y, z = (getattr(row, prefix + name) for name in "wxyz")
    return w, x, y, z


def attitudes(row: Any, left: Quaternions | None = None, right: Quaternions | None = None) -> Any:
    """A row with all its attitudes multiplied by a quaternion from the left or the right."""
    new: dict[str, Array] = {}
    for prefix in _PREFIXES:
        if f"{prefix}w" in getattr(row, "_fields", ()):
            q = attitude(row, prefix)
            q = q if left is None else product(left, q)
            q = q if right is None else product(q, right)
            new |= {prefix + name: part for name, part in zip("wxyz", q, strict=True)}
    return row._replace(**new) if new else row
