"""The environment of a training: refused if it cannot be, wrapped as the model sees it."""

from __future__ import annotations

from typing import Any

from gymnasium.spaces import Box
from gymnasium.vector import VectorEnv
from stable_baselines3.common.vec_env import VecEnv, VecExtractDictObs, VecNormalize

from rigid_envs.settings import refusal

from ..config.by_algorithm import Config
from ..environments.factory import make, part_for
from ..environments.training_rows import TrainingRows
from .algorithms import check_fit

__all__ = ["checked_environment", "wrapped"]


def checked_environment(config: Config) -> VectorEnv[Any, Any, Any]:
    """The environment of a training.

    Args:
        config: Config of the run.

    Raises:
        ConfigError: The algorithm is not for it, or its spaces are not those of the evaluations.
    """
    tested = make(config.env_id, config.env_kwargs, 1)
    trained = make(config.env_id, config.training_kwargs, 1, "train_kwargs")
    check_fit(config, trained)
    for key, entry in (("cost_price", "cost"), ("success_bonus", "is_success")):
        if (value := getattr(config, key)) and entry not in trained.reset()[1]:
            raise refusal(key, value, f"0: {config.env_id} reports no {entry}")
    if config.policy_gain != 1.0 and not _is_gaussian(config, trained):
        raise refusal("policy_gain", config.policy_gain, "1: not for this algorithm and id")
    spaces = [
        (venv.single_observation_space, venv.single_action_space) for venv in (tested, trained)
    ]
    tested.close()
    if spaces[0] != spaces[1]:
        raise refusal(
            "train_kwargs",
            dict(config.train_kwargs),
            "what leaves the spaces of observations and actions as they are with env_kwargs alone",
        )
    return trained


def _is_gaussian(config: Config, venv: VectorEnv[Any, Any, Any]) -> bool:
    return config.algo == "ppo" and isinstance(venv.single_action_space, Box)


def wrapped(adapter: TrainingRows, config: Config) -> VecEnv:
    """What the model sees: the part that networks read, normalised as the config says.

    Args:
        adapter: The environment of the training.
        config: Config of the run.
    """
    part = part_for(config.env_kwargs, adapter.observation_space)
    seen = adapter if part is None else VecExtractDictObs(adapter, part)
    if not (config.normalize_observation or config.normalize_reward):
        return seen
    return VecNormalize(
        seen,
        norm_obs=config.normalize_observation,
        norm_reward=config.normalize_reward,
        gamma=config.gamma,
    )
