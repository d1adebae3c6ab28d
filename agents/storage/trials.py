"""`trial.json` of a trial of a search: the values that it tried, and what came of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rigid_envs.documents import checked_values, read_document, write_document

from ..config.search import FIGURES

__all__ = ["WORST", "read_trial", "write_trial"]

WORST = {name: math.inf if way == "min" else -math.inf for name, way in FIGURES.items()}
"""Figures of a training that diverged."""

_FORMAT = "rigid-envs trial 1"
_LIMIT = 2**20  # bytes


def write_trial(file: Path, values: Mapping[str, Any], figures: Mapping[str, float]) -> None:
    """Write a trial, atomically. JSON has no infinity: a figure of a divergence is null.

    Args:
        file: Its path.
        values: By path of the entry.
        figures: Those of `FIGURES`, by name.
    """
    finite = {name: each if math.isfinite(each) else None for name, each in figures.items()}
    write_document(file, {"format": _FORMAT, "values": values, "figures": finite})


def read_trial(file: Path) -> dict[str, Any]:
    """The values and the figures of a trial.

    Args:
        file: Its path.

    Raises:
        DamagedFileError: Anything but what `write_trial` wrote; names the file.
        FileNotFoundError: There is no such file.
    """
    mend = "search anew: --out names another folder"
    with read_document(file, _FORMAT, _LIMIT, mend) as document:
        found = checked_values(document, {"values": dict, "figures": dict})
        figures = checked_values(found["figures"], dict.fromkeys(FIGURES, float | None))
        known = {name: each for name, each in figures.items() if each is not None}
        return {"values": found["values"], "figures": WORST | known}
