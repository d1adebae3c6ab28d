"""Infos of some rows, from Gymnasium's one dictionary of arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["rows_of", "split"]


def split(columns: Mapping[str, Any], rows: NDArray[np.intp]) -> list[dict[str, Any]]:
    """One dictionary for each of some rows.

    Args:
        columns: Info entries over all rows, each with its mask `_key` where not every row has it.
        rows: Indices of the rows, shape (k,).

    Returns:
        k dictionaries of Python scalars and copied arrays.
    """
    keys = [key for key in columns if not (key.startswith("_") and key[1:] in columns)]
    if not keys:
        return [{} for _ in rows]
    values = zip(*[rows_of(columns[key], rows) for key in keys], strict=True)
    infos = [dict(zip(keys, row, strict=True)) for row in values]
    for key in keys:
        mask = columns.get(f"_{key}")
        if mask is not None and not mask[rows].all():
            for info, there in zip(infos, mask[rows].tolist(), strict=True):
                if not there:
                    del info[key]
    return infos


def rows_of(column: Any, rows: NDArray[np.intp]) -> list[Any]:
    """Some rows of one info entry.

    Args:
        column: Array over the rows, shape (N, ...), or a dictionary of such.
        rows: Indices of the rows, shape (k,).

    Returns:
        k Python scalars, copied arrays, or dictionaries of them.
    """
    if isinstance(column, dict):
        return split(column, rows)
    picked = np.asarray(column)[rows]
    return picked.tolist() if picked.ndim == 1 else list(picked)
