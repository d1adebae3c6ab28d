"""What the two shells share: spaces, action checks, options and random streams."""

import importlib
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.utils import seeding

from rigid_envs.errors import ConfigError, UnknownKeywordError
from rigid_envs.tasks import Entry, Task
from rigid_envs.tasks.fields import from_config

__all__ = [
    "INFO_FLAGS",
    "INTEGERS",
    "action_space",
    "actions_of",
    "goal_parts",
    "info_keys",
    "new_task",
    "observation_space",
    "options_of",
    "python_seed",
    "seeded_key",
    "stream_key",
]

FLOAT32 = np.dtype(np.float32)
INTEGERS = (int, np.int64)
INFO_FLAGS = ("is_success", "action_clipped", "physics_error")


def new_task(task: str, render_mode: str | None, config: Mapping[str, Any]) -> Task:
    """The task named "module:Class" with this configuration.

    Raises:
        UnknownKeywordError: names the key and the nearest known one.
        ConfigError: names the key and what is allowed.
    """
    if render_mode is not None:
        raise UnknownKeywordError(
            f"config.render_mode: {render_mode!r} is not allowed; expected None"
        )
    module, name = task.split(":")
    made = from_config(getattr(importlib.import_module(module), name), config)
    if not isinstance(made, Task):
        raise ConfigError(f"config.task: {task!r} is not a task")
    return made


def action_space(task: Task) -> spaces.Space[Any]:
    """Box(-1, 1), one entry for each of the task's actions; Discrete where they are choices."""
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
    """A flat observation (..., 2 n_goal + n) of a goal task by its parts, each a view."""
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
    """Keys of every info: cost, unweighted reward terms, flags."""
    return ("cost", *(f"reward/{term}" for term in task.terms), *INFO_FLAGS)


def actions_of(
    task: Task, value: Any, lead: tuple[int, ...], env_id: str
) -> npt.NDArray[np.float32]:
    """`value` as finite float32 of shape (*lead, n_action); a choice as its number.

    Raises:
        ValueError: names the environment, the entry, its value and what was expected.
    """
    entry = () if task.n_choices else (len(task.episode.prototypes.action),)
    read: Any = partial(_choice, task.n_choices) if task.n_choices else _action
    if lead and isinstance(value, list | tuple) and len(value) == lead[0]:
        rows = [read(row, entry, env_id, f"action[{k}]") for k, row in enumerate(value)]
        array = np.stack(rows)
    else:
        array = read(value, (*lead, *entry), env_id, "action")
    return array.reshape(*lead, -1)


def _action(value: Any, shape: tuple[int, ...], env_id: str, name: str) -> npt.NDArray[np.float32]:
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.asarray(None)
    if array.dtype.kind not in "fiu":
        raise ValueError(
            f"{env_id}: {name} = {value!r} is not an array of real numbers; "
            f"expected shape {shape}, entries in [-1, 1]"
        )
    if array.shape != shape:
        raise ValueError(f"{env_id}: {name} has shape {array.shape}; expected {shape}")
    with np.errstate(over="ignore"):
        single = array.astype(np.float32)
    if not np.isfinite(single).all():
        index = tuple(int(k) for k in np.argwhere(~np.isfinite(single))[0])
        raise ValueError(
            f"{env_id}: {name}{list(index)} = {array[index]}; expected a finite number in [-1, 1]"
        )
    return single


def _choice(
    n: int, value: Any, shape: tuple[int, ...], env_id: str, name: str
) -> npt.NDArray[np.float32]:
    expected = f"expected an integer from 0 to {n - 1}" + (f" in shape {shape}" if shape else "")
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.asarray(None)
    if array.dtype.kind not in "iu":
        raise ValueError(f"{env_id}: {name} = {value!r}; {expected}")
    if array.shape != shape:
        raise ValueError(f"{env_id}: {name} has shape {array.shape}; {expected}")
    outside = (array < 0) | (array >= n)
    if np.any(outside):
        index = tuple(int(k) for k in np.argwhere(outside)[0])
        place = f"{name}{list(index)}" if index else name
        raise ValueError(f"{env_id}: {place} = {array[index]}; {expected}")
    return array.astype(np.float32)


def options_of(
    options: Mapping[str, Any] | None, known: tuple[str, ...], env_id: str
) -> Mapping[str, Any]:
    """Options of a reset, unknown keys refused.

    Raises:
        ValueError: names the key and the known ones.
    """
    for key in options or {}:
        if key not in known:
            raise ValueError(f"{env_id}: options[{key!r}] is unknown; expected some of {known}")
    return options or {}


def stream_key(generator: np.random.Generator) -> np.uint64:
    """Key of the random stream of one row, drawn from its generator."""
    return np.uint64(generator.integers(0, 2**64, dtype=np.uint64))


def seeded_key(seed: int) -> np.uint64:
    """Key of a row with this seed: the same for a single environment and for a row of many."""
    return stream_key(seeding.np_random(python_seed(seed))[0])


def python_seed(seed: Any) -> Any:
    """An integer of NumPy as one of Python; Gymnasium refuses what is neither."""
    return int(seed) if isinstance(seed, np.integer) else seed
