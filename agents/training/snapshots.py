"""Snapshots, from which a training goes on to the bit."""

import math
import random
from collections import deque
from collections.abc import Mapping, Sequence
from fnmatch import fnmatch
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Discrete
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize
from torch.optim import Optimizer

from rigid_envs.base.checks import require

from ..config.entries import Config
from ..storage.logs import Arrays, flat, under
from .algorithms import counters_of, parts_of
from .rows import TrainingRows

# The random streams of a training: captured, checked and restored.
#
# They are the global ones of Python, NumPy and torch (SB3 permutes batches with NumPy's and
# explores with torch's), and that of the first, random actions and of DQN's exploration.


def capture_random(actions: np.random.BitGenerator) -> tuple[Arrays, dict[str, Any]]:
    """States of all streams.

    Args:
        actions: Stream of the actions.

    Returns:
        Arrays and JSON values that `restore_random` takes.
    """
    version, words, next_gauss = random.getstate()
    kind, key, *numpy = np.random.get_state()  # noqa: NPY002
    arrays = {
        "python": np.array(words, dtype=np.uint64),
        "numpy": np.asarray(key),
        "torch": torch.get_rng_state().numpy(),
    }
    document = {
        "python": [version, next_gauss],
        "numpy": [kind, *numpy],
        "actions": actions.state,
    }
    return arrays, document


def restore_random(
    actions: np.random.BitGenerator, arrays: Arrays, document: Mapping[str, Any]
) -> None:
    """Bring all streams to captured states.

    Args:
        actions: Stream of the actions.
        arrays: From `capture_random`.
        document: From `capture_random`.
    """
    version, next_gauss = document["python"]
    random.setstate((version, tuple(arrays["python"].tolist()), next_gauss))
    kind, *numpy = document["numpy"]
    np.random.set_state((kind, arrays["numpy"], *numpy))  # noqa: NPY002
    torch.set_rng_state(torch.tensor(arrays["torch"]))
    actions.state = document["actions"]


def check_random(actions: np.random.BitGenerator, arrays: Arrays, document: Any) -> None:
    """Refuse states that the streams do not take, or do not give back; they stay as they are.

    Args:
        actions: Stream of the actions.
        arrays: From `capture_random`.
        document: From `capture_random`.

    Raises:
        ValueError: "member = value; expected ...".
    """
    before = capture_random(actions)
    try:
        restore_random(actions, arrays, document)
        back, told = capture_random(actions)
        same = told == document and all(np.array_equal(back[k], arrays[k]) for k in back)
        why = "other states"
    except (ValueError, TypeError, OverflowError, LookupError, RuntimeError) as error:
        same, why = False, f"{error}"
    finally:
        restore_random(actions, *before)
    require(same, why.splitlines()[:1], "random", "states of the random streams")
    position, has_gauss = document["numpy"][1:3]  # which NumPy does not check
    fits = 0 <= position <= len(arrays["numpy"]) and has_gauss in (0, 1)
    expected = "a position in [0, 624], and whether a number is kept"
    require(fits, document["numpy"], "random.numpy", expected)


# Replay buffers as arrays, and back, to the bit.

# The last two are those of HER: start and length of the episode of each step.
_TABLES = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts",
           "ep_start", "ep_length")  # fmt: skip


def buffer_arrays(buffer: ReplayBuffer) -> Arrays:
    """Content of a replay buffer; of one that is not full, the part that is filled."""
    arrays = {name: table[: buffer.size()] for name, table in _tables(buffer).items()}
    arrays["place"] = np.array([buffer.pos, buffer.full], dtype=np.int64)
    if hasattr(buffer, "_current_ep_start"):
        arrays["current_start"] = buffer._current_ep_start
    return arrays


def restore_buffer(buffer: ReplayBuffer, arrays: Arrays) -> None:
    """Fill an empty replay buffer of the same size with the arrays of `buffer_arrays`."""
    position, full = arrays["place"].tolist()
    buffer.pos, buffer.full = position, bool(full)
    for name, table in _tables(buffer).items():
        table[: buffer.size()] = arrays[name]
    if hasattr(buffer, "_current_ep_start"):
        buffer._current_ep_start = arrays["current_start"]


def _tables(buffer: ReplayBuffer) -> Arrays:
    """Arrays of a buffer by name, one row per step; each part of a dictionary by itself."""
    return flat({name: getattr(buffer, name, None) for name in _TABLES})


