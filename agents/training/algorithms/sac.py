"""Soft actor-critic: continuous actions, replay buffer; with HER in goal environments."""

from __future__ import annotations

from typing import Any

from gymnasium import spaces
from gymnasium.vector import VectorEnv
from sb3_contrib import TQC
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecEnv

from ...config.entries import SACConfig
from .common import Parts, policy_arguments
from .off_policy import check_buffer_size, check_pay, check_space, iterate, off_policy_arguments

__all__ = ["COLUMNS", "COUNTERS", "MODEL", "build", "check", "iterate", "parts"]

MODEL = SAC
COUNTERS: tuple[str, ...] = ()
COLUMNS: tuple[str, ...] = (
    "train/learning_rate",
    "train/n_updates",
    "train/actor_loss",
    "train/critic_loss",
    "train/ent_coef",
    "train/ent_coef_loss",
)


def check(config: SACConfig, venv: VectorEnv[Any, Any, Any]) -> None:
    """Refuse discrete actions, or too small a replay buffer.

    Args:
        config: Config of the run.
        venv: Environment to train on.

    Raises:
        ConfigError: "config.algo: ..." or "config.buffer_size: ...".
    """
    check_space(config, venv, spaces.Box)
    check_buffer_size(config, venv)
    check_pay(config, venv)


def build(config: SACConfig, env: VecEnv) -> SAC:
    """The untrained model.

    Args:
        config: Config of the run.
        env: Environment to train on.
    """
    return SAC(
        ent_coef=config.ent_coef,
        policy_kwargs=policy_arguments(config, env),
        **off_policy_arguments(config, env),
    )


def parts(model: SAC | TQC) -> Parts:
    """See `Parts`."""
    weights = dict(model.policy.state_dict())
    optimizers = {"actor": model.actor.optimizer, "critic": model.critic.optimizer}
    if model.ent_coef_optimizer is not None:
        assert model.log_ent_coef is not None
        weights["log_ent_coef"] = model.log_ent_coef.detach()
        optimizers["ent_coef"] = model.ent_coef_optimizer
    return Parts(weights, optimizers)
