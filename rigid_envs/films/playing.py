"""Episodes of policies and controllers, recorded to be looked at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import gymnasium as gym

from rigid_envs.catalogue import task_of
from rigid_envs.envs import RigidVectorEnv
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.replays import Episode, play_again
from rigid_envs.scores import PolicyFactory, metrics_of
from rigid_envs.scores.tally import Tally
from rigid_envs.tasks import Task

__all__ = ["Played", "figure", "play_episode"]


@dataclass(frozen=True)
class Played:
    """An episode that was played.

    Attributes:
        env_id: Gymnasium's id.
        task: The task.
        episode: What happened.
        tally: Its figures.
    """

    env_id: str
    task: Task
    episode: Episode
    tally: Tally

    @property
    def value(self) -> float:
        """The cost of this id, its first metric, also where the episode failed."""
        return self.tally.value(metrics_of(self.env_id)[0], self.task)

    def captioned(self) -> tuple[Task, Episode]:
        """The task, and the episode with its result in the label: ``PPO: path 8.31 m``."""
        text = figure(self.env_id, self.task, self.value) if self.tally.success else "no success"
        return self.task, replace(self.episode, label=f"{self.episode.label}: {text}")


def play_episode(
    policy: PolicyFactory,
    env_id: str,
    seed: int,
    config: Mapping[str, Any] | None = None,
    label: str = "",
) -> Played:
    """Play one episode to its end, from the start that `reset(seed=seed)` gives.

    Args:
        policy: From `rigid_envs.scores.from_controller` or `from_predict`, for example.
        env_id: Gymnasium's id.
        seed: Of the start.
        config: Hyperparameters of the task.
        label: Who acts.
    """
    task_of(env_id, config)  # refuses what is no setting
    envs: Any = gym.make_vec(
        env_id,
        num_envs=1,
        vectorization_mode="vector_entry_point",
        autoreset_mode="Disabled",
        **(config or {}),
    )
    assert isinstance(envs, RigidVectorEnv)
    record = ENVIRONMENTS[env_id]
    tally = Tally([seed], record.error, record.max_episode_steps)
    try:
        act = policy(envs)
        obs, _ = envs.reset(seed=[seed])
        start = {name: part[0].copy() for name, part in envs.get_state().items()}
        actions, over = [], (False, False)
        while not any(over):
            actions.append(act(obs)[0])
            obs, rewards, terminated, truncated, infos = envs.step(actions[-1][None])
            over = bool(terminated[0]), bool(truncated[0])
            tally.add(rewards, terminated, truncated, infos)
    finally:
        envs.close()
    episode = play_again(envs.task, start, actions, label, terminated=over[0], truncated=over[1])
    return Played(env_id, envs.task, episode, tally)


def figure(env_id: str, task: Task, value: float) -> str:
    """A value of the first metric of an id, its cost, in words: ``path 8.31 m``."""
    metric = metrics_of(env_id)[0]
    unit = metric.unit(task)
    return f"{metric.name} {value:.3g}" + (f" {unit}" if unit else "")
