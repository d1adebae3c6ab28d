"""Where a number comes from: versions, machine, commit, command."""

from __future__ import annotations

import functools
import importlib.metadata
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import torch

import rigid_envs

__all__ = ["differences", "manifest", "source"]

_PACKAGES = (
    "gymnasium",
    "numba",
    "numpy",
    "safetensors",
    "stable-baselines3",
    "torch",
)
_ROOT = Path(__file__).resolve().parent.parent


def manifest() -> dict[str, Any]:
    """What the bits of a training run depend on, beside its config.

    Returns:
        Versions, processor and threads, as JSON values.
    """
    return {
        "versions": {
            "python": platform.python_version(),
            "rigid-envs": rigid_envs.__version__,
            **_versions(),
        },
        "machine": platform.machine(),
        "system": platform.system(),
        "cpu_capability": torch.backends.cpu.get_cpu_capability(),
        "torch_threads": torch.get_num_threads(),
    }


def differences(before: dict[str, Any], now: dict[str, Any]) -> list[str]:
    """The entries in which two manifests differ.

    Args:
        before: One manifest.
        now: The other.

    Returns:
        A line "key: before -> now" for each.
    """
    lines = []
    for key in sorted(before.keys() | now.keys()):
        old, new = before.get(key), now.get(key)
        if isinstance(old, dict) and isinstance(new, dict):
            lines += [f"{key}.{line}" for line in differences(old, new)]
        elif old != new:
            lines.append(f"{key}: {old} -> {new}")
    return lines


def source() -> dict[str, Any]:
    """The commit that this checkout is at, and the command that was given.

    Returns:
        `git_commit` (None outside a repository), `git_dirty`, `command`.
    """
    status = _git("status", "--porcelain", "--untracked-files=no")
    return {
        "git_commit": _git("rev-parse", "HEAD"),
        "git_dirty": None if status is None else status != "",
        "command": " ".join([Path(sys.executable).name, "-m", "agents", *sys.argv[1:]]),
    }


@functools.cache
def _versions() -> dict[str, str]:
    return {package: importlib.metadata.version(package) for package in _PACKAGES}


def _git(*arguments: str) -> str | None:
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
