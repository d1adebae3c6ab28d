"""Algorithms with a replay buffer; with hindsight experience replay in goal environments."""

from __future__ import annotations

from typing import Any

from gymnasium import spaces
from gymnasium.vector import VectorEnv
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.type_aliases import TrainFreq, TrainFrequencyUnit
from stable_baselines3.common.vec_env import VecEnv

from rigid_envs.base.settings import refusal

from ...config.entries import OffPolicyConfig
from ...environments import part_for
from .common import arguments

__all__ = ["check_buffer_size", "check_pay", "check_space", "iterate", "off_policy_arguments"]


def check_space(
    config: OffPolicyConfig, venv: VectorEnv[Any, Any, Any], kind: type[spaces.Space[Any]]
) -> None:
    """Refuse an environment with actions of another kind.

    Args:
        config: Config of the run.
        venv: Environment to train on.
        kind: The kind of space that the algorithm is for.

    Raises:
        ConfigError: "config.algo: ...".
    """
    space = venv.single_action_space
    if not isinstance(space, kind):
        raise refusal(
            "algo",
            config.algo,
            f"an algorithm for {space}, the actions of {config.env_id}: "
            "ppo takes Box and Discrete, sac Box, dqn Discrete",
        )


def check_pay(config: OffPolicyConfig, venv: VectorEnv[Any, Any, Any]) -> None:
    """Refuse price and bonus with hindsight: the reward of another goal is computed without them.

    Args:
        config: Config of the run.
        venv: Environment to train on.

    Raises:
        ConfigError: "config.cost_price: ..." or "config.success_bonus: ...".
    """
    if _looks_back(config, venv.single_observation_space):
        for key in ("cost_price", "success_bonus"):
            if value := getattr(config, key):
                raise refusal(key, value, "0, or n_sampled_goal: 0")


def check_buffer_size(config: OffPolicyConfig, venv: VectorEnv[Any, Any, Any]) -> None:
    """Refuse a replay buffer too small for a step of each row, or an episode of each with HER.

    Args:
        config: Config of the run.
        venv: Environment to train on.

    Raises:
        ConfigError: "config.buffer_size: ...".
    """
    limit = 0 if venv.spec is None else venv.spec.max_episode_steps or 0
    space = venv.single_observation_space
    least = config.n_envs * (limit + 1 if _looks_back(config, space) else 1)
    if config.buffer_size < least:
        raise refusal(
            "buffer_size",
            config.buffer_size,
            f"at least {least}: {least // config.n_envs} steps of each of {config.n_envs} rows",
        )


def off_policy_arguments(config: OffPolicyConfig, env: VecEnv) -> dict[str, Any]:
    """Arguments of every off-policy algorithm of SB3.

    Args:
        config: Config of the run.
        env: Environment to train on.
    """
    hindsight = {"n_sampled_goal": config.n_sampled_goal, "goal_selection_strategy": "future"}
    told = _has_hindsight(config, env.observation_space)
    return {
        **arguments(config, env),
        "buffer_size": config.buffer_size,
        "learning_starts": config.learning_starts,
        "batch_size": config.batch_size,
        "tau": config.tau,
        "train_freq": config.train_freq,
        "gradient_steps": config.gradient_steps,
        "replay_buffer_class": HerReplayBuffer if told else None,
        "replay_buffer_kwargs": hindsight if told else None,
    }


def iterate(model: OffPolicyAlgorithm, config: OffPolicyConfig, callback: BaseCallback) -> None:
    """One update: rounds of a few steps of every row, then gradient steps.

    Args:
        model: SB3 model.
        config: Config of the run.
        callback: Hooks of SB3.
    """
    assert model.env is not None and model.replay_buffer is not None
    for _ in range(config.rounds):
        model.collect_rollouts(
            model.env,
            callback,
            TrainFreq(config.train_freq, TrainFrequencyUnit.STEP),
            model.replay_buffer,
            learning_starts=config.learning_starts,
        )
        if _may_learn(model, config):
            model.train(config.gradient_steps, config.batch_size)


def _may_learn(model: OffPolicyAlgorithm, config: OffPolicyConfig) -> bool:
    """Whether the first, random steps are made, and HER has a complete episode."""
    buffer = model.replay_buffer
    ready = not isinstance(buffer, HerReplayBuffer) or bool(buffer.ep_length.any())
    return ready and model.num_timesteps >= config.learning_starts


def _looks_back(config: OffPolicyConfig, space: spaces.Space[Any]) -> bool:
    """Whether networks are given goals of observations of this space, in hindsight too."""
    return part_for(config.env_kwargs, space) is None and _has_hindsight(config, space)


def _has_hindsight(config: OffPolicyConfig, space: spaces.Space[Any]) -> bool:
    goals = {"observation", "achieved_goal", "desired_goal"}
    return config.n_sampled_goal > 0 and isinstance(space, spaces.Dict) and goals <= set(space)
