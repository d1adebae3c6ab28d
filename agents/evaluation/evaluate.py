"""Evaluation of a policy: one episode from each of many fixed starts, all at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from rigid_envs.scores import playing
from rigid_envs.scores.episodes import Episodes, SupportsPredict
from rigid_envs.scores.evaluation import PolicyFactory, from_predict, play_starts, uniform
from rigid_envs.scores.random_policy import RandomPolicy
from rigid_envs.scores.starts import TEST_SEED

from ..environments.factory import make
from .intervals import wilson_interval

__all__ = [
    "Episodes",
    "RandomPolicy",
    "SupportsPredict",
    "evaluate",
    "evaluate_factory",
    "play",
    "summary",
]


def evaluate(
    policy: SupportsPredict | None,
    env_id: str,
    n: int = 500,
    seed: int = TEST_SEED,
    env_kwargs: Mapping[str, Any] | None = None,
) -> Episodes:
    """Play one episode from each of n fixed starts that no training and no selection has seen.

    Args:
        policy: The policy; None plays at random.
        env_id: The environment.
        n: Number of starts.
        seed: Seed that the starts are spawned from.
        env_kwargs: Hyperparameters of the task.
    """
    return evaluate_factory(
        uniform(seed) if policy is None else from_predict(policy), env_id, n, seed, env_kwargs
    )


def evaluate_factory(
    policy: PolicyFactory,
    env_id: str,
    n: int = 500,
    seed: int = TEST_SEED,
    env_kwargs: Mapping[str, Any] | None = None,
) -> Episodes:
    """Play one episode from each start by a policy of any kind, such as a reference controller.

    Args:
        policy: See `rigid_envs.scores.evaluate`.
        env_id: The environment.
        n: Number of starts.
        seed: Seed that the starts are spawned from.
        env_kwargs: Hyperparameters of the task.
    """
    return play_starts(policy, make(env_id, env_kwargs or {}, n), seed)


def play(policy: SupportsPredict, venv: VectorEnv[Any, Any, Any], seeds: list[int]) -> Episodes:
    """Play exactly one episode in each row, as `rigid_envs.scores.playing.play` does.

    Args:
        policy: What acts.
        venv: A vector environment that resets in the same step.
        seeds: Seed of each row.
    """
    return playing.play(lambda obs: policy.predict(obs, deterministic=True)[0], venv, seeds)


def summary(episodes: Episodes) -> dict[str, Any]:
    """Rates, means and intervals of episodes, as JSON values."""
    n, won = len(episodes.seeds), episodes.successes
    low, high = wilson_interval(int(won.sum()), n)
    figures: dict[str, Any] = {
        "episodes": n,
        "successes": int(won.sum()),
        "success_rate": float(won.mean()),
        "success_rate_95": [low, high],
        "return_mean": float(episodes.returns.mean()),
        "length_mean": float(episodes.lengths.mean()),
        "cost_mean": float(episodes.costs.mean()),
        "cost_mean_of_successes": _mean(episodes.costs[won]),
    }
    if episodes.bounds is not None:
        figures["lower_bound_mean"] = float(episodes.bounds.mean())
        figures["lower_bound_mean_of_successes"] = _mean(episodes.bounds[won])
    return figures


def _mean(values: NDArray[np.float64]) -> float | None:
    return float(values.mean()) if values.size else None
