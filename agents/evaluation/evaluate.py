"""Evaluation of a policy: one episode from each of many fixed starts, all at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from gymnasium.vector import VectorEnv

from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores import evaluation, playing
from rigid_envs.scores.episodes import Episodes, SupportsPredict
from rigid_envs.scores.random_policy import RandomPolicy
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.starts import TEST_SEED

from ..environments.factory import make

__all__ = ["Episodes", "Evaluation", "RandomPolicy", "SupportsPredict", "evaluate", "play"]


def evaluate(
    policy: Any,
    env_id: str,
    n: int = 500,
    seed: int = TEST_SEED,
    env_kwargs: Mapping[str, Any] | None = None,
    name: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Evaluation:
    """Evaluate as `rigid_envs.evaluate` does, also in native environments of other packages.

    Args:
        policy: See `rigid_envs.evaluate`; None plays at random.
        env_id: The environment.
        n: Number of starts.
        seed: Seed that the starts are spawned from.
        env_kwargs: Hyperparameters of the task.
        name: Who acts; None for the name that the policy has.
        progress: Called with a few words in every step.
    """
    venv = make(env_id, env_kwargs or {}, n)
    chosen = "random" if policy is None else policy
    own = env_id.rpartition(":")[2]
    found = evaluation.evaluate(
        own if own in ENVIRONMENTS else env_id,
        chosen,
        n=n,
        seed=seed,
        env=venv,
        name=name,
        progress=progress,
    )
    venv.close()
    return found


def play(policy: SupportsPredict, venv: VectorEnv[Any, Any, Any], seeds: list[int]) -> Episodes:
    """Play exactly one episode in each row, as `rigid_envs.scores.playing.play` does.

    Args:
        policy: What acts.
        venv: A vector environment that resets in the same step.
        seeds: Seed of each row.
    """
    return playing.play(lambda obs: policy.predict(obs, deterministic=True)[0], venv, seeds)
