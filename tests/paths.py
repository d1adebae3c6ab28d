"""Paths at which there is not what a command expects."""

import os
from pathlib import Path

import numpy as np


def _of(make, below=""):
    """Makes a thing in a folder, and gives its path, or one below it."""

    def made(folder):
        make(folder / "thing")
        return folder / "thing" / below

    return made


def _random(seed, size, head=b""):
    return lambda path: path.write_bytes(head + np.random.default_rng(seed).bytes(size))


PATHS = {
    "missing": _of(lambda path: None),
    "folder": _of(Path.mkdir),
    "empty": _of(Path.touch),
    "binary": _of(_random(0, 3000)),
    "text": _of(lambda path: path.write_text("no: [list\n")),
    "archive": _of(_random(1, 500, b"PK\x03\x04")),
    "below a file": _of(Path.touch, "below"),
    "pipe": _of(os.mkfifo),
}
"""Each makes the path in a folder."""

NOT_A_FILE = tuple(PATHS)
NOT_A_FOLDER = ("empty", "binary", "below a file", "pipe")