# Check of the arrays of a checkpoint, before anything is restored from them.
#
# A checksum tells that a file is as it was written, not that what was written is good. Types and
# shapes must be those of a fresh model of the same config. What follows from the age of a run, as
# the place in its replay buffer, must be just that; all else must be finite and in its range.

_LAST, _ORIGINAL = "_last_obs", "_last_original_obs"
_WHOLE = ("/step", "/dones", "/timeouts")
_OF_FIXED_SHAPE = ("memory/place", "memory/current_start")


_Part = tuple[np.dtype[Any], tuple[int, ...]]
"""Type and shape of an array."""


def check(
    model: BaseAlgorithm,
    fresh: Arrays,
    found: Arrays,
    document: Mapping[str, Any],
    evaluations: Sequence[int],
) -> None:
    """Refuse what `restore` could not, or should not, bring a model to.

    Args:
        model: A model of the same config, set up to learn.
        fresh: Arrays of a checkpoint of it as it is.
        found: Arrays of a checkpoint.
        document: Its document, checked.
        evaluations: Ages at which the run has been evaluated [steps].

    Raises:
        ValueError: "member = value; expected ...".
    """
    counters, buffer = document["counters"], getattr(model, "replay_buffer", None)
    capacity = 0 if buffer is None else int(buffer.buffer_size)  # steps of each row
    steps = counters["num_timesteps"] // model.n_envs
    parts = {name: (array.dtype, array.shape) for name, array in fresh.items()}
    if counters["_n_updates"]:
        parts |= _parts_of_moments(model)
    if any(name.startswith(_ORIGINAL) for name in found):  # there from the first step on
        parts |= {k.replace(_LAST, _ORIGINAL): v for k, v in parts.items() if k.startswith(_LAST)}
    rows = {"memory/": min(steps, capacity), "validation/": len(evaluations)}
    for name, array in found.items():
        if name.startswith("window/"):
            rows[name] = min(len(array) if array.ndim else 0, model._stats_window_size)
    for prefix, n in rows.items():  # the number of rows is not always the same
        for name, (dtype, shape) in parts.items():
            if name.startswith(prefix) and name not in _OF_FIXED_SHAPE:
                parts[name] = dtype, (n, *shape[1:])
    _check_parts(found, parts)
    _check_values(found, fresh, _ranges(model, capacity))
    exact: dict[str, Any] = {"adapter/steps": steps, "validation/timesteps": evaluations}
    if capacity:
        exact["memory/place"] = [steps % capacity, int(steps >= capacity)]
    for name, expected in exact.items():
        value = found[name]
        require(np.array_equal(value, expected), value, name, f"{expected}, from the age")
    mark = "adapter/env/digest"
    if mark in fresh:  # of rows of another package there may be none
        expected = f"{fresh[mark][0]}, which marks states of this task"
        require(found[mark] == fresh[mark], found[mark], mark, expected)
    lengths, returns = len(found["window/lengths"]), len(found["window/returns"])
    require(lengths == returns, lengths, "len(window/lengths)", f"{returns}, as of the returns")
    check_random(_actions_of(model), under("random", found), document["random"])


def _parts_of_moments(model: BaseAlgorithm) -> dict[str, _Part]:
    """Parts of the state of Adam, which there is from the first update on."""
    parts = {}
    for name, optimizer in parts_of(model).optimizers.items():
        weights = [weight for group in optimizer.param_groups for weight in group["params"]]
        for k, weight in enumerate(weights):
            if weight.requires_grad:
                shapes = {"step": (), "exp_avg": weight.shape, "exp_avg_sq": weight.shape}
                for key, shape in shapes.items():
                    parts[f"optimizer/{name}/{k}/{key}"] = np.dtype(np.float32), tuple(shape)
    return parts


def _check_parts(found: Arrays, parts: Mapping[str, _Part]) -> None:
    told = {name: f"{array.dtype} of shape {array.shape}" for name, array in found.items()}
    known = {name: f"{dtype} of shape {shape}" for name, (dtype, shape) in parts.items()}
    for name in sorted(told.keys() | known.keys()):
        one, expected = told.get(name, "missing"), known.get(name, "no such array")
        if one != expected:
            raise ValueError(f"{name} is {one}; expected {expected}")


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


