"""All that a run needs to go on as if it had never stopped, to the bit, in one file.

Weights, optimiser, counters, random streams (Python's, NumPy's, torch's, the environment's),
episodes under way, statistics, evaluations, and how far the logs had come. The last two are kept.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize
from torch.optim import Optimizer

from .adapter import GymnasiumVecEnv
from .files import DamagedFileError
from .tensorfile import load_tensors, save_tensors

__all__ = ["capture", "load_newest", "restore", "save_newest"]

Arrays = dict[str, NDArray[Any]]
_SIZE_LIMIT = 8 * 2**30
_KEPT = 2
_COUNTERS = ("num_timesteps", "_n_updates", "_episode_num", "_current_progress_remaining")


def save_newest(folder: Path, timesteps: int, arrays: Arrays, document: dict[str, Any]) -> None:
    """Write a checkpoint, and drop all but the last two.

    Args:
        folder: Where; made if it is not there.
        timesteps: Age of the run, which names the file.
        arrays: What to keep.
        document: What else to keep, as JSON values.
    """
    folder.mkdir(exist_ok=True)
    save_tensors(folder / f"{timesteps:015d}.safetensors", arrays, document)
    for old in sorted(folder.glob("*.safetensors"))[:-_KEPT]:
        old.unlink()


def load_newest(folder: Path) -> tuple[Arrays, dict[str, Any], list[str]] | None:
    """Read the newest checkpoint that is whole.

    Args:
        folder: Where.

    Returns:
        Arrays, document, and a line about each newer one that is damaged; None if there is none.

    Raises:
        DamagedFileError: There are some, and all are damaged.
    """
    damaged: list[str] = []
    for path in sorted(folder.glob("*.safetensors"), reverse=True):
        try:
            arrays, document = load_tensors(path, _SIZE_LIMIT)
        except DamagedFileError as error:
            damaged.append(str(error))
        else:
            return arrays, document, damaged
    if damaged:
        raise DamagedFileError("; ".join(damaged))
    return None


def capture(model: PPO, adapter: GymnasiumVecEnv) -> tuple[Arrays, dict[str, Any]]:
    """The state of training between two updates.

    Args:
        model: The model.
        adapter: The environment that it trains on, inside any normalisation.

    Returns:
        Arrays and JSON values that `restore` takes.
    """
    weights = {key: value.numpy() for key, value in model.policy.state_dict().items()}
    optimizer = model.policy.optimizer
    moments = {
        f"{index}/{key}": value.numpy()
        for index, entry in optimizer.state_dict()["state"].items()
        for key, value in entry.items()
    }
    streams, counters = _capture_random()
    arrays = {
        **_prefixed("policy", weights),
        **_prefixed("optimizer", moments),
        **_prefixed("adapter", adapter.get_state()),
        **_prefixed("normalize", _statistics(model.get_vec_normalize_env())),
        **_prefixed("random", streams),
        **_prefixed("window", _window(model)),
        "last_obs": np.asarray(model._last_obs),
        "last_episode_starts": np.asarray(model._last_episode_starts),
    }
    document = {
        "counters": {name: getattr(model, name) for name in _COUNTERS},
        "learning_rates": [group["lr"] for group in optimizer.param_groups],
        "random": counters,
    }
    return arrays, document


def restore(
    model: PPO, adapter: GymnasiumVecEnv, arrays: Arrays, document: Mapping[str, Any]
) -> None:
    """Bring a fresh model and its environment to a captured state.

    Args:
        model: A model of the same config, set up to learn.
        adapter: Its environment.
        arrays: From `capture`.
        document: From `capture`.
    """
    weights = {key: torch.tensor(value) for key, value in _under("policy", arrays).items()}
    model.policy.load_state_dict(weights)
    _restore_optimizer(model.policy.optimizer, arrays, document["learning_rates"])
    adapter.set_state(_under("adapter", arrays))
    _restore_statistics(model.get_vec_normalize_env(), _under("normalize", arrays))
    _restore_window(model, _under("window", arrays))
    model._last_obs = arrays["last_obs"]
    model._last_episode_starts = arrays["last_episode_starts"]
    for name in _COUNTERS:
        setattr(model, name, document["counters"][name])
    _restore_random(_under("random", arrays), document["random"])


def _restore_optimizer(optimizer: Optimizer, arrays: Arrays, rates: list[float]) -> None:
    state: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in _under("optimizer", arrays).items():
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
    if normalize.norm_obs:
        statistics["observation"] = normalize.obs_rms
    return statistics


def _window(model: PPO) -> Arrays:
    """The last episodes, which the means of a rollout are over."""
    episodes, successes = model.ep_info_buffer, model.ep_success_buffer
    assert episodes is not None and successes is not None
    return {
        "returns": np.array([episode["r"] for episode in episodes], dtype=np.float64),
        "lengths": np.array([episode["l"] for episode in episodes], dtype=np.int64),
        "successes": np.array(successes, dtype=bool),
    }


def _restore_window(model: PPO, arrays: Arrays) -> None:
    pairs = zip(arrays["returns"].tolist(), arrays["lengths"].tolist(), strict=True)
    size = model._stats_window_size
    model.ep_info_buffer = deque([{"r": r, "l": n} for r, n in pairs], maxlen=size)
    model.ep_success_buffer = deque(arrays["successes"].tolist(), maxlen=size)


def _capture_random() -> tuple[Arrays, dict[str, Any]]:
    """The global streams: SB3 permutes batches with NumPy's and explores with torch's."""
    version, words, next_gauss = random.getstate()
    kind, key, position, has_gauss, gauss = np.random.get_state()  # noqa: NPY002
    arrays = {
        "python": np.array(words, dtype=np.uint64),
        "numpy": np.asarray(key),
        "torch": torch.get_rng_state().numpy(),
    }
    document = {"python": [version, next_gauss], "numpy": [kind, position, has_gauss, gauss]}
    return arrays, document


def _restore_random(arrays: Arrays, document: Mapping[str, Any]) -> None:
    version, next_gauss = document["python"]
    random.setstate((version, tuple(arrays["python"].tolist()), next_gauss))
    kind, position, has_gauss, gauss = document["numpy"]
    np.random.set_state((kind, arrays["numpy"], position, has_gauss, gauss))  # noqa: NPY002
    torch.set_rng_state(torch.tensor(arrays["torch"]))


def _prefixed(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    return {f"{prefix}/{key}": value for key, value in arrays.items()}


def _under(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    start = f"{prefix}/"
    return {k.removeprefix(start): value for k, value in arrays.items() if k.startswith(start)}
