"""Spaces of a task, and the keys of its infos."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from rigid_envs.kernels.layout import FLAGS
from rigid_envs.tasks import Entry, Task

__all__ = [
    "action_space",
    "goal_parts",
    "info_flags",
    "info_keys",
    "info_numbers",
    "observation_space",
]


def action_space(task: Task) -> spaces.Space[Any]:
    """Box(-1, 1) with one entry for each action entry; Discrete for discrete actions."""
    if task.n_choices:
        return spaces.Discrete(task.n_choices)
    return spaces.Box(-1.0, 1.0, (len(task.episode.prototypes.action),), np.float32)


def observation_space(task: Task) -> spaces.Space[Any]:
    """Box with the bounds of the task's observation entries; a Dict of boxes for a goal task."""
    entries, n = task.observations(), task.n_goal
    if not n:
        return _box(entries)
    parts = {
        "observation": entries[2 * n :],
        "achieved_goal": entries[:n],
        "desired_goal": entries[n : 2 * n],
    }
    return spaces.Dict({name: _box(part) for name, part in parts.items()})


def goal_parts(flat: npt.NDArray[np.float32], n_goal: int) -> dict[str, npt.NDArray[np.float32]]:
    """Views of the parts of a flat observation (..., 2 n_goal + n) of a goal task."""
    return {
        "observation": flat[..., 2 * n_goal :],
        "achieved_goal": flat[..., :n_goal],
        "desired_goal": flat[..., n_goal : 2 * n_goal],
    }


def _box(entries: Sequence[Entry]) -> spaces.Box:
    low = np.array([entry.low for entry in entries], dtype=np.float32)
    high = np.array([entry.high for entry in entries], dtype=np.float32)
    return spaces.Box(low, high, dtype=np.float32)


def info_keys(task: Task) -> tuple[str, ...]:
    """Keys of every info: numbers, then flags."""
    return (*info_numbers(task), *info_flags(task))


def info_numbers(task: Task) -> tuple[str, ...]:
    """Cost, unweighted reward terms, and what a contact with the ground bears."""
    return ("cost", *(f"reward/{term}" for term in task.terms), *task.episode.ground.names)


def info_flags(task: Task) -> tuple[str, ...]:
    """Flags of every info, in the order of those of a row after its two ends."""
    return FLAGS._fields[2:] if task.episode.ground.names else FLAGS._fields[2:-1]
