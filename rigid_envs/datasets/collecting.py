"""Episodes of a policy, with everything that its environment gave and was given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.envs import RigidVectorEnv
from rigid_envs.scores import PolicyFactory
from rigid_envs.scores.playing import entries_of

__all__ = ["INFOS", "Recorded", "collect"]

Array = npt.NDArray[Any]

INFOS = ("cost", "is_success")
"""Entries of the infos that are kept, one more than steps: the first is that of the reset."""


class Recorded(NamedTuple):
    """An episode of T steps.

    Attributes:
        seed: ``reset(seed=...)`` of a single environment begins it.
        observations: Shape (T + 1, n), or a dictionary of such.
        actions: As they were given, shape (T, m), of choices (T,).
        rewards: Shape (T,).
        terminations: Shape (T,).
        truncations: Shape (T,).
        infos: The entries `INFOS`, each of shape (T + 1,).
    """

    seed: int
    observations: Array | dict[str, Array]
    actions: Array
    rewards: Array
    terminations: npt.NDArray[np.bool_]
    truncations: npt.NDArray[np.bool_]
    infos: dict[str, Array]


def collect(policy: PolicyFactory, envs: RigidVectorEnv, seeds: Sequence[int]) -> list[Recorded]:
    """One episode in each row.

    Args:
        policy: What acts.
        envs: Rows that reset in the step that ends their episode.
        seeds: Seed of each row.
    """
    seen, infos = envs.reset(seed=seeds)
    act, running = policy(envs), np.ones(envs.num_envs, np.bool_)
    observations, steps = [seen], []
    entries = [{key: infos[key] for key in INFOS}]
    lengths = np.zeros(envs.num_envs, np.int64)
    while running.any():
        actions = np.array(act(seen), dtype=envs.single_action_space.dtype)
        seen, rewards, terminated, truncated, infos = envs.step(actions)
        ended = terminated | truncated
        observations.append(_merged(infos["final_obs"], seen, ended) if ended.any() else seen)
        entries.append(entries_of(infos, INFOS, ended))
        steps.append((actions, rewards, terminated, truncated))
        lengths += running
        running &= ~ended
    actions, rewards, terminations, truncations = (
        np.stack(column) for column in zip(*steps, strict=True)
    )
    told = {key: np.stack([each[key] for each in entries]) for key in INFOS}
    whole = _stacked(observations)
    return [
        Recorded(
            seed=seed,
            observations=_of_row(whole, row, n + 1),
            actions=actions[:n, row],
            rewards=rewards[:n, row],
            terminations=terminations[:n, row],
            truncations=truncations[:n, row],
            infos=_of_row(told, row, n + 1),
        )
        for row, (seed, n) in enumerate(zip(seeds, lengths.tolist(), strict=True))
    ]


def _merged(last: Any, new: Any, ended: npt.NDArray[np.bool_]) -> Any:
    """The last observations of rows that ended, and those of the others."""
    if isinstance(new, Mapping):
        return {key: _merged(last[key], part, ended) for key, part in new.items()}
    return np.where(ended[:, None], last, new)


def _stacked(observations: Sequence[Any]) -> Any:
    """Observations of all rows over time, shape (T + 1, N, n)."""
    if isinstance(observations[0], Mapping):
        return {key: np.stack([each[key] for each in observations]) for key in observations[0]}
    return np.stack(observations)


def _of_row(whole: Any, row: int, n: int) -> Any:
    if isinstance(whole, Mapping):
        return {key: part[:n, row] for key, part in whole.items()}
    return whole[:n, row]
