"""Files of a run: logs, evaluations, checkpoints."""

import contextlib
import csv
import io
import os
import threading
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.logger import TensorBoardOutputFormat
from torch.utils.tensorboard import SummaryWriter

from rigid_envs.base import files
from rigid_envs.base.checks import exact_array, require
from rigid_envs.base.files import DamagedFileError

# Logs that a resumed run continues as if it had never stopped: CSV rows and TensorBoard events.

_LONGEST = 2**16  # bytes of a row


def check_position(path: Path, position: int, begin: str = "") -> None:
    """Refuse a position in a CSV file that is not behind a row of it.

    Args:
        path: The file.
        position: Length to cut it back to [bytes].
        begin: How the last row before it begins.

    Raises:
        DamagedFileError: It is not that; names the file.
    """
    try:
        with open(path, "rb") as file:
            size = file.seek(0, os.SEEK_END)
            if not 0 < position <= size:
                raise DamagedFileError(f"{path}: {size} bytes; the checkpoint knows of {position}")
            start = file.seek(max(position - _LONGEST, 0))
            rows = file.read(position - start)
    except OSError as error:
        raise DamagedFileError(f"{path}: {error.strerror}; the checkpoint knows of it") from None
    last = rows.removesuffix(b"\n").rpartition(b"\n")[2]
    if not (rows.endswith(b"\n") and last.startswith(begin.encode())):
        raise files.DamagedFileError(
            f"{path}: byte {position} is not behind a row `{begin}...`, as the checkpoint has it"
        )


class CsvLog:
    """A CSV file with fixed columns, to which rows are added.

    Columns never change, unlike those of SB3's CSV writer, which rewrites the file for each new
    one: what is written stays, and cutting the file back to a position undoes what came after.
    """

    def __init__(
        self, path: Path, columns: Iterable[str], preamble: str = "", position: int | None = None
    ) -> None:
        """Start a file, or append to one.

        Args:
            path: File to write.
            columns: Names of the columns.
            preamble: Text above the header.
            position: Length to cut an existing file back to [bytes]; None starts a new one.

        Raises:
            FileNotFoundError: There is no file to cut back.
        """
        self.columns, self._path = tuple(columns), path
        if position is None:
            self._file = open(path, "wb")
            self._file.write((preamble + ",".join(self.columns) + "\n").encode())
            return
        os.truncate(path, position)
        self._file = open(path, "ab")

    def write(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Add rows.

        Args:
            rows: Values by column; a column that is missing or None stays empty.

        Raises:
            OSError: The disk is full, or gone; names the file.
        """
        text = io.StringIO()
        csv.DictWriter(text, self.columns, "", "ignore", lineterminator="\n").writerows(rows)
        try:
            self._file.write(text.getvalue().encode())
            self._file.flush()
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self._path)) from error

    def sync(self) -> int:
        """Bring the file to the disk.

        Returns:
            Its length [bytes].
        """
        self._file.flush()
        os.fsync(self._file.fileno())
        return self._file.tell()

    def close(self) -> None:
        """Close the file; what could not be written has been told of."""
        with contextlib.suppress(OSError):
            self._file.close()


def read_rows(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file of a run, by column."""
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


class _UnlessKept:
    """Hook for exceptions of threads, without those that a thread keeps for its owner to raise.

    TensorBoard's writer does so; told twice, its traceback would run through our line of error.
    """

    def __init__(self, ordinary: Callable[[threading.ExceptHookArgs], Any]) -> None:
        self._ordinary = ordinary

    def __call__(self, told: threading.ExceptHookArgs) -> None:
        kept = getattr(told.thread, "exception", None)
        if kept is None or kept is not told.exc_value:
            self._ordinary(told)


class TensorBoardLog(TensorBoardOutputFormat):
    """SB3's TensorBoard writer, able to hide what a run that goes on will write again."""

    def __init__(self, folder: Path, purge_step: int | None) -> None:
        """Open an event file.

        Args:
            folder: Where event files are.
            purge_step: First step whose earlier events are void; None if there are none.
        """
        if not isinstance(threading.excepthook, _UnlessKept):
            threading.excepthook = _UnlessKept(threading.excepthook)
        self.writer = SummaryWriter(log_dir=str(folder), purge_step=purge_step)
        self._is_closed, self._folder = False, folder

    def write(  # noqa: D102
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        try:
            super().write(key_values, key_excluded, step)
        except OSError as error:  # of its thread, which names nothing
            raise OSError(error.errno, error.strerror, str(self._folder)) from error

    def close(self) -> None:
        """Close the file; what could not be written has been told of."""
        with contextlib.suppress(OSError):
            super().close()


# `evaluations.npz` of a run: evaluations during training, as SB3's EvalCallback writes them.

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
    files.write_atomic(path, buffer.getvalue())


def read_evaluations(path: Path) -> dict[str, NDArray[Any]]:
    """Read what `write_evaluations` wrote.

    Args:
        path: File to read.

    Raises:
        DamagedFileError: Anything but that; names the file.
        FileNotFoundError: There is no such file.
    """
    arrays = files.read_arrays(path, _LIMIT, _NAMES)
    with files.named_damage(path):
        exact_array(arrays["timesteps"], "timesteps", "k")
        shape = arrays["results"].shape
        for name in _NAMES[1:]:
            exact_array(arrays[name].astype(np.float64), name, len(arrays["timesteps"]), "n")
            require(arrays[name].shape == shape, arrays[name].shape, f"shape of {name}", str(shape))
    return arrays


# Checkpoints, from which a run resumes: one file each; the last two are kept.

Arrays = dict[str, NDArray[Any]]


def flat(values: Mapping[Any, Any], prefix: str = "") -> Arrays:
    """Arrays of nested mappings by the path to each, ``outer/inner``; None is left out."""
    arrays: Arrays = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            arrays |= flat(value, f"{prefix}{key}/")
        elif value is not None:
            arrays[f"{prefix}{key}"] = np.asarray(value)
    return arrays


def under(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    """Those arrays of `flat` that are inside a mapping."""
    start = f"{prefix}/"
    return {k.removeprefix(start): value for k, value in arrays.items() if k.startswith(start)}


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
    files.save_tensors(folder / f"{timesteps:015d}.safetensors", arrays, document)
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
        except files.DamagedFileError as error:
            damaged.append(str(error))
        else:
            return arrays, document, damaged
    if damaged:
        raise files.DamagedFileError("; ".join(damaged))
    return None


def _load(path: Path, check: Check) -> tuple[Arrays, dict[str, Any]]:
    arrays, document = files.load_tensors(path, _SIZE_LIMIT)
    try:
        check(arrays, document)
    except files.DamagedFileError as error:
        raise files.DamagedFileError(f"{path}: {error}") from None
    return arrays, document
