"""Checks of arrays for NaN and infinity, which stop a run before they reach the weights."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["NonFiniteError", "all_finite", "bad_row"]


class NonFiniteError(FloatingPointError):
    """A reward, an observation or a gradient is NaN or infinite."""


def all_finite(arrays: NDArray[Any] | Mapping[str, NDArray[Any]] | tuple[Any, ...]) -> bool:
    """Whether there is no NaN and no infinity.

    One sum is not finite when any of its terms is not, and costs less than looking at each.

    Args:
        arrays: An array or a collection of arrays.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        return all(math.isfinite(array.sum()) for array in _each(arrays))


def bad_row(arrays: NDArray[Any] | Mapping[str, NDArray[Any]] | tuple[Any, ...]) -> int | None:
    """The first row with a NaN or an infinity.

    Args:
        arrays: An array of shape (N, ...) or a collection of such.

    Returns:
        Its index, or None if all is finite.
    """
    for array in _each(arrays):
        bad = ~np.isfinite(array.reshape(len(array), -1)).all(axis=1)
        if bad.any():
            return int(bad.argmax())
    return None


def _each(arrays: Any) -> tuple[Any, ...]:
    if isinstance(arrays, dict):
        return tuple(arrays.values())
    return arrays if isinstance(arrays, tuple) else (arrays,)
