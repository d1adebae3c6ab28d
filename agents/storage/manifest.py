"""The machine and the versions that the bits of a training run depend on."""

from __future__ import annotations

import platform
from typing import Any

import torch

from rigid_envs.provenance import versions

__all__ = ["differences", "manifest"]

_PACKAGES = ("gymnasium", "numba", "numpy", "stable-baselines3", "torch")


def manifest() -> dict[str, Any]:
    """Versions and machine that the bits of a training run depend on, besides its config.

    Returns:
        Versions, processor and threads, as JSON values.
    """
    return {
        "versions": versions(_PACKAGES),
        "machine": platform.machine(),
        "system": platform.system(),
        "cpu_capability": torch.backends.cpu.get_cpu_capability(),
        "torch_threads": torch.get_num_threads(),
    }


def differences(before: dict[str, Any], now: dict[str, Any]) -> list[str]:
    """The entries in which two manifests differ.

    Args:
        before: Older manifest.
        now: Newer manifest.

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
