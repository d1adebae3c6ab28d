"""One file that holds named arrays and a JSON document, checked to the bit, and runs no code.

The format is safetensors, which any tool of that name reads: the length of the header (8 bytes,
little-endian), the header (JSON: dtype, shape and place of each array), and the numbers. The one
metadata entry, `rigid-envs`, is JSON: {"document": ..., "sha256": of the document and of every
array}. One file and not two, because two cannot be replaced at the same instant.

Source: https://github.com/huggingface/safetensors, section "Format".
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_envs.files import (
    DamagedFileError,
    canonical_json,
    digest,
    named_damage,
    parse_json,
    read_bytes,
    write_atomic,
)

__all__ = ["load_tensors", "save_tensors"]

_ENTRY = "rigid-envs"
_HEADER_LIMIT = 16 * 2**20
_MOST_AXES = 32  # to multiply very many lengths takes long
_KINDS = {
    "BOOL": "|b1",
    **{f"U{8 * size}": f"{'|' if size == 1 else '<'}u{size}" for size in (1, 2, 4, 8)},
    **{f"I{8 * size}": f"{'|' if size == 1 else '<'}i{size}" for size in (1, 2, 4, 8)},
    **{f"F{8 * size}": f"<f{size}" for size in (2, 4, 8)},
}
_NAMES = {kind: name for name, kind in _KINDS.items()}


def save_tensors(path: Path, arrays: Mapping[str, NDArray[Any]], document: dict[str, Any]) -> None:
    """Write arrays and a document, atomically. Equal content gives equal bytes.

    Args:
        path: File to write.
        arrays: Arrays of numbers or booleans by name.
        document: JSON values.
    """
    solid = {name: np.ascontiguousarray(a).reshape(a.shape) for name, a in arrays.items()}
    header: dict[str, Any] = {
        "__metadata__": {
            _ENTRY: canonical_json({"document": document, "sha256": digest(document, solid)})
        }
    }
    parts, end = [], 0
    for name in sorted(solid, key=lambda name: (-solid[name].itemsize, name)):  # all are aligned
        array, begin = solid[name], end
        end += array.nbytes
        header[name] = {
            "dtype": _NAMES[array.dtype.str],
            "shape": list(array.shape),
            "data_offsets": [begin, end],
        }
        parts.append(array.tobytes())
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    write_atomic(path, b"".join([len(text).to_bytes(8, "little"), text, *parts]))


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
    with named_damage(path, "not a file of this program"):
        header, numbers = _header(data)
        entry = parse_json(header.pop("__metadata__")[_ENTRY].encode())
        document = entry["document"]
        arrays = _arrays(header, numbers)
        whole = isinstance(document, dict) and entry["sha256"] == digest(document, arrays)
    if not whole:
        raise DamagedFileError(f"{path}: content does not match its checksum; the file is damaged")
    return arrays, document


def _header(data: bytes) -> tuple[dict[str, Any], memoryview]:
    """The header, and the numbers behind it."""
    length = int.from_bytes(data[:8], "little")
    most = min(len(data) - 8, _HEADER_LIMIT)
    if length > most:
        raise ValueError(f"header length = {length}; expected at most {most} bytes")
    return parse_json(data[8 : 8 + length]), memoryview(data)[8 + length :]


def _arrays(header: Mapping[str, Any], numbers: memoryview) -> dict[str, NDArray[Any]]:
    """The arrays, which follow each other without gap and fill the file."""
    arrays, end = {}, 0
    for name, place in sorted(header.items(), key=lambda item: tuple(item[1]["data_offsets"])):
        kind, shape = np.dtype(_KINDS[place["dtype"]]), place["shape"]
        begin, stop = ends = place["data_offsets"]
        if len(shape) > _MOST_AXES or any(type(n) is not int or n < 0 for n in (*shape, *ends)):
            raise ValueError(f"{name}: expected integers from 0, found {place!r:.100}")
        if begin != end or stop - begin != math.prod(shape) * kind.itemsize or stop > len(numbers):
            raise ValueError(f"{name}: expected {shape} numbers from {end}, found {place!r:.100}")
        arrays[name] = np.frombuffer(numbers[begin:stop], dtype=kind).reshape(shape).copy()
        end = stop
    if end != len(numbers):
        raise ValueError(f"{len(numbers)} bytes of numbers; expected {end}")
    return arrays
