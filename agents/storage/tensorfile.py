"""One file that holds named arrays and a JSON document, checked to the bit, and runs no code.

The format is safetensors, which any tool of that name reads. Its one metadata entry, `rigid-envs`,
is JSON: {"document": ..., "sha256": of the document and of every array}. One file and not two,
because two cannot be replaced at the same instant.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy
from numpy.typing import NDArray
from safetensors import SafetensorError

from rigid_envs.files import DamagedFileError, canonical_json, read_bytes, write_atomic

__all__ = ["load_tensors", "save_tensors"]

_ENTRY = "rigid-envs"
_HEADER_LIMIT = 16 * 2**20


def save_tensors(path: Path, arrays: Mapping[str, NDArray[Any]], document: dict[str, Any]) -> None:
    """Write arrays and a document, atomically. Equal content gives equal bytes.

    Args:
        path: File to write.
        arrays: Arrays of numbers or booleans by name.
        document: JSON values.
    """
    solid = {name: np.ascontiguousarray(a).reshape(a.shape) for name, a in arrays.items()}
    entry = canonical_json({"document": document, "sha256": _digest(solid, document)})
    write_atomic(path, safetensors.numpy.save(solid, {_ENTRY: entry}))


def load_tensors(path: Path, limit: int) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read what `save_tensors` wrote.

    Args:
        path: File to read.
        limit: Largest size of file that makes sense [bytes].

    Returns:
        The arrays, writable, and the document.

    Raises:
        DamagedFileError: Anything but that; the message names the file and what is wrong with it.
        FileNotFoundError: There is no such file.
    """
    data = read_bytes(path, limit)
    try:
        entry = _entry(data)
        document, digest = entry["document"], entry["sha256"]
        arrays = safetensors.numpy.load(data)
    except (SafetensorError, LookupError, TypeError, ValueError, RecursionError) as error:
        raise DamagedFileError(f"{path}: not a file of this program: {error!r:.200}") from error
    if not isinstance(document, dict) or digest != _digest(arrays, document):
        raise DamagedFileError(f"{path}: content does not match its checksum; the file is damaged")
    return arrays, document


def _entry(data: bytes) -> dict[str, Any]:
    length = int.from_bytes(data[:8], "little")
    if not 2 <= length <= min(len(data) - 8, _HEADER_LIMIT):
        raise ValueError(f"header length = {length}; expected 2 to {len(data) - 8} bytes")
    header = json.loads(data[8 : 8 + length])
    entry: dict[str, Any] = json.loads(header["__metadata__"][_ENTRY])
    return entry


def _digest(arrays: Mapping[str, NDArray[Any]], document: dict[str, Any]) -> str:
    digest = hashlib.sha256(canonical_json(document).encode())
    for name in sorted(arrays):
        array = arrays[name]
        digest.update(f"\0{name}\0{array.dtype.str}\0{array.shape}\0".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()
