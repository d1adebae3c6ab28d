"""Arrays by name in a NumPy archive (.npz), written at once and read without trust.

What is read is numbers and booleans only: nothing in a file can name code (no pickle), and no
array takes more memory than the file holds for it.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from rigid_envs.files import DamagedFileError, read_bytes, write_atomic

__all__ = ["read_arrays", "write_arrays"]

_LIMIT = 256 * 2**20  # bytes of a file, and of what is in it
_MOST = 50_000  # arrays in a file: to list many more takes seconds
_ENTRY = b"PK\x01\x02"  # how each one of them is listed
_SUFFIX = ".npy"


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays of numbers, atomically. Equal content gives equal bytes.

    Args:
        path: The file; its folder exists.
        arrays: Arrays of numbers or booleans by name.

    Raises:
        OSError: As `write_atomic`.
    """
    buffer = io.BytesIO()
    named: dict[str, Any] = dict(arrays)
    np.savez_compressed(buffer, **named)
    write_atomic(path, buffer.getvalue())


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read what `write_arrays` wrote.

    Raises:
        DamagedFileError: Anything but an archive of arrays of numbers, or one that is too large.
        FileNotFoundError: There is no such file.
    """
    data = read_bytes(path, _LIMIT)
    if data.count(_ENTRY) > _MOST:
        raise DamagedFileError(f"{path}: more than {_MOST} arrays")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            size = sum(member.file_size for member in archive.infolist())
            if size > _LIMIT:
                raise DamagedFileError(f"{path}: {size} bytes unpacked; expected at most {_LIMIT}")
            return {
                member.filename.removesuffix(_SUFFIX): _array(archive.read(member))
                for member in archive.infolist()
            }
    except DamagedFileError:
        raise
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise DamagedFileError(f"{path}: not a whole .npz archive: {error!r:.200}") from error
    except (ValueError, OverflowError, MemoryError, SyntaxError) as error:
        raise DamagedFileError(f"{path}: holds what is no array of numbers: {error!r:.200}") from (
            error
        )


def _array(data: bytes) -> NDArray[Any]:
    """One array; its header is compared with its bytes before any memory is taken."""
    file = io.BytesIO(data)
    version = npy.read_magic(file)
    if version != (1, 0):
        raise ValueError(f"npy version = {version}; expected (1, 0)")
    shape, _, dtype = npy.read_array_header_1_0(file)
    if dtype.kind not in "biuf":
        raise ValueError(f"dtype = {dtype}; expected numbers or booleans")
    size = dtype.itemsize
    for length in shape:
        size *= length
    if size != len(data) - file.tell():
        raise ValueError(f"{len(data) - file.tell()} bytes; expected {size} for shape {shape}")
    array: NDArray[Any] = np.load(io.BytesIO(data), allow_pickle=False)
    return array
