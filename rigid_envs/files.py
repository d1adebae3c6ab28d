"""Atomic writes, reads of bounded size, and JSON with one meaning."""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "DamagedFileError",
    "canonical_json",
    "digest",
    "lined_json",
    "named_damage",
    "parse_json",
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
_MISFITS = (LookupError, TypeError, AttributeError, ValueError, ArithmeticError, RecursionError)
_LONGEST = 300  # characters of what a message says is wrong


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
        with suppress(OSError):
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


@contextmanager
def named_damage(path: Path, mend: str = "") -> Iterator[None]:
    """Errors of taking the content of a file apart become one that names the file.

    Args:
        path: The file.
        mend: How to get a good one.

    Raises:
        DamagedFileError: In place of what content of another shape, kind or size raises.
    """
    try:
        yield
    except DamagedFileError as error:  # which has a name already
        raise DamagedFileError(f"{error}{mend and '; '}{mend}") from error
    except _MISFITS as error:
        why = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise DamagedFileError(f"{path}: {why[:_LONGEST]}{mend and '; '}{mend}") from error


def parse_json(data: bytes) -> Any:
    """The value of JSON in UTF-8, of which every reader has the same idea.

    Raises:
        ValueError: Something else, a key given twice, NaN, a number beyond those of doubles, or
            lists in lists without end.
    """
    try:
        return json.loads(
            data.decode(),
            object_pairs_hook=_once_each,
            parse_constant=_finite,
            parse_float=_finite,
        )
    except RecursionError:
        raise ValueError("lists or objects are nested too deeply") from None


def _once_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"{twice!r:.100} is there twice; expected each name once")
    return found


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text:.100}: expected finite numbers")
    return value


def read_json(path: Path, limit: int) -> Any:
    """The value of a JSON file of bounded size.

    Args:
        path: Its path.
        limit: Largest size that makes sense [bytes].

    Raises:
        DamagedFileError: As `read_bytes`, or what `parse_json` refuses.
        FileNotFoundError: No file.
    """
    with named_damage(path):
        return parse_json(read_bytes(path, limit))


def digest(document: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] | None = None) -> str:
    """SHA-256 of JSON values and arrays; neither order of keys nor layout in memory has an effect.

    Args:
        document: JSON values.
        arrays: Arrays of numbers by name.
    """
    found = hashlib.sha256(canonical_json(document).encode())
    for name, array in sorted((arrays or {}).items()):
        found.update(f"\0{name}\0{array.dtype.str}\0{array.shape}\0".encode())
        found.update(array.tobytes())
    return found.hexdigest()


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
