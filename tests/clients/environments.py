"""Environments of their own for programs that need other versions than the tests.

Each is made once, from a file of requirements, and kept in the user's cache folder. It sees the
packages of the environment that runs the tests, where their versions suit it; pip installs the
others.
"""

import fcntl
import hashlib
import importlib.metadata
import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path


def interpreter(requirements: Path | None) -> Path:
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


def cache() -> Path:
    """The user's cache folder, for environments and sources of other programs."""
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(base).expanduser() / "rigid-envs" / "clients"


def _key(requirements: Path) -> str:
    """Hash of all that an environment is made of."""
    found = {(d.name.lower(), d.version) for d in importlib.metadata.distributions()}
    parts = (requirements.read_text(), sys.version, sysconfig.get_path("purelib"), sorted(found))
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def _make(folder: Path, requirements: Path) -> None:
    venv.create(folder, clear=True, symlinks=True, with_pip=False)
    packages = next(folder.glob("lib/python*/site-packages"))
    (packages / "of_the_tests.pth").write_text(sysconfig.get_path("purelib") + "\n")
    pip = [sys.executable, "-m", "pip", "--python", str(_python(folder)), "install", "--quiet"]
    done = subprocess.run(
        [*pip, "--requirement", str(requirements)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def _python(folder: Path) -> Path:
    return folder / "bin" / "python"