# Check of the document of a checkpoint, before anything is restored from it.

_FREE = ("config", "manifest")  # compared elsewhere, where it is told how they differ
_SIGNED = ("_current_progress_remaining",)


def check_document(found: Mapping[str, Any], fresh: Mapping[str, Any], config: Config) -> None:
    """Refuse a document that a run cannot have written.

    Args:
        found: Document of the checkpoint.
        fresh: That of a checkpoint of a run that has not begun.
        config: Config of the run.

    Raises:
        ValueError: "member = value; expected ...".
    """
    _check_alike(found, fresh, "document")
    updates, most = found["iterations"], -(-config.total_timesteps // config.steps_per_update)
    require(0 <= updates <= most, updates, "iterations", f"an integer in [0, {most}]")
    counters, age = found["counters"], updates * config.steps_per_update
    ages = {
        "counters.num_timesteps": (counters["num_timesteps"], age),
        "counters._current_progress_remaining": (
            counters["_current_progress_remaining"],
            1.0 - age / config.total_timesteps,
        ),
        "logs.timesteps": (found["logs"]["timesteps"], age),
    }
    for name, (value, expected) in ages.items():
        require(value == expected, value, name, f"{expected} after {updates} updates")
    amounts = {f"counters.{key}": counters[key] for key in counters if key not in _SIGNED}
    amounts |= {f"spent[{k}]": value for k, value in enumerate(found["spent"])}
    amounts |= {f"learning_rates.{key}": min(each) for key, each in found["learning_rates"].items()}
    for name, value in (amounts | {"logs.seconds": found["logs"]["seconds"]}).items():
        require(value >= 0, value, name, "a number of at least 0")
    rate = counters.get("exploration_rate", 0.0)
    require(rate <= 1.0, rate, "counters.exploration_rate", "a number of at most 1")


def _check_alike(found: Any, like: Any, name: str) -> None:
    """Compare names and types of JSON values with those of others."""
    if isinstance(like, Mapping):
        require(isinstance(found, dict), found, name, "a mapping")
        keys = () if name.removeprefix("document.") in _FREE else like.keys()
        require(not keys or found.keys() == keys, sorted(found), name, f"entries {sorted(keys)}")
        for key in keys:
            _check_alike(found[key], like[key], f"{name}.{key}")
    elif isinstance(like, list):
        fits = isinstance(found, list) and len(found) == len(like)
        require(fits, found, name, f"a list of {len(like)}")
        for k, (value, each) in enumerate(zip(found, like, strict=True)):
            _check_alike(value, each, f"{name}[{k}]")
    elif isinstance(like, str):
        require(found == like, found, name, repr(like))
    elif like is None:
        require(found is None or isinstance(found, float), found, name, "a number or null")
    elif isinstance(like, float):
        is_number = isinstance(found, int | float) and not isinstance(found, bool)
        require(is_number and math.isfinite(found), found, name, "a finite number")
    else:
        require(type(found) is type(like), found, name, "an integer")


# Snapshot of training as arrays and JSON, from which it resumes to the bit.
#
# Weights, optimisers, replay buffer, counters, random streams (Python's, NumPy's, torch's, the
# environment's and that of its actions), running episodes, and statistics.

_COUNTERS = ("num_timesteps", "_n_updates", "_episode_num", "_current_progress_remaining")


def capture(model: BaseAlgorithm, adapter: TrainingRows) -> tuple[Arrays, dict[str, Any]]:
    """State of training between two updates.

    Args:
        model: SB3 model, set up to learn.
        adapter: The environment that it trains on, inside any normalisation.

    Returns:
        Arrays and JSON values that `restore` takes.
    """
    weights, optimizers = parts_of(model)
    streams, states = capture_random(_actions_of(model))
    buffer = getattr(model, "replay_buffer", None)
    arrays = {
        "weights": weights,
        "optimizer": {name: each.state_dict()["state"] for name, each in optimizers.items()},
        "memory": None if buffer is None else buffer_arrays(buffer),
        "adapter": adapter.get_state(),
        "normalize": _statistics(model.get_vec_normalize_env()),
        "random": streams,
        "window": _window(model),
        # The last observations, from which the next actions follow; also before normalisation.
        **{name: getattr(model, name) for name in (_LAST, _ORIGINAL)},
        "last_episode_starts": model._last_episode_starts,
    }
    document = {
        "counters": {name: getattr(model, name) for name in (*_COUNTERS, *counters_of(model))},
        "learning_rates": {
            name: [group["lr"] for group in optimizer.param_groups]
            for name, optimizer in optimizers.items()
        },
        "random": states,
    }
    return flat(arrays), document


def restore(
    model: BaseAlgorithm, adapter: TrainingRows, arrays: Arrays, document: Mapping[str, Any]
) -> None:
    """Bring a fresh model and its environment to a captured state.

    Args:
        model: A model of the same config, set up to learn.
        adapter: Its environment.
        arrays: From `capture`.
        document: From `capture`.
    """
    weights, optimizers = parts_of(model)
    for name, tensor in weights.items():
        tensor.copy_(torch.tensor(arrays[f"weights/{name}"]))
    for name, optimizer in optimizers.items():
        moments = under(f"optimizer/{name}", arrays)
        _restore_optimizer(optimizer, moments, document["learning_rates"][name])
    buffer = getattr(model, "replay_buffer", None)
    if buffer is not None:
        restore_buffer(buffer, under("memory", arrays))
    adapter.set_state(under("adapter", arrays))
    _restore_statistics(model.get_vec_normalize_env(), under("normalize", arrays))
    _restore_window(model, under("window", arrays))
    for name in (_LAST, _ORIGINAL):
        setattr(model, name, arrays.get(name) if name in arrays else under(name, arrays) or None)
    model._last_episode_starts = arrays["last_episode_starts"]
    for name, value in document["counters"].items():
        setattr(model, name, value)
    restore_random(_actions_of(model), under("random", arrays), document["random"])


def _actions_of(model: BaseAlgorithm) -> np.random.BitGenerator:
    """The stream of the first, random actions and of DQN's exploration."""
    return model.action_space.np_random.bit_generator


def _restore_optimizer(optimizer: Optimizer, arrays: Arrays, rates: list[float]) -> None:
    state: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in arrays.items():
        index, key = name.split("/")
        state.setdefault(int(index), {})[key] = torch.tensor(value)
    groups = optimizer.state_dict()["param_groups"]
    for group, rate in zip(groups, rates, strict=True):
        group["lr"] = rate
    optimizer.load_state_dict({"state": state, "param_groups": groups})


def _statistics(normalize: VecNormalize | None) -> Arrays:
    if normalize is None:
        return {}
    arrays: Arrays = {"returns": normalize.returns}
    for name, running in _running(normalize).items():
        arrays[f"{name}.mean"], arrays[f"{name}.var"] = map(np.asarray, (running.mean, running.var))
        arrays[f"{name}.count"] = np.array(running.count, dtype=np.float64)
    return arrays


def _restore_statistics(normalize: VecNormalize | None, arrays: Arrays) -> None:
    if normalize is None:
        return
    normalize.returns = arrays["returns"]
    for name, running in _running(normalize).items():
        running.mean, running.var = arrays[f"{name}.mean"], arrays[f"{name}.var"]
        running.count = float(arrays[f"{name}.count"])


def _running(normalize: VecNormalize) -> dict[str, RunningMeanStd]:
    statistics: dict[str, Any] = {"reward": normalize.ret_rms}
    observation: Any = normalize.obs_rms if normalize.norm_obs else {}
    if isinstance(observation, dict):
        return statistics | {f"observation.{key}": each for key, each in observation.items()}
    return statistics | {"observation": observation}


def _window(model: BaseAlgorithm) -> Arrays:
    """The last episodes, which the means of a rollout are over."""
    episodes, successes = model.ep_info_buffer, model.ep_success_buffer
    assert episodes is not None and successes is not None
    return {
        "returns": np.array([episode["r"] for episode in episodes], dtype=np.float64),
        "lengths": np.array([episode["l"] for episode in episodes], dtype=np.int64),
        "successes": np.array(successes, dtype=bool),
    }


def _restore_window(model: BaseAlgorithm, arrays: Arrays) -> None:
    pairs = zip(arrays["returns"].tolist(), arrays["lengths"].tolist(), strict=True)
    size = model._stats_window_size
    model.ep_info_buffer = deque([{"r": r, "l": n} for r, n in pairs], maxlen=size)
    model.ep_success_buffer = deque(arrays["successes"].tolist(), maxlen=size)
