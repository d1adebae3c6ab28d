"""Data sets played again: every number must be there, bit for bit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from rigid_envs.catalogue import checked_id, id_in_file, task_of
from rigid_envs.datasets.collecting import INFOS
from rigid_envs.datasets.database import check_name, database, minari_of
from rigid_envs.files import DamagedFileError
from rigid_envs.kernels.cache import kernel_hash

__all__ = ["Check", "check"]


class Check(NamedTuple):
    """A data set that was played again.

    Attributes:
        episodes: Number of episodes.
        steps: Number of steps.
        differences: A line for each episode in which something differs; none if all is the same.
    """

    episodes: int
    steps: int
    differences: list[str]


def check(name: str, folder: Path | None = None) -> Check:
    """Play every episode again: its actions, from its seed, in the environment that it names.

    Args:
        name: Of a data set that `write` has written.
        folder: Of all data sets; None for Minari's.

    Raises:
        DamagedFileError: It is not one of `write`.
        FileNotFoundError: There is none of the name.
        DependencyNotInstalled: The extra `dataset` is missing.
    """
    minari = minari_of()
    check_name(name)
    with database(folder):
        dataset = minari.load_dataset(name)
    origin = dataset.storage.metadata.get("rigid_envs")
    if origin is None:
        raise DamagedFileError(f"{name}: expected a data set that `rigid-envs dataset` has written")
    env = _environment(name, origin)
    told = dataset.storage.get_episode_metadata(dataset.episode_indices)
    differences = []
    for episode, about in zip(dataset.iterate_episodes(), told, strict=True):
        where = next(_differences(env, episode, about["seed"]), None)
        if where is not None:
            differences.append(f"episode {episode.id}: {where}")
    env.close()
    if differences and origin["kernel_hash"] != kernel_hash():
        differences.append(f"written with kernels {origin['kernel_hash']}; these: {kernel_hash()}")
    return Check(dataset.total_episodes, dataset.total_steps, differences)


def _environment(name: str, origin: Mapping[str, Any]) -> Any:
    """The environment of a data set, from id and settings: Minari's own entry could name any code.

    Raises:
        DamagedFileError: An id that is not registered, or what is no setting of it.
    """
    try:
        env_id, settings = checked_id(id_in_file(origin["env_id"])), dict(origin["env_kwargs"])
        task_of(env_id, settings)
    except (LookupError, TypeError, ValueError) as error:
        raise DamagedFileError(f"{name}: {error}; write it anew: rigid-envs dataset") from error
    return gym.make(env_id, **settings)


def _differences(env: Any, episode: Any, seed: int) -> Iterator[str]:
    """What differs from an episode, in the order of its steps."""
    seen, info = env.reset(seed=seed)
    yield from _apart("the start", episode.observations, 0, seen, info, episode.infos)
    for step, action in enumerate(episode.actions):
        seen, *outcome, info = env.step(action)
        names = ("rewards", "terminations", "truncations")
        for key, value in zip(names, outcome, strict=True):
            if getattr(episode, key)[step] != value:
                yield f"step {step}: {key} = {value!r}; stored {getattr(episode, key)[step]!r}"
        yield from _apart(f"step {step}", episode.observations, step + 1, seen, info, episode.infos)


def _apart(
    place: str, stored: Any, at: int, seen: Any, info: Mapping[str, Any], infos: Mapping[str, Any]
) -> Iterator[str]:
    """What differs in observation and infos."""
    parts = seen if isinstance(seen, Mapping) else {"": seen}
    for key, part in parts.items():
        then = (stored[key] if key else stored)[at]
        if then.dtype != part.dtype or not np.array_equal(then, part):
            yield f"{place}: observation {key} = {part.tolist()}; stored {then.tolist()}"
    for key in INFOS:
        if info[key] != infos[key][at]:
            yield f"{place}: info {key} = {info[key]!r}; stored {infos[key][at]!r}"
