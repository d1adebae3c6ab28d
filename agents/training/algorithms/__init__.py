"""The algorithms of Stable-Baselines3 that this application drives, one per file."""

from __future__ import annotations

from typing import Any, Protocol

from gymnasium.vector import VectorEnv
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from rigid_envs.settings import refusal

from ...config.by_algorithm import Config
from ..gradients import guard_optimizer
from . import dqn, ppo, sac
from .common import Network, Parts
from .extractor import attitudes

__all__ = ["Algorithm", "algorithm_of", "build_model", "check_fit", "iterate", "progress_columns"]


class Algorithm(Protocol):
    """What the file of an algorithm offers."""

    MODEL: Any
    """SB3's class."""
    COUNTERS: tuple[str, ...]
    """Attributes of the model that count, beside those of every model."""
    COLUMNS: tuple[str, ...]
    """What it logs, under SB3's names."""

    def check(self, config: Any, venv: VectorEnv[Any, Any, Any]) -> None:
        """Refuse an environment that the algorithm is not for."""

    def build(self, config: Any, env: VecEnv) -> Any:
        """The untrained model."""

    def iterate(self, model: Any, config: Any, callback: BaseCallback) -> None:
        """One update: play, and learn from it."""

    def parts(self, model: Any) -> Parts:
        """All of the model that learning changes."""

    def network(self, model: Any) -> Network:
        """What chooses the actions."""


_ALGORITHMS: dict[str, Algorithm] = {"ppo": ppo, "sac": sac, "dqn": dqn}
_SHARED_COLUMNS = (
    "time/total_timesteps",
    "time/iterations",
    "rollout/ep_rew_mean",
    "rollout/ep_len_mean",
    "rollout/success_rate",
    "eval/success_rate",
    "eval/mean_reward",
    "eval/mean_ep_length",
    "eval/mean_cost",
)


def algorithm_of(model: BaseAlgorithm) -> Algorithm:
    """The algorithm that a model is of.

    Args:
        model: The model.
    """
    return next(a for a in _ALGORITHMS.values() if isinstance(model, a.MODEL))


def progress_columns(config: Config) -> tuple[str, ...]:
    """What is logged once per update, under SB3's names.

    Args:
        config: What is trained.
    """
    return _SHARED_COLUMNS + _ALGORITHMS[config.algo].COLUMNS


def check_fit(config: Config, venv: VectorEnv[Any, Any, Any]) -> None:
    """Refuse an environment that the algorithm is not for.

    Args:
        config: What is to be trained.
        venv: What on.

    Raises:
        ConfigError: "config.<key>: ...".
    """
    if config.goal_turn and not attitudes(getattr(venv.unwrapped, "task", None)):
        raise refusal("goal_turn", True, f"False: goals of {config.env_id} hold no attitude")
    _ALGORITHMS[config.algo].check(config, venv)


def build_model(config: Config, env: VecEnv) -> Any:
    """The untrained model, whose optimisers refuse gradients that are not finite.

    Args:
        config: What to build.
        env: What to train it on.
    """
    algorithm = _ALGORITHMS[config.algo]
    model = algorithm.build(config, env)
    for optimizer in algorithm.parts(model).optimizers.values():
        guard_optimizer(optimizer)
    return model


def iterate(model: BaseAlgorithm, config: Config, callback: BaseCallback) -> None:
    """One update: play, and learn from it.

    Args:
        model: The model.
        config: What it was built from.
        callback: SB3's hooks.
    """
    algorithm_of(model).iterate(model, config, callback)
