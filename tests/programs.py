"""Python in processes of their own."""

import os
import subprocess
import sys
from pathlib import Path


def python(
    *words: str | Path, cwd: Path | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run Python with these words, in a folder, with variables of its own."""
    command, given = [sys.executable, *map(str, words)], os.environ | environment
    return subprocess.run(command, cwd=cwd, env=given, capture_output=True, text=True, check=False)


def printed(*words: str | Path, cwd: Path | None = None, **environment: str) -> str:
    """What Python prints with these words; fails with what went wrong."""
    done = python(*words, cwd=cwd, **environment)
    assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]
    return done.stdout
