"""Snapshot of training as arrays and JSON, from which it resumes to the bit.

Weights, optimisers, replay buffer, counters, random streams (Python's, NumPy's, torch's, the
environment's and that of its actions), running episodes, and statistics.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize
from torch.optim import Optimizer

from ..environments.training_rows import TrainingRows
from .algorithms import algorithm_of
from .array_check import check_arrays
from .random_streams import capture_random, check_random, restore_random
from .replay_buffer import buffer_arrays, restore_buffer

__all__ = ["capture", "check", "restore"]

Arrays = dict[str, NDArray[Any]]
_COUNTERS = ("num_timesteps", "_n_updates", "_episode_num", "_current_progress_remaining")
_OBSERVATIONS = ("_last_obs", "_last_original_obs")


def capture(model: BaseAlgorithm, adapter: TrainingRows) -> tuple[Arrays, dict[str, Any]]:
    """State of training between two updates.

    Args:
        model: SB3 model, set up to learn.
        adapter: The environment that it trains on, inside any normalisation.

    Returns:
        Arrays and JSON values that `restore` takes.
    """
    algorithm = algorithm_of(model)
    weights, optimizers = algorithm.parts(model)
    streams, states = capture_random(_action_stream(model))
    buffer = getattr(model, "replay_buffer", None)
    arrays = {
        **_prefixed("weights", {name: tensor.numpy() for name, tensor in weights.items()}),
        **_prefixed("optimizer", _moments(optimizers)),
        **_prefixed("memory", {} if buffer is None else buffer_arrays(buffer)),
        **_prefixed("adapter", adapter.get_state()),
        **_prefixed("normalize", _statistics(model.get_vec_normalize_env())),
        **_prefixed("random", streams),
        **_prefixed("window", _window(model)),
        **_observations(model),
        "last_episode_starts": np.asarray(model._last_episode_starts),
    }
    document = {
        "counters": {name: getattr(model, name) for name in (*_COUNTERS, *algorithm.COUNTERS)},
        "learning_rates": {
            name: [group["lr"] for group in optimizer.param_groups]
            for name, optimizer in optimizers.items()
        },
        "random": states,
    }
    return arrays, document


def check(
    model: BaseAlgorithm,
    fresh: Arrays,
    arrays: Arrays,
    document: Mapping[str, Any],
    evaluations: Sequence[int],
) -> None:
    """Refuse what `restore` could not, or should not, bring a model to.

    Args:
        model: A model of the same config, set up to learn.
        fresh: Arrays of a checkpoint of it as it is.
        arrays: Arrays of a checkpoint.
        document: Its document, checked.
        evaluations: Ages at which the run has been evaluated [steps].

    Raises:
        ValueError: "member = value; expected ...".
    """
    check_arrays(arrays, fresh, model, document["counters"], evaluations)
    check_random(_action_stream(model), _under("random", arrays), document["random"])


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
    weights, optimizers = algorithm_of(model).parts(model)
    for name, tensor in weights.items():
        tensor.copy_(torch.tensor(arrays[f"weights/{name}"]))
    for name, optimizer in optimizers.items():
        moments = _under(f"optimizer/{name}", arrays)
        _restore_optimizer(optimizer, moments, document["learning_rates"][name])
    buffer = getattr(model, "replay_buffer", None)
    if buffer is not None:
        restore_buffer(buffer, _under("memory", arrays))
    adapter.set_state(_under("adapter", arrays))
    _restore_statistics(model.get_vec_normalize_env(), _under("normalize", arrays))
    _restore_window(model, _under("window", arrays))
    _restore_observations(model, arrays)
    model._last_episode_starts = arrays["last_episode_starts"]
    for name, value in document["counters"].items():
        setattr(model, name, value)
    restore_random(_action_stream(model), _under("random", arrays), document["random"])


def _moments(optimizers: Mapping[str, Optimizer]) -> Arrays:
    return {
        f"{name}/{index}/{key}": value.numpy()
        for name, optimizer in optimizers.items()
        for index, entry in optimizer.state_dict()["state"].items()
        for key, value in entry.items()
    }


def _restore_optimizer(optimizer: Optimizer, arrays: Arrays, rates: list[float]) -> None:
    state: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in arrays.items():
        index, key = name.split("/")
        state.setdefault(int(index), {})[key] = torch.tensor(value)
    groups = optimizer.state_dict()["param_groups"]
    for group, rate in zip(groups, rates, strict=True):
        group["lr"] = rate
    optimizer.load_state_dict({"state": state, "param_groups": groups})


def _observations(model: BaseAlgorithm) -> Arrays:
    """Last observations, from which the next actions follow; also those before normalisation."""
    arrays: Arrays = {}
    for name in _OBSERVATIONS:
        value: Any = getattr(model, name)
        if isinstance(value, dict):
            arrays |= _prefixed(name, value)
        elif value is not None:
            arrays[name] = value
    return arrays


def _restore_observations(model: BaseAlgorithm, arrays: Arrays) -> None:
    for name in _OBSERVATIONS:
        setattr(model, name, arrays.get(name) if name in arrays else _under(name, arrays) or None)


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


def _action_stream(model: BaseAlgorithm) -> np.random.BitGenerator:
    return model.action_space.np_random.bit_generator


def _prefixed(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    return {f"{prefix}/{key}": value for key, value in arrays.items()}


def _under(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    start = f"{prefix}/"
    return {k.removeprefix(start): value for k, value in arrays.items() if k.startswith(start)}
