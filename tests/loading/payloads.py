"""Files that would run code in a reader that lets them, and good files with changed bytes."""

import bz2
import gzip
import io
import os
import pickle
import zipfile

import numpy as np
import torch


class _Runs:
    """Its pickle calls a function where it is loaded."""

    def __init__(self, mark):
        self._mark = mark

    def __reduce__(self):
        return os.system, (f"touch {self._mark}",)


def harmful(mark):
    """Contents; code in one of them that is run makes the file `mark`."""
    runs = _Runs(mark)
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        yield pickle.dumps(runs, protocol)
    plain = pickle.dumps(runs)
    yield gzip.compress(plain)
    yield bz2.compress(plain)
    objects = np.array([runs], dtype=object)
    for save in (np.save, np.savez, np.savez_compressed):
        buffer = io.BytesIO()
        save(buffer, objects)
        yield buffer.getvalue()
    for zipped in (True, False):
        buffer = io.BytesIO()
        torch.save({"weights": runs}, buffer, _use_new_zipfile_serialization=zipped)
        yield buffer.getvalue()
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for member in ("data", "data.pkl", "policy.pth", "timesteps.npy"):
            archive.writestr(member, plain)
    yield buffer.getvalue()
    call = f"__import__('os').system('touch {mark}')"
    yield b"\x93NUMPY\x01\x00" + len(call).to_bytes(2, "little") + call.encode()
    for tag in ("object/apply:os.system", "object/new:os.system", "name:os.system"):
        yield f"env_id: !!python/{tag} ['touch {mark}']\n".encode()
    yield f'{{"format": {{"__reduce__": "{call}"}}, "py/object": "os.system"}}'.encode()
    header = f'{{"__metadata__": {{"document": "{call}"}}}}'.encode()
    yield len(header).to_bytes(8, "little") + header
    yield f"#!/usr/bin/env python3\nimport os\n{call}\n".encode()


def changed(good, n, seed):
    """n versions of a file: bytes changed, cut off, put in, repeated."""
    rng = np.random.default_rng(seed)
    for k in range(n):
        data = bytearray(good)
        at = int(rng.integers(len(data)))
        if k % 4 == 0:
            data[at] ^= 1 << int(rng.integers(8))
        elif k % 4 == 1:
            del data[at:]
        elif k % 4 == 2:
            data[at:at] = rng.bytes(int(rng.integers(1, 30)))
        else:
            for where in rng.integers(len(data), size=8):
                data[where] = int(rng.integers(256))
        yield bytes(data)
