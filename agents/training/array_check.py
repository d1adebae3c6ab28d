"""Check of the arrays of a checkpoint, before anything is restored from them.

A checksum tells that a file is as it was written, not that what was written is good. Types and
shapes must be those of a fresh model of the same config. What follows from the age of a run, as the
place in its replay buffer, must be just that; all else must be finite and in its range.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fnmatch import fnmatch
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Discrete
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm

from rigid_envs.checks import require

from .algorithms import algorithm_of

__all__ = ["check_arrays"]

Arrays = Mapping[str, NDArray[Any]]
_LAST, _ORIGINAL = "_last_obs", "_last_original_obs"
_WHOLE = ("/step", "/dones", "/timeouts")
_OF_FIXED_SHAPE = ("memory/place", "memory/current_start")


class _Part(NamedTuple):
    dtype: np.dtype[Any]
    shape: tuple[int, ...]


def check_arrays(
    found: Arrays,
    fresh: Arrays,
    model: BaseAlgorithm,
    counters: Mapping[str, Any],
    evaluations: Sequence[int],
) -> None:
    """Refuse arrays that a run cannot have written.

    Args:
        found: Arrays of the checkpoint.
        fresh: Those of a checkpoint of a run that has not begun.
        model: Its model, set up to learn.
        counters: Those of the checkpoint, checked.
        evaluations: Ages at which the run has been evaluated [steps].

    Raises:
        ValueError: "member = value; expected ...".
    """
    steps, capacity = counters["num_timesteps"] // model.n_envs, _capacity(model)
    parts = {name: _Part(array.dtype, array.shape) for name, array in fresh.items()}
    if counters["_n_updates"]:
        parts |= _moments(model)
    if any(name.startswith(_ORIGINAL) for name in found):  # there from the first step on
        parts |= {k.replace(_LAST, _ORIGINAL): v for k, v in parts.items() if k.startswith(_LAST)}
    rows = {"memory/": min(steps, capacity), "validation/": len(evaluations)}
    for name, array in found.items():
        if name.startswith("window/"):
            rows[name] = min(len(array) if array.ndim else 0, model._stats_window_size)
    _check_parts(found, {name: _with_rows(name, part, rows) for name, part in parts.items()})
    _check_values(found, fresh, _ranges(model, capacity))
    exact: dict[str, Any] = {"adapter/steps": steps, "validation/timesteps": evaluations}
    if capacity:
        exact["memory/place"] = [steps % capacity, int(steps >= capacity)]
    for name, expected in exact.items():
        value = found[name]
        require(np.array_equal(value, expected), value, name, f"{expected}, from the age")
    lengths, returns = len(found["window/lengths"]), len(found["window/returns"])
    require(lengths == returns, lengths, "len(window/lengths)", f"{returns}, as of the returns")


def _with_rows(name: str, part: _Part, rows: Mapping[str, int]) -> _Part:
    """A part with its number of rows, if that is not always the same."""
    for prefix, n in rows.items():
        if name.startswith(prefix) and name not in _OF_FIXED_SHAPE:
            return _Part(part.dtype, (n, *part.shape[1:]))
    return part


def _moments(model: BaseAlgorithm) -> dict[str, _Part]:
    """Parts of the state of Adam, which there is from the first update on."""
    parts = {}
    for name, optimizer in algorithm_of(model).parts(model).optimizers.items():
        weights = [weight for group in optimizer.param_groups for weight in group["params"]]
        for k, weight in enumerate(weights):
            if weight.requires_grad:
                shapes = {"step": (), "exp_avg": weight.shape, "exp_avg_sq": weight.shape}
                for key, shape in shapes.items():
                    place = f"optimizer/{name}/{k}/{key}"
                    parts[place] = _Part(np.dtype(np.float32), tuple(shape))
    return parts


def _check_parts(found: Arrays, parts: Mapping[str, _Part]) -> None:
    for name in sorted(found.keys() ^ parts.keys()):
        if name in found:
            raise ValueError(f"{name} is there; expected no such array")
        part = parts[name]
        raise ValueError(f"{name} is missing; expected {part.dtype} of shape {part.shape}")
    for name, part in parts.items():
        array = found[name]
        if (array.dtype, array.shape) != part:
            raise ValueError(
                f"{name} is {array.dtype} of shape {array.shape}; "
                f"expected {part.dtype} of shape {part.shape}"
            )


def _capacity(model: BaseAlgorithm) -> int:
    """Steps of each row in a full replay buffer; 0 without one."""
    buffer = getattr(model, "replay_buffer", None)
    return 0 if buffer is None else int(buffer.buffer_size)


def _ranges(model: BaseAlgorithm, capacity: int) -> dict[str, tuple[float, float]]:
    """Smallest and largest values that make sense."""
    ranges = {
        "adapter/lengths": (0, math.inf),
        "memory/current_start": (0, capacity - 1),
        "memory/dones": (0, 1),
        "memory/ep_length": (0, capacity),
        "memory/ep_start": (0, capacity - 1),
        "memory/timeouts": (0, 1),
        "normalize/*.count": (float(np.finfo(float).tiny), math.inf),
        "normalize/*.var": (0, math.inf),
        "optimizer/*/exp_avg_sq": (0, math.inf),
        "optimizer/*/step": (1, math.inf),
        "validation/ep_lengths": (1, math.inf),
        "window/lengths": (1, math.inf),
    }
    if isinstance(model.action_space, Discrete):
        ranges["memory/actions"] = (0, int(model.action_space.n) - 1)
    return ranges


def _check_values(found: Arrays, fresh: Arrays, ranges: Mapping[str, tuple[float, float]]) -> None:
    for name, array in found.items():
        if array.dtype == bool:
            require(array.view(np.uint8) <= 1, array.view(np.uint8), name, "0 or 1")
        elif np.isfinite(fresh.get(name, 0)).all():  # an environment may begin with an infinity
            require(np.isfinite(array), array, name, "finite numbers")
        if name.endswith(_WHOLE):
            require(array == np.floor(array), array, name, "a whole number")
        for low, high in (ends for pattern, ends in ranges.items() if fnmatch(name, pattern)):
            within = (array >= low) & (array <= high)
            require(within, array, name, f"numbers in [{low:g}, {high:g}]")
