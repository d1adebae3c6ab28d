"""Paths at which there is not what a command expects."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np


def _missing(folder: Path) -> Path:
    return folder / "thing"


def _folder(folder: Path) -> Path:
    (folder / "thing").mkdir()
    return folder / "thing"


def _empty(folder: Path) -> Path:
    (folder / "thing").touch()
    return folder / "thing"


def _binary(folder: Path) -> Path:
    (folder / "thing").write_bytes(np.random.default_rng(0).bytes(3000))
    return folder / "thing"


def _text(folder: Path) -> Path:
    (folder / "thing").write_text("no: [list\n")
    return folder / "thing"


def _archive(folder: Path) -> Path:
    (folder / "thing").write_bytes(b"PK\x03\x04" + np.random.default_rng(1).bytes(500))
    return folder / "thing"


def _below_a_file(folder: Path) -> Path:
    (folder / "thing").touch()
    return folder / "thing" / "below"


def _pipe(folder: Path) -> Path:
    os.mkfifo(folder / "thing")
    return folder / "thing"


PATHS: dict[str, Callable[[Path], Path]] = {
    "missing": _missing,
    "folder": _folder,
    "empty": _empty,
    "binary": _binary,
    "text": _text,
    "archive": _archive,
    "below a file": _below_a_file,
    "pipe": _pipe,
}
"""Each makes the path in a folder."""

NOT_A_FILE = tuple(PATHS)
NOT_A_FOLDER = ("empty", "binary", "below a file", "pipe")
