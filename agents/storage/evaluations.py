"""`evaluations.npz` of a run: evaluations during training, as SB3's EvalCallback writes them."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_envs.files import DamagedFileError, write_atomic
from rigid_envs.replays.archive import read_arrays

__all__ = ["read_evaluations", "write_evaluations"]

_NAMES = {"timesteps", "results", "ep_lengths", "successes", "costs"}


def write_evaluations(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write them, atomically.

    Args:
        path: File to write.
        arrays: `timesteps` of shape (k,), and of shape (k, n) what each of n episodes gave.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    write_atomic(path, buffer.getvalue())


def read_evaluations(path: Path) -> dict[str, NDArray[Any]]:
    """Read what `write_evaluations` wrote.

    Args:
        path: File to read.

    Raises:
        DamagedFileError: Anything but that; names the file.
        FileNotFoundError: There is no such file.
    """
    arrays = read_arrays(path)
    if missing := sorted(_NAMES - arrays.keys()):
        raise DamagedFileError(f"{path}: no evaluations of a training: no {', '.join(missing)}")
    return arrays
