"""Small files that would take much memory or time.

Prints for every kind of file and bomb the time that its reader computed [s] and by how much the
process grew [MiB], as JSON; a reader must refuse each.
"""

import io
import json
import resource
import tempfile
import time
import zipfile
from pathlib import Path

import numpy as np

from tests.loading.readers import READERS

_DEEP = 100_000
_HUGE = 2**31


def _header(shape):
    """Begin of an array of float64 of some shape."""
    buffer = io.BytesIO()
    described = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(buffer, described)
    return buffer.getvalue()


def _zipped(kind, *members):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", kind) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return buffer.getvalue()


def _zeros(kind, shape=(2**26,)):
    """An archive whose one array is half a gigabyte of zeros, written by the megabyte."""
    buffer = io.BytesIO()
    with (
        zipfile.ZipFile(buffer, "w", kind) as archive,
        archive.open("timesteps.npy", "w") as member,
    ):
        member.write(_header(shape))
        for _ in range(2**9):
            member.write(bytes(2**20))
    return buffer.getvalue()


def _understated(kind):
    """The same, of which the list of its members says that it unpacks into 200 bytes."""
    data = bytearray(_zeros(kind, (9,)))
    place = data.index(b"PK\x01\x02") + 24
    data[place : place + 4] = (200).to_bytes(4, "little")
    return bytes(data)


def _many(n=_DEEP):
    """An archive with very many members."""
    content = _header((0,))
    return _zipped(zipfile.ZIP_STORED, *((f"{k}.npy", content) for k in range(n)))


def _tensors(header):
    return len(header).to_bytes(8, "little") + header


BOMBS = {
    "zip, zeros": lambda: _zeros(zipfile.ZIP_DEFLATED),
    "zip, zeros, LZMA": lambda: _zeros(zipfile.ZIP_LZMA),
    "zip, zeros behind an array": lambda: _zeros(zipfile.ZIP_DEFLATED, (9,)),
    "zip, zeros, understated": lambda: _understated(zipfile.ZIP_DEFLATED),
    "zip, zeros, bzip2": lambda: _zeros(zipfile.ZIP_BZIP2),
    "zip, many members": _many,
    "zip, long array": lambda: _zipped(zipfile.ZIP_STORED, ("timesteps.npy", _header((_HUGE,)))),
    "zip, twice the same": lambda: _zipped(
        zipfile.ZIP_STORED, *[("timesteps.npy", _header((1,)) + bytes(8))] * 2
    ),
    "zip, out of the folder": lambda: _zipped(
        zipfile.ZIP_STORED, ("../timesteps.npy", _header((1,)) + bytes(8))
    ),
    "JSON, deep": lambda: b"[" * _DEEP,
    "JSON, deep, closed": lambda: b'{"a":' * _DEEP + b"1" + b"}" * _DEEP,
    "JSON, long number": lambda: b'{"format": ' + b"9" * 10**6 + b"}",
    "YAML, aliases": lambda: (
        b"a: &a [x, x]\n"
        + b"".join(
            b"%c: &%c [*%c, *%c, *%c, *%c]\n" % (k + 1, k + 1, k, k, k, k) for k in range(97, 120)
        )
    ),
    "YAML, deep": lambda: b"[" * _DEEP,
    "tensors, long header": lambda: (2**40).to_bytes(8, "little") + b"{}",
    "tensors, deep header": lambda: _tensors(b"[" * _DEEP),
    "tensors, long array": lambda: _tensors(
        json.dumps(
            {"a": {"dtype": "F64", "shape": [_HUGE, _HUGE], "data_offsets": [0, 8 * _HUGE**2]}}
        ).encode()
    ),
    "tensors, many axes": lambda: _tensors(
        b'{"a": {"dtype": "F64", "data_offsets": [0, 0], "shape": [9' + b", 9" * 10**6 + b"]}}"
    ),
    "tensors, many": lambda: _tensors(
        json.dumps(
            {
                str(k): {"dtype": "F64", "shape": [0], "data_offsets": [0, 0]}
                for k in range(_DEEP // 10)
            }
        ).encode()
    ),
}


def main():
    """Read every bomb as every kind of file, and print what that took."""
    taken = {}
    bombs = {name: make() for name, make in BOMBS.items()}
    for kind, reader in READERS.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / reader.name
            reader.write(path)
            reader.read(path)
            for name, data in bombs.items():
                path.write_bytes(data)
                before, begin = _peak(), time.process_time()
                try:
                    reader.read(path)
                    end = "read"
                except (ValueError, OSError) as error:
                    end = type(error).__name__
                spent = time.process_time() - begin
                taken[f"{kind}: {name}"] = [end, spent, _peak() - before]
    print(json.dumps(taken))


def _peak():
    """Largest size of this process so far [MiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
