"""Runs recipes, each in an environment of its own, and reads what they measured.

An environment is made once, from a file of requirements, and kept in the user's cache folder. It
sees the packages of the environment that runs the tests, where their versions suit it; pip installs
the others.
"""

import fcntl
import hashlib
import importlib.metadata
import json
import os
import resource
import sys
import sysconfig
import tempfile
import time
import venv
from pathlib import Path

from tests import programs


def interpreter(requirements):
    """Python of an environment, which is made if it is not there.

    Args:
        requirements: a file as pip takes it; None for the environment of the tests.
    """
    if requirements is None:
        return Path(sys.executable)
    folder = cache() / f"{requirements.stem}-{_key(requirements)}"
    folder.mkdir(parents=True, exist_ok=True)
    complete = folder / "complete"
    with (folder / "lock").open("w") as lock:  # tests of two processes may want the same one
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not complete.exists():
            _make(folder / "venv", requirements)
            complete.touch()
    return _python(folder / "venv")


def cache():
    """The user's cache folder, for environments and sources of other programs."""
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(base).expanduser() / "rigid-envs" / "clients"


def _key(requirements):
    """Hash of all that an environment is made of."""
    found = {(d.name.lower(), d.version) for d in importlib.metadata.distributions()}
    parts = (requirements.read_text(), sys.version, sysconfig.get_path("purelib"), sorted(found))
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def _make(folder, requirements):
    venv.create(folder, clear=True, symlinks=True, with_pip=False)
    packages = next(folder.glob("lib/python*/site-packages"))
    (packages / "of_the_tests.pth").write_text(sysconfig.get_path("purelib") + "\n")
    pip = ("-m", "pip", "--python", _python(folder), "install", "--quiet")
    programs.printed(*pip, "--requirement", requirements)


def _python(folder):
    return folder / "bin" / "python"


ROOT = Path(__file__).parents[2]
_RECIPES = Path(__file__).parent / "recipes"
_REQUIREMENTS = Path(__file__).parent / "requirements"
_LIMIT = 600.0  # [s], where a recipe takes less than 60 on a machine of its own
_VERSIONS = "import importlib.metadata as m, sys; print(*map(m.version, sys.argv[1:]))"


def run(row):
    """Run a recipe, in a folder that is deleted afterwards.

    Args:
        row: the recipe.

    Returns:
        `version` of the program, `gymnasium`, `seconds` and `processor_seconds` that it took,
        and the `result` that it printed.

    Raises:
        AssertionError: it failed; the message is the end of what it printed.
    """
    python = interpreter(_REQUIREMENTS / f"{row.environment}.txt" if row.environment else None)
    asked = ("gymnasium",) if row.version else ("gymnasium", row.program)
    with tempfile.TemporaryDirectory() as folder:
        versions = _output([python, "-c", _VERSIONS, *asked], folder).split()
        begin, before = time.perf_counter(), _processor_seconds()
        lines = _output([python, _RECIPES / f"{row.recipe}.py"], folder).splitlines()
        seconds, spent = time.perf_counter() - begin, _processor_seconds() - before
    return {
        "version": row.version or versions[-1],
        "gymnasium": versions[0],
        "seconds": round(seconds, 1),
        "processor_seconds": round(spent, 1),
        "result": json.loads([line for line in lines if line.startswith("{")][-1]),
    }


def _output(command, folder):
    """What a command prints, with this checkout as the package that it imports."""
    done = programs.run(
        *command,
        cwd=folder,
        limit=_LIMIT,
        PYTHONPATH=str(ROOT),
        OMP_NUM_THREADS="1",  # tests run beside each other
        SDL_VIDEODRIVER="dummy",
    )
    assert done.returncode == 0, f"{command}\n{done.stdout[-2000:]}{done.stderr[-4000:]}"
    return done.stdout


def _processor_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
