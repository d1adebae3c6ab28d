"""Atomic writes, and reads of bounded size."""

from __future__ import annotations

import contextlib
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
# Of folders: Windows, or a folder that may be written and not read, does not open them (EACCES);
# some network file systems do not sync them.
_CANNOT_SYNC = (errno.EACCES, errno.EBADF, errno.EINVAL, errno.ENOTSUP)


class DamagedFileError(ValueError):
    """A file is not what it should be: cut, changed, of another kind, or too large."""


def write_atomic(path: Path, data: bytes | str) -> None:
    """Replace a file at once: a reader, or a restart after a crash, sees the old or the new one.

    Written beside it, synced to the disk, renamed over it, and the folder synced, in this order.

    Args:
        path: The file; its folder exists.
        data: Its new content; text is written as UTF-8.

    Raises:
        OSError: Nothing was replaced; the message says how many bytes were needed. Or the file was
            replaced, and `sync_folder` failed.
    """
    data = data.encode() if isinstance(data, str) else data
    # a name that no other thread, process or machine has
    temporary = path.with_name(f".{path.name}.{os.urandom(8).hex()}{_SUFFIX}")
    try:
        with open(temporary, "xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink()
        reason = os.strerror(error.errno or errno.EIO)
        raise OSError(
            error.errno,
            f"could not write {len(data)} bytes ({reason}); what was there before is untouched",
            str(path),
        ) from error
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Write the directory entries of a folder to the disk (fsync), on systems that can.

    Raises:
        OSError: The disk failed; the names in the folder are new, but may not outlast a crash.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        if error.errno in _CANNOT_SYNC:
            return
        reason = os.strerror(error.errno or errno.EIO)
        raise OSError(
            error.errno,
            f"could not sync a folder ({reason}); what was written there last is in place, but a "
            "crash of the machine may undo it",
            str(folder),
        ) from error


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
