"""Arguments of the environments: task and settings, actions, options of a reset."""

import importlib
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode

from rigid_envs.checks import as_array, one_of, require, safe_repr
from rigid_envs.settings import from_config, refusal
from rigid_envs.tasks import Task

__all__ = [
    "FLOAT32",
    "INTEGERS",
    "actions_of",
    "autoreset_of",
    "check_counts",
    "new_task",
    "options_of",
    "row_of",
    "rows_of",
    "shown_rows",
]

FLOAT32 = np.dtype(np.float32)
INTEGERS = (int, np.int64)
_MOST = 2**53


def new_task(task: str, config: Mapping[str, Any]) -> Task:
    """Make the task "module:Class" with the given configuration.

    Raises:
        UnknownKeywordError: unknown key; suggests the most similar one.
        ConfigError: wrong value; names the key and the allowed values.
    """
    try:
        module, name = task.split(":")
        kind = getattr(importlib.import_module(module), name)
    except (AttributeError, ImportError, TypeError, ValueError):
        kind = None
    if not (isinstance(kind, type) and issubclass(kind, Task)):
        raise refusal("task", task, "'module:Class' of a rigid_envs.tasks.Task")
    made: Task = from_config(kind, config)
    return made


def check_counts(num_envs: Any, num_threads: Any, max_episode_steps: Any) -> None:
    """Check the numbers of rows, threads and steps.

    Raises:
        ConfigError: one is not an integer from 1; `max_episode_steps` may be None.
    """
    counts = {"num_envs": num_envs, "num_threads": num_threads}
    if max_episode_steps is not None:
        counts["max_episode_steps"] = max_episode_steps
    for name, value in counts.items():
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not (whole and 1 <= value <= _MOST):
            raise refusal(name, value, f"an integer from 1 to {_MOST}")


def autoreset_of(mode: Any) -> AutoresetMode:
    """A mode of Gymnasium by itself or by its value.

    Raises:
        ConfigError: no such mode.
    """
    try:
        return AutoresetMode(mode)
    except Exception:  # also of an object that cannot be compared or shown
        modes = [known.value for known in AutoresetMode]
        raise refusal("autoreset_mode", mode, f"one of {modes}") from None


def actions_of(
    task: Task, value: Any, lead: tuple[int, ...], env_id: str
) -> npt.NDArray[np.float32]:
    """Check an action and convert it to float32, shape (*lead, n_action).

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
    array = as_array(value)
    if array.dtype.kind not in "fiu":
        raise ValueError(
            f"{env_id}: {name} = {safe_repr(value)}; "
            f"expected real numbers in [-1, 1] in shape {shape}"
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
    array = as_array(value)
    if array.dtype.kind not in "iu":
        raise ValueError(f"{env_id}: {name} = {safe_repr(value)}; {expected}")
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
    """Check the keys of the options of a reset.

    Raises:
        ValueError: names the key and the known ones.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise ValueError(f"{env_id}: options = {safe_repr(options)}; expected a dict or None")
    for key in options:
        one_of(key, known, f"{env_id}: key of options")
    return options


def row_of(row: Any, num_envs: int, env_id: str) -> int:
    """Index of a row.

    Raises:
        ValueError: no integer from 0 to num_envs - 1.
    """
    whole = isinstance(row, int | np.integer) and not isinstance(row, bool)
    known = f"an integer from 0 to {num_envs - 1}"
    require(whole and 0 <= row < num_envs, row, f"{env_id}: row", known)
    return int(row)


def rows_of(mask: Any, num_envs: int, env_id: str) -> npt.NDArray[np.int64]:
    """Indices of the rows that a reset mask selects; of all rows for None.

    Raises:
        ValueError: no bool array of shape (num_envs,), or no row is selected.
    """
    if mask is None:
        return np.arange(num_envs)
    if not (isinstance(mask, np.ndarray) and mask.dtype == bool and mask.shape == (num_envs,)):
        raise ValueError(
            f"{env_id}: options['reset_mask'] = {safe_repr(mask)}; "
            f"expected a bool array of shape ({num_envs},)"
        )
    if not mask.any():
        raise ValueError(
            f"{env_id}: options['reset_mask'] = False everywhere; expected a row to reset"
        )
    return np.flatnonzero(mask)


def shown_rows(rows: Any, num_envs: int) -> tuple[int, ...]:
    """Indices of the rows of which pictures are made; of all rows for None.

    Raises:
        ConfigError: not some indices from 0 to num_envs - 1.
    """
    if rows is None:
        return tuple(range(num_envs))
    given = as_array(rows)
    inside = given.dtype.kind in "iu" and ((given >= 0) & (given < num_envs)).all()
    if given.ndim != 1 or not given.size or not inside:
        raise refusal(
            "render_rows", rows, f"None or a sequence of indices from 0 to {num_envs - 1}"
        )
    return tuple(given.tolist())
