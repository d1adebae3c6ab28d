"""Checkpoints, from which a run resumes: one file each; the last two are kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from rigid_envs.files import DamagedFileError
from rigid_envs.tensorfile import load_tensors, save_tensors

__all__ = ["load_newest", "save_newest"]

Arrays = dict[str, NDArray[Any]]
Check = Callable[[Arrays, dict[str, Any]], None]
_SIZE_LIMIT = 64 * 2**30
_KEPT = 2


def save_newest(folder: Path, timesteps: int, arrays: Arrays, document: dict[str, Any]) -> None:
    """Write a checkpoint, and drop all but the last two.

    Args:
        folder: Folder of checkpoints; made if it is not there.
        timesteps: Age of the run, which names the file.
        arrays: Arrays of numbers by name.
        document: JSON values.
    """
    folder.mkdir(exist_ok=True)
    save_tensors(folder / f"{timesteps:015d}.safetensors", arrays, document)
    for old in sorted(folder.glob("*.safetensors"))[:-_KEPT]:
        old.unlink()


def load_newest(folder: Path, check: Check) -> tuple[Arrays, dict[str, Any], list[str]] | None:
    """Read the newest checkpoint that is whole and good.

    Args:
        folder: Folder of checkpoints.
        check: Raises a DamagedFileError for arrays and a document that no run can have written.

    Returns:
        Arrays, document, and a line about each newer one that is damaged; None if there is none.

    Raises:
        DamagedFileError: There are some, and all are damaged.
    """
    damaged: list[str] = []
    for path in sorted(folder.glob("*.safetensors"), reverse=True):
        try:
            arrays, document = _load(path, check)
        except DamagedFileError as error:
            damaged.append(str(error))
        else:
            return arrays, document, damaged
    if damaged:
        raise DamagedFileError("; ".join(damaged))
    return None


def _load(path: Path, check: Check) -> tuple[Arrays, dict[str, Any]]:
    arrays, document = load_tensors(path, _SIZE_LIMIT)
    try:
        check(arrays, document)
    except DamagedFileError as error:
        raise DamagedFileError(f"{path}: {error}") from None
    return arrays, document
