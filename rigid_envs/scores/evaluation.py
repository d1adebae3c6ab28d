"""Policies of any kind measured on the evaluation set of an id."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from rigid_envs.envs import RigidVectorEnv
from rigid_envs.scores.chance import RandomPolicy
from rigid_envs.scores.episodes import Act, Actor, Episodes, play
from rigid_envs.scores.metrics import error_of, metrics_of
from rigid_envs.scores.policy import Builder
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, row_seeds
from rigid_envs.tasks import Task

__all__ = [
    "Evaluation",
    "Player",
    "actor",
    "at_random",
    "controller",
    "evaluate",
    "make_rows",
    "play_starts",
]

Array = npt.NDArray[np.float64]

Player = Callable[[RigidVectorEnv], Act]
"""What acts in a vector environment that it is given."""


@dataclass(frozen=True)
class Evaluation:
    """A policy on the starts of an id.

    Attributes:
        task: What was played.
        episodes: How it went.
    """

    task: Task
    episodes: Episodes

    def values(self, chance: Mapping[str, float] | None = None) -> dict[str, Array]:
        """The metrics that matter for the task, by name, each of shape (n,).

        Args:
            chance: Plain means of the random policy, which failures count for; None lets them
                count for what they are.
        """
        return {
            metric.name: metric.of(
                self.episodes, self.task, None if chance is None else chance[metric.name]
            )
            for metric in metrics_of(self.task)
        }


def evaluate(
    env_id: str,
    player: Player,
    n: int = N_STARTS,
    seed: int = TEST_SEED,
    config: Mapping[str, Any] | None = None,
) -> Evaluation:
    """Play one episode from each of the first n starts.

    Args:
        env_id: The id.
        player: `controller`, `actor` or `at_random`.
        n: Number of starts.
        seed: Seed that the starts are drawn from; that of the evaluation set by default.
        config: Hyperparameters of the task.
    """
    envs = make_rows(env_id, n, config)
    return Evaluation(envs.task, play_starts(player, envs, seed))


def play_starts(player: Player, envs: Any, seed: int = TEST_SEED) -> Episodes:
    """Play one episode from the start of every row, and close the environment.

    Args:
        player: `controller`, `actor` or `at_random`.
        envs: A vector environment, also of somebody else, whose rows reset in the step that ends
            their episode.
        seed: Seed that the starts are drawn from; that of the evaluation set by default.
    """
    task = getattr(envs, "task", None)
    error = error_of(task) if isinstance(task, Task) else None
    try:
        return play(player(envs), envs, row_seeds(seed, envs.num_envs, "test"), error)
    finally:
        envs.close()


def make_rows(env_id: str, n: int, config: Mapping[str, Any] | None = None) -> RigidVectorEnv:
    """N rows of an id that reset in the step that ends their episode.

    Args:
        env_id: The id.
        n: Number of rows.
        config: Hyperparameters of the task.
    """
    envs = gym.make_vec(
        env_id,
        num_envs=n,
        vectorization_mode="vector_entry_point",
        autoreset_mode="SameStep",
        **(config or {}),
    )
    assert isinstance(envs, RigidVectorEnv)
    return envs


def controller(builder: Builder) -> Player:
    """A reference controller as a player.

    Args:
        builder: An entry of `REFERENCES`.
    """

    def player(envs: RigidVectorEnv) -> Act:
        policy = builder(envs.task)
        kind = envs.single_action_space.dtype
        return lambda _: np.asarray(policy(envs), dtype=kind)

    return player


def actor(policy: Actor) -> Player:
    """A policy of observations as a player.

    Args:
        policy: Trained by us or by SB3.
    """
    return lambda _: lambda obs: policy.predict(obs, deterministic=True)[0]


def at_random(seed: int = TEST_SEED) -> Player:
    """The random policy, which draws the same actions each time.

    Args:
        seed: Seed of the starts; the draws have a stream of their own.
    """

    def player(envs: RigidVectorEnv) -> Act:
        stream = np.random.default_rng(row_seeds(seed, 1, "random policy"))
        policy = RandomPolicy(envs.single_action_space, stream)
        return lambda obs: policy.predict(obs)[0]

    return player
