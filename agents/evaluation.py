"""How good a policy is: one episode from each of many fixed starts, all at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from .environments import make
from .seeds import TEST_SEED, row_seeds
from .statistics import wilson_interval

__all__ = ["Actor", "Episodes", "RandomPolicy", "evaluate", "play", "summary"]


Observations = NDArray[Any] | dict[str, NDArray[Any]]


class Actor(Protocol):
    """What chooses actions: our policies, and SB3's models."""

    def predict(
        self, observation: Observations, *, deterministic: bool = True
    ) -> tuple[NDArray[Any], Any]:
        """Actions for a batch of observations."""


@dataclass(frozen=True)
class Episodes:
    """One episode from each start.

    Attributes:
        seeds: Seed of each start; `reset(seed=[...])` gives it again.
        returns: Sums of rewards, shape (n,).
        lengths: Numbers of steps, shape (n,).
        successes: `info["is_success"]` at the end, shape (n,).
        costs: Sums of `info["cost"]`, in the unit that the task says, shape (n,).
        bounds: Least cost that theory allows from each start, shape (n,); None if none is known.
    """

    seeds: list[int]
    returns: NDArray[np.float64]
    lengths: NDArray[np.int64]
    successes: NDArray[np.bool_]
    costs: NDArray[np.float64]
    bounds: NDArray[np.float64] | None


class RandomPolicy:
    """Actions drawn uniformly: what no learning is worth."""

    def __init__(self, action_space: spaces.Space[Any], rng: np.random.Generator) -> None:
        """Draw from a space.

        Args:
            action_space: A box or a discrete space.
            rng: Source of the draws.
        """
        self._space, self._rng = action_space, rng

    def predict(
        self, observation: Observations, *, deterministic: bool = True
    ) -> tuple[NDArray[Any], None]:
        """Draw an action for each observation.

        Args:
            observation: Shape (N, ...), or a dictionary of such.
            deterministic: Ignored.
        """
        part = next(iter(observation.values())) if isinstance(observation, dict) else observation
        n, space = len(part), self._space
        if isinstance(space, spaces.Discrete):
            return self._rng.integers(space.start, space.start + space.n, n), None
        assert isinstance(space, spaces.Box)
        actions = self._rng.uniform(space.low, space.high, (n, *space.shape))
        return actions.astype(space.dtype), None


def evaluate(
    policy: Actor | None,
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
    venv = make(env_id, env_kwargs or {}, n)
    try:
        if policy is None:
            stream = np.random.default_rng(row_seeds(seed, 1, "random policy"))
            policy = RandomPolicy(venv.single_action_space, stream)
        return play(policy, venv, row_seeds(seed, n, "test"))
    finally:
        venv.close()


def play(policy: Actor, venv: VectorEnv[Any, Any, Any], seeds: list[int]) -> Episodes:
    """Play exactly one episode in each row.

    Rows that are done go on with another episode, which is not counted: the starts that are easy
    to finish weigh no more than the others.

    Args:
        policy: What acts.
        venv: A vector environment that resets in the same step.
        seeds: Seed of each row.
    """
    n = venv.num_envs
    first_seeds: Any = seeds  # native environments take one seed for each row
    obs, _ = venv.reset(seed=first_seeds)
    bounds = _lower_bounds(venv)
    returns, costs = np.zeros(n), np.zeros(n)
    lengths, successes = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool)
    running = np.ones(n, dtype=bool)
    while running.any():
        actions, _ = policy.predict(obs, deterministic=True)
        obs, rewards, terminated, truncated, infos = venv.step(actions)
        ended = running & (terminated | truncated)
        returns += np.where(running, rewards, 0.0)
        costs += np.where(running, _last(infos, "cost", ended), 0.0)
        successes |= ended & _last(infos, "is_success", ended).astype(bool)
        lengths += running
        running &= ~ended
    return Episodes(seeds, returns, lengths, successes, costs, bounds)


def summary(episodes: Episodes) -> dict[str, Any]:
    """The figures of a set of episodes, as JSON values.

    Args:
        episodes: The episodes.
    """
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


def _last(infos: Mapping[str, Any], key: str, ended: NDArray[np.bool_]) -> NDArray[Any]:
    """An info entry of the step itself, also in rows that started anew within it."""
    values = np.asarray(infos.get(key, np.zeros(len(ended))))
    if ended.any():
        values = np.where(ended, infos["final_info"].get(key, 0), values)
    return values


def _lower_bounds(venv: VectorEnv[Any, Any, Any]) -> NDArray[np.float64] | None:
    env: Any = venv.unwrapped
    hook = getattr(getattr(env, "task", None), "lower_bound", None)
    return None if hook is None else np.asarray(hook(env.get_state()["y"]), dtype=np.float64)


def _mean(values: NDArray[np.float64]) -> float | None:
    return float(values.mean()) if values.size else None
