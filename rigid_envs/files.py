"""Atomic writes, and reads of bounded size."""

from __future__ import annotations

import errno
import json
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

__all__ = [
    "DamagedFileError",
    "canonical_json",
    "lined_json",
    "read_bytes",
    "read_json",
    "sweep",
    "sync_folder",
    "write_atomic",
]

_SUFFIX = ".tmp"


class DamagedFileError(ValueError):
    """A file is not what it should be: cut, changed, of another kind, or too large."""


def write_atomic(path: Path, data: bytes | str) -> None:
    """Replace a file at once: a reader, or a restart after a crash, sees the old or the new one.

    Written beside it, synced to the disk, renamed over it, and the folder synced, in this order.

    Args:
        path: The file; its folder exists.
        data: Its new content; text is written as UTF-8.

    Raises:
        OSError: Nothing was replaced; the message says how many bytes were needed.
    """
    data = data.encode() if isinstance(data, str) else data
    temporary = path.with_name(f".{path.name}.{os.getpid()}{_SUFFIX}")
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
        sync_folder(path.parent)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        reason = os.strerror(error.errno or errno.EIO)
        raise OSError(
            error.errno,
            f"could not write {len(data)} bytes ({reason}); what was there before is untouched",
            str(path),
        ) from error


def sync_folder(folder: Path) -> None:
    """Write the directory entries of a folder to the disk (fsync)."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sweep(folder: Path) -> None:
    """Remove the temporary files of interrupted writes in a folder and below.

    Args:
        folder: A folder that this process alone writes to.
    """
    for leftover in folder.rglob(f".*{_SUFFIX}"):
        leftover.unlink()


def read_bytes(path: Path, limit: int) -> bytes:
    """The content of a regular file of bounded size.

    Args:
        path: Its path.
        limit: Largest size that makes sense [bytes].

    Raises:
        DamagedFileError: No regular file (a pipe would never end), or larger than the limit.
        FileNotFoundError: No file.
    """
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise DamagedFileError(f"{path}: not a regular file")
    if status.st_size > limit:
        raise DamagedFileError(f"{path}: {status.st_size} bytes; expected at most {limit}")
    return path.read_bytes()


def read_json(path: Path, limit: int) -> Any:
    """The value of a JSON file of bounded size.

    Args:
        path: Its path.
        limit: Largest size that makes sense [bytes].

    Raises:
        DamagedFileError: As `read_bytes`.
        FileNotFoundError: No file.
        ValueError: No JSON in UTF-8, or lists in lists without end.
    """
    text = read_bytes(path, limit).decode()
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("lists or objects are nested too deeply") from None


def canonical_json(value: Mapping[str, Any], indent: int | None = None) -> str:
    """JSON of one spelling: keys sorted, ASCII, no NaN; equal content gives equal bytes.

    Args:
        value: JSON values.
        indent: Spaces for each level; None writes one line.
    """
    separators = (",", ":") if indent is None else (",", ": ")
    return json.dumps(value, sort_keys=True, allow_nan=False, separators=separators, indent=indent)


def lined_json(value: Mapping[str, Any]) -> str:
    """JSON with one line for each key, in their order, and without NaN.

    Args:
        value: JSON values.
    """
    lines = (f'"{key}": {json.dumps(each, allow_nan=False)}' for key, each in value.items())
    return "{\n" + ",\n".join(lines) + "\n}\n"
