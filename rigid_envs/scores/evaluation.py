"""Evaluation of policies of any kind on the evaluation set of an id."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from rigid_envs.envs import RigidVectorEnv
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores.controllers import ControllerFactory
from rigid_envs.scores.episodes import ActionFunction, Episodes, SupportsPredict
from rigid_envs.scores.metrics import metrics_of
from rigid_envs.scores.playing import play
from rigid_envs.scores.random_policy import RandomPolicy
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, row_seeds
from rigid_envs.tasks import Task

__all__ = [
    "Evaluation",
    "PolicyFactory",
    "constant_zero",
    "evaluate",
    "from_controller",
    "from_predict",
    "make_rows",
    "play_starts",
    "uniform",
]

Array = npt.NDArray[np.float64]

PolicyFactory = Callable[[RigidVectorEnv], ActionFunction]
"""A policy of any kind: a function from a vector environment to the actions in it."""


@dataclass(frozen=True)
class Evaluation:
    """Episodes of a policy from the starts of an id.

    Attributes:
        env_id: Gymnasium's id.
        task: Its task, with the settings of this evaluation.
        episodes: One episode from each start.
    """

    env_id: str
    task: Task
    episodes: Episodes

    def values(self, random_baseline: Mapping[str, float] | None = None) -> dict[str, Array]:
        """The metrics of the id by name, each of shape (n,).

        Args:
            random_baseline: Plain means of the random policy, which failures count for; None lets
                them keep their own values.
        """
        baseline = random_baseline or {}
        return {
            metric.name: metric.values(self.episodes, self.task, baseline.get(metric.name))
            for metric in metrics_of(self.env_id)
        }

    def means(self, random_baseline: Mapping[str, float] | None = None) -> dict[str, float]:
        """The mean of each metric by its name; see `values`."""
        values = self.values(random_baseline)
        return {name: float(value.mean()) for name, value in values.items()}


def evaluate(
    env_id: str,
    policy: PolicyFactory,
    n: int = N_STARTS,
    seed: int = TEST_SEED,
    config: Mapping[str, Any] | None = None,
) -> Evaluation:
    """Play one episode from each of the first n starts.

    Args:
        env_id: Gymnasium's id.
        policy: From `from_controller`, `from_predict` or `uniform`, for example.
        n: Number of starts.
        seed: Seed that the starts are drawn from; that of the evaluation set by default.
        config: Hyperparameters of the task.
    """
    envs = make_rows(env_id, n, config)
    return Evaluation(env_id, envs.task, play_starts(policy, envs, seed))


def play_starts(policy: PolicyFactory, envs: Any, seed: int = TEST_SEED) -> Episodes:
    """Play one episode from the start of every row, and close the environment.

    Args:
        policy: See `evaluate`.
        envs: Any vector environment whose rows reset in the step that ends their episode.
        seed: Seed that the starts are drawn from; that of the evaluation set by default.
    """
    record = ENVIRONMENTS.get(getattr(envs.spec, "id", ""))
    error = None if record is None else record.error
    try:
        return play(policy(envs), envs, row_seeds(seed, envs.num_envs, "test"), error)
    finally:
        envs.close()


def make_rows(env_id: str, n: int, config: Mapping[str, Any] | None = None) -> RigidVectorEnv:
    """N rows of an id that reset in the step that ends their episode.

    Args:
        env_id: Gymnasium's id.
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


def from_controller(factory: ControllerFactory) -> PolicyFactory:
    """A policy of states from a controller.

    Args:
        factory: For example one of `reference_controllers`.
    """

    def policy(envs: RigidVectorEnv) -> ActionFunction:
        control = factory(envs.task)
        kind = envs.single_action_space.dtype
        return lambda _: np.asarray(control(envs), dtype=kind)

    return policy


def from_predict(policy: SupportsPredict) -> PolicyFactory:
    """A policy of observations, trained by us or by Stable-Baselines3."""
    return lambda _: lambda obs: policy.predict(obs, deterministic=True)[0]


def uniform(seed: int = TEST_SEED) -> PolicyFactory:
    """The random policy, which draws the same actions in every evaluation.

    Args:
        seed: Seed of the starts; the actions are drawn from another stream of it.
    """

    def policy(envs: RigidVectorEnv) -> ActionFunction:
        stream = np.random.default_rng(row_seeds(seed, 1, "random policy"))
        draw = RandomPolicy(envs.single_action_space, stream)
        return lambda obs: draw.predict(obs)[0]

    return policy


def constant_zero(envs: RigidVectorEnv) -> ActionFunction:
    """The policy whose action is 0, the middle of a box or the first choice, in every step."""
    space: Any = envs.action_space
    actions = np.zeros(space.shape, dtype=space.dtype)
    return lambda _: actions.copy()
