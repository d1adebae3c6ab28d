"""Deep Q-network: discrete actions, replay buffer; with HER in goal environments."""

from __future__ import annotations

from typing import Any

from gymnasium import spaces
from gymnasium.vector import VectorEnv
from stable_baselines3 import DQN
from stable_baselines3.common.vec_env import VecEnv

from ...config.entries import DQNConfig
from .common import Parts, policy_arguments
from .off_policy import check_buffer_size, check_pay, check_space, iterate, off_policy_arguments

__all__ = ["COLUMNS", "COUNTERS", "MODEL", "build", "check", "iterate", "parts"]

MODEL = DQN
COUNTERS: tuple[str, ...] = ("_n_calls", "exploration_rate")
COLUMNS: tuple[str, ...] = (
    "rollout/exploration_rate",
    "train/learning_rate",
    "train/n_updates",
    "train/loss",
)


def check(config: DQNConfig, venv: VectorEnv[Any, Any, Any]) -> None:
    """Refuse continuous actions, or too small a replay buffer.

    Args:
        config: Config of the run.
        venv: Environment to train on.

    Raises:
        ConfigError: "config.algo: ..." or "config.buffer_size: ...".
    """
    check_space(config, venv, spaces.Discrete)
    check_buffer_size(config, venv)
    check_pay(config, venv)


def build(config: DQNConfig, env: VecEnv) -> DQN:
    """The untrained model.

    Args:
        config: Config of the run.
        env: Environment to train on.
    """
    return DQN(
        target_update_interval=config.target_update_interval,
        exploration_fraction=config.exploration_fraction,
        exploration_initial_eps=config.exploration_initial_eps,
        exploration_final_eps=config.exploration_final_eps,
        max_grad_norm=config.max_grad_norm,
        policy_kwargs=policy_arguments(config, env),
        **off_policy_arguments(config, env),
    )


def parts(model: DQN) -> Parts:
    """See `Parts`."""
    return Parts(model.policy.state_dict(), {"policy": model.policy.optimizer})
