"""Python in processes of their own."""

import os
import subprocess
import sys


def python(*words, cwd=None, **environment):
    """Run Python with these words, in a folder, with variables of its own."""
    command, given = [sys.executable, *map(str, words)], os.environ | environment
    return subprocess.run(command, cwd=cwd, env=given, capture_output=True, text=True, check=False)


def printed(*words, cwd=None, **environment):
    """What Python prints with these words; fails with what went wrong."""
    done = python(*words, cwd=cwd, **environment)
    assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]
    return done.stdout
