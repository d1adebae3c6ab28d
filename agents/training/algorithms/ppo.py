"""Proximal policy optimisation: on-policy, continuous or discrete actions."""

from __future__ import annotations

import math
from typing import Any

import torch
from gymnasium import spaces
from gymnasium.vector import VectorEnv
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from rigid_envs.base.settings import refusal

from ...config.entries import PPOConfig
from .common import Parts, arguments, policy_arguments

__all__ = ["COLUMNS", "COUNTERS", "MODEL", "build", "check", "iterate", "parts"]

MODEL = PPO
COUNTERS: tuple[str, ...] = ()
COLUMNS: tuple[str, ...] = (
    "train/learning_rate",
    "train/clip_range",
    "train/n_updates",
    "train/loss",
    "train/policy_gradient_loss",
    "train/value_loss",
    "train/entropy_loss",
    "train/approx_kl",
    "train/clip_fraction",
    "train/explained_variance",
    "train/std",
)


def check(config: PPOConfig, venv: VectorEnv[Any, Any, Any]) -> None:
    """Refuse a spread of actions where they are choices.

    Args:
        config: Config of the run.
        venv: Environment to train on.

    Raises:
        ConfigError: "config.action_std: ...".
    """
    if config.action_std is not None and not isinstance(venv.single_action_space, spaces.Box):
        raise refusal("action_std", config.action_std, f"null: {config.env_id} has choices")


def build(config: PPOConfig, env: VecEnv) -> PPO:
    """The untrained model.

    Args:
        config: Config of the run.
        env: Environment to train on.
    """
    model = PPO(
        n_steps=config.n_steps,
        batch_size=config.batch_size,
        n_epochs=config.n_epochs,
        gae_lambda=config.gae_lambda,
        clip_range=config.clip_range,
        ent_coef=config.ent_coef,
        vf_coef=config.vf_coef,
        max_grad_norm=config.max_grad_norm,
        target_kl=config.target_kl,
        policy_kwargs={
            **policy_arguments(config, env, eps=1e-5),
            "log_std_init": config.log_std_init,
        },
        **arguments(config, env),
    )
    if config.action_std is not None:
        model.policy.log_std.requires_grad_(False)
    return model


def iterate(model: PPO, config: PPOConfig, callback: BaseCallback) -> None:
    """One update: `n_steps` of every row, then `n_epochs` of gradient steps.

    Args:
        model: SB3 model.
        config: Config of the run.
        callback: Hooks of SB3.
    """
    assert model.env is not None
    if config.action_std is not None:
        share = model.num_timesteps / config.total_timesteps
        start, end = (math.log(std) for std in config.action_std)
        with torch.no_grad():
            model.policy.log_std.fill_(start + share * (end - start))
    model.collect_rollouts(model.env, callback, model.rollout_buffer, model.n_steps)
    model._update_current_progress_remaining(model.num_timesteps, config.total_timesteps)
    model.train()


def parts(model: PPO) -> Parts:
    """See `Parts`."""
    return Parts(model.policy.state_dict(), {"policy": model.policy.optimizer})
