"""Checks of the arrays of a replay: names, kinds, shapes and what they must agree with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.core import Core
from rigid_envs.replays.episode import ARRAYS, Episode
from rigid_envs.tasks import Task

__all__ = ["episodes_from", "row_names"]

Arrays = Mapping[str, npt.NDArray[Any]]

_FLAGS = ("terminated", "truncated")


def row_names(task: Task) -> dict[str, list[str]]:
    """Names of the entries of every row of a task, in their order."""
    system = task.system_type
    return {
        "y": list(system.state_entries),
        "u": list(system.input_entries),
        "actions": list(task.episode.Action._fields),
        "aux": list(task.aux_names),
        "parameters": list(system.parameter_names()),
    }


def episodes_from(task: Task, entries: Sequence[Any], arrays: Arrays) -> tuple[Episode, ...]:
    """The episodes of a file.

    Args:
        task: The task.
        entries: What the header says of each.
        arrays: All arrays of the file but the header.

    Raises:
        ValueError: An entry or array that is missing, unknown, or not what it must be.
    """
    parts = Core(task, 1).get_state()
    names = [*ARRAYS, "parameters", *(f"start/{part}" for part in parts)]
    expected = {f"{k}/{name}" for k in range(len(entries)) for name in names}
    if missing := sorted(expected - set(arrays)):
        raise ValueError(f"no array {missing[0]!r}; expected one for each of {names}")
    if unknown := sorted(set(arrays) - expected):
        raise ValueError(f"array {unknown[0]!r}; expected some of {names} of each episode")
    return tuple(_episode(task, k, entry, arrays, parts) for k, entry in enumerate(entries))


def _episode(task: Task, k: int, entry: Any, arrays: Arrays, parts: Arrays) -> Episode:
    place = f"episodes[{k}]"
    if not isinstance(entry, dict) or set(entry) != {"label", *_FLAGS}:
        raise ValueError(f"{place} = {entry!r:.100}; expected label, terminated and truncated")
    label, ends = entry["label"], {name: entry[name] for name in _FLAGS}
    if any(not isinstance(flag, bool) for flag in ends.values()):
        raise ValueError(f"{place} = {entry!r:.100}; expected true or false for {_FLAGS}")
    found: dict[str, Any] = {name: arrays[f"{k}/{name}"] for name in (*ARRAYS, "parameters")}
    n_steps = len(found["rewards"]) if found["rewards"].ndim else 0
    for name, (dtype, shape) in _kinds(task, n_steps).items():
        _check(f"{k}/{name}", found[name], dtype, shape)
    start = {name: arrays[f"{k}/start/{name}"] for name in parts}
    for name, part in parts.items():
        _check(f"{k}/start/{name}", start[name], np.float64, part.shape[1:])
    _check_content(task, k, found, start)
    values = found.pop("parameters").tolist()
    parameters = dict(zip(task.system_type.parameter_names(), values, strict=True))
    return Episode(label=label, start=start, parameters=parameters, **found, **ends)


def _kinds(task: Task, n: int) -> dict[str, tuple[Any, tuple[int, ...]]]:
    """Kind of number and shape of every array of an episode of n steps."""
    size = {name: len(entries) for name, entries in row_names(task).items()}
    return {
        "rewards": (np.float64, (n,)),
        "y": (np.float64, (n + 1, size["y"])),
        "u": (np.float64, (n, size["u"])),
        "actions": (np.float32, (n, size["actions"])),
        "applied": (np.float64, (n, size["actions"])),
        "costs": (np.float64, (n,)),
        "success": (np.bool_, (n,)),
        "times": (np.float64, (n + 1,)),
        "aux": (np.float64, (n + 1, size["aux"])),
        "parameters": (np.float64, (size["parameters"],)),
    }


def _check(name: str, array: npt.NDArray[Any], dtype: Any, shape: tuple[int, ...]) -> None:
    """Refuse another kind of number, another shape, NaN and inf."""
    if array.dtype != dtype:
        raise ValueError(f"{name} has dtype {array.dtype}; expected {np.dtype(dtype)}")
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}; expected {shape}")
    if not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0].tolist()
        raise ValueError(f"{name}{where} = {array[tuple(where)]}; expected finite numbers")


def _check_content(task: Task, k: int, found: Arrays, start: Arrays) -> None:
    """Refuse states that the system cannot have, and parts that contradict each other."""
    names = task.system_type.parameter_names()
    task.system_type(**dict(zip(names, found["parameters"].tolist(), strict=True)))
    try:
        task.system_type.checked_state(found["y"])
    except ValueError as error:
        raise ValueError(f"{k}/{error}") from None
    if not np.array_equal(found["y"][0], start["y"]):
        raise ValueError(f"{k}/y[0] = {found['y'][0].tolist()}; expected start/y")
    if not np.all(np.diff(found["times"]) > 0.0):
        raise ValueError(f"{k}/times do not increase; expected multiples of {task.dt} s")
