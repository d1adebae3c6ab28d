"""Arrays by name in a NumPy archive (.npz), written at once and read without trust.

What is read is numbers and booleans only: nothing in a file can name code (no pickle), and no
array takes more memory than its header says, nor all of them more than a limit.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from rigid_envs.files import DamagedFileError, read_bytes, write_atomic

__all__ = ["read_arrays", "write_arrays"]

_LIMIT = 256 * 2**20  # bytes of a file, and of what is in it
_MOST = 50_000  # arrays in a file: to list many more takes seconds
_ENTRY = b"PK\x01\x02"  # how each one of them is listed
_SUFFIX = ".npy"
_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA)
_PIECE = 4096  # bytes that are asked for at once: LZMA unpacks so many into 60 MB at most


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays of numbers, atomically. Equal content gives equal bytes.

    Args:
        path: The file; its folder exists.
        arrays: Arrays of numbers or booleans by name.

    Raises:
        ValueError: More than can be read again.
        OSError: As `write_atomic`.
    """
    size, buffer = sum(array.nbytes for array in arrays.values()), io.BytesIO()
    if len(arrays) <= _MOST and size <= _LIMIT:
        named: dict[str, Any] = dict(arrays)
        np.savez_compressed(buffer, **named)
        size = buffer.tell()  # more than is in it where nothing can be packed
    if len(arrays) > _MOST or size > _LIMIT:
        raise ValueError(f"{len(arrays)} arrays of {size} bytes; expected at most {_MOST} of "
                         f"{_LIMIT}: write several files")  # fmt: skip
    write_atomic(path, buffer.getvalue())


def read_arrays(
    path: Path, limit: int = _LIMIT, names: Collection[str] | None = None
) -> dict[str, NDArray[Any]]:
    """Read what `write_arrays` or `numpy.savez` wrote.

    Args:
        path: The file.
        limit: Largest size of the arrays that makes sense [bytes].
        names: Of the arrays, which must be there and no others; None takes all there are.

    Raises:
        DamagedFileError: Anything but an archive of arrays of numbers, or one that is too large.
        FileNotFoundError: There is no such file.
    """
    data = read_bytes(path, limit)
    if data.count(_ENTRY) > _MOST:
        raise DamagedFileError(f"{path}: more than {_MOST} arrays")
    try:
        return _arrays(data, limit, names)
    except Exception as error:  # zipfile, what unpacks and NumPy raise many kinds of wrong bytes
        raise DamagedFileError(f"{path}: not a whole .npz archive: {error!r:.200}") from error


def _arrays(data: bytes, limit: int, names: Collection[str] | None) -> dict[str, NDArray[Any]]:
    """The arrays, none of which takes more memory than is left of the limit."""
    found: dict[str, NDArray[Any]] = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {each.filename.removesuffix(_SUFFIX): each for each in archive.infolist()}
        if len(members) < len(archive.infolist()):
            raise ValueError("two arrays of one name; expected each once")
        if names is not None and members.keys() != set(names):
            raise ValueError(f"arrays = {sorted(members)}; expected {sorted(names)}")
        for name, member in members.items():
            if member.compress_type not in _PACKINGS:
                raise ValueError(f"{name}: packed in a way that NumPy does not read or write")
            with archive.open(member) as stream:
                found[name] = _array(stream, limit)
            limit -= found[name].nbytes
    return found


def _array(stream: IO[bytes], limit: int) -> NDArray[Any]:
    """One array, of the bytes that its header says and of no others."""
    version = npy.read_magic(stream)
    if version != (1, 0):
        raise ValueError(f"npy version = {version}; expected (1, 0)")
    shape, by_column, dtype = npy.read_array_header_1_0(stream)
    if dtype.kind not in "biuf":
        raise ValueError(f"dtype = {dtype}; expected numbers or booleans")
    size = dtype.itemsize * math.prod(shape)
    if size > limit:
        raise ValueError(f"shape = {shape}: {size} bytes unpacked; expected at most {limit}")
    content = bytearray()
    while len(content) <= size and (piece := stream.read(_PIECE)):
        content += piece
    if len(content) != size:
        raise ValueError(f"{len(content)} bytes; expected {size} for shape {shape}")
    return np.frombuffer(content, dtype).reshape(shape, order="F" if by_column else "C")
