"""`evaluations.npz` of a run: evaluations during training, as SB3's EvalCallback writes them."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_envs.archive import read_arrays
from rigid_envs.checks import exact_array, require
from rigid_envs.files import named_damage, write_atomic

__all__ = ["read_evaluations", "write_evaluations"]

_NAMES = ("timesteps", "results", "ep_lengths", "successes", "costs")
_LIMIT = 2**26  # bytes


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
    arrays = read_arrays(path, _LIMIT, _NAMES)
    with named_damage(path):
        exact_array(arrays["timesteps"], "timesteps", "k")
        shape = arrays["results"].shape
        for name in _NAMES[1:]:
            exact_array(arrays[name].astype(np.float64), name, len(arrays["timesteps"]), "n")
            require(arrays[name].shape == shape, arrays[name].shape, f"shape of {name}", str(shape))
    return arrays
