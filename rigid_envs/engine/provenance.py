"""Provenance of figures: versions, compiled code, machine, commit, date."""

import functools
import importlib.metadata
import os
import platform
import subprocess
import textwrap
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rigid_envs.engine.compiler import kernel_hash

KINDS = {
    **{"versions": {"rigid-envs": str}, "kernel_hash": str, "cpu": str, "cores": int | None},
    **{"system": str, "load": float | None, "git_commit": str | None},
    **{"git_dirty": bool | None, "date": str},
}
"""Types of the entries of a `provenance`."""

_PACKAGES = ("gymnasium", "numba", "numpy", "scipy", "mujoco")
_ROOT = Path(__file__).resolve().parents[2]
_WIDTH = 100


def provenance() -> dict[str, Any]:
    """Versions, hash of the kernels, processor, load, commit and date, as JSON values."""
    return {
        "versions": versions(_PACKAGES),
        "kernel_hash": kernel_hash(),
        "cpu": cpu_name(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        **commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def versions(packages: Iterable[str]) -> dict[str, str]:
    """Versions of this library, of Python and of installed packages.

    Args:
        packages: Distribution names; one that is not installed is left out.
    """
    found = {name: version for name in packages if (version := _version(name))}
    library = importlib.import_module("rigid_envs").__version__
    return {"rigid-envs": library, "python": platform.python_version(), **found}


def commit() -> dict[str, Any]:
    """Commit of the checkout that the package lies in, as JSON values.

    Git is asked once in a process: what is committed later is not the code that runs.

    Returns:
        `git_commit`, and `git_dirty`: whether tracked files are changed. Both None outside a
        checkout.
    """
    head, status = _head_and_status()
    return {"git_commit": head, "git_dirty": None if status is None else status != ""}


@functools.cache
def _head_and_status() -> tuple[str | None, str | None]:
    return _git("rev-parse", "HEAD"), _git("status", "--porcelain", "--untracked-files=no")


def heading(where: Mapping[str, Any]) -> str:
    """A provenance as a heading of a report, in two lines or so."""
    installed = ", ".join(f"{name} {version}" for name, version in where["versions"].items())
    machine = [f"{where['cpu']}, {where['cores']} cores"]
    if where["load"] is not None:
        machine.append(f"load before {where['load']:.1f}")
    if where["git_commit"] is not None:
        changed = " and changes" if where["git_dirty"] else ""
        machine.append(f"commit {where['git_commit'][:9]}{changed}")
    machine += [f"kernels {where['kernel_hash']}", where["date"]]
    return "\n".join(textwrap.fill(line, _WIDTH) for line in (installed, "; ".join(machine)))


@functools.cache
def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def cpu_name() -> str:
    """Name of the processor, as it calls itself."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor())


def _git(*arguments: str) -> str | None:
    """Answer of git about the checkout that the package lies in; None if it lies in none."""
    if not (_ROOT / ".git").exists():
        return None
    try:
        answer = subprocess.run(
            ["git", "-C", str(_ROOT), *arguments],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
            env={**os.environ, "GIT_OPTIONAL_LOCKS": "0"},
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip()
