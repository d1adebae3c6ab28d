"""A Python process that runs a copy of the project, with a limit of time."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

__all__ = ["run_copy"]


def run_copy(
    folder: Path, words: Sequence[str], limit: float, **settings: str
) -> subprocess.CompletedProcess[str] | None:
    """The finished process ``python WORDS`` in a copy of the project; None if time was up.

    Args:
        folder: The copy.
        words: Arguments of Python.
        limit: Time that it may take [s].
        **settings: Variables of its environment.
    """
    environment = {
        **os.environ,
        "PYTHONPATH": str(folder),
        "PYTHONDONTWRITEBYTECODE": "1",  # a change can have the size and the second of another
        **settings,
    }
    try:
        return subprocess.run(
            [sys.executable, *words],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=limit,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None
