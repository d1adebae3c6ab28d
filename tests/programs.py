"""Python in processes of their own."""

import os
import subprocess
import sys


def run(*words, cwd=None, limit=None, **environment):
    """Run a program, for so many seconds at most, in a folder, with variables of its own."""
    return subprocess.run(
        [*map(str, words)],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=limit,
        check=False,
    )


def python(*words, **settings):
    """Run Python with these words, and settings of `run`."""
    return run(sys.executable, *words, **settings)


def printed(*words, **settings):
    """What Python prints with these words; fails with what went wrong."""
    done = python(*words, **settings)
    assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]
    return done.stdout
