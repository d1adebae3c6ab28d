"""The algorithms of Stable-Baselines3 that this application drives, one per file."""

from __future__ import annotations

from typing import Any, Protocol

from gymnasium.vector import VectorEnv
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from rigid_envs.base.settings import refusal
from rigid_envs.sb3.exporting import attitudes

from ...config.entries import Config
from ...environments import part_for
from . import dqn, ppo, sac, tqc
from .common import Parts, guard_optimizer

__all__ = ["Algorithm", "algorithm_of", "build_model", "check_fit", "iterate", "progress_columns"]


class Algorithm(Protocol):
    """Interface of the module of an algorithm."""

    MODEL: Any
    """SB3's class."""
    COUNTERS: tuple[str, ...]
    """Counters of the model, besides those of every model."""
    COLUMNS: tuple[str, ...]
    """Columns that it logs, under SB3's names."""

    def check(self, config: Any, venv: VectorEnv[Any, Any, Any]) -> None:
        """Refuse an environment that the algorithm is not for."""

    def build(self, config: Any, env: VecEnv) -> Any:
        """The untrained model."""

    def iterate(self, model: Any, config: Any, callback: BaseCallback) -> None:
        """One update: collect steps, then gradient steps."""

    def parts(self, model: Any) -> Parts:
        """Trainable parts of the model."""


_ALGORITHMS: dict[str, Algorithm] = {"ppo": ppo, "sac": sac, "tqc": tqc, "dqn": dqn}
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
    """The module of the algorithm of a model.

    Args:
        model: SB3 model.
    """
    return next(a for a in _ALGORITHMS.values() if isinstance(model, a.MODEL))


def progress_columns(config: Config) -> tuple[str, ...]:
    """Columns of `progress.csv`, under SB3's names.

    Args:
        config: Config of the run.
    """
    return _SHARED_COLUMNS + _ALGORITHMS[config.algo].COLUMNS


def check_fit(config: Config, venv: VectorEnv[Any, Any, Any]) -> None:
    """Refuse an environment that the algorithm is not for.

    Args:
        config: Config of the run.
        venv: Environment to train on.

    Raises:
        ConfigError: "config.<key>: ...".
    """
    if config.goal_turn and not attitudes(getattr(venv.unwrapped, "task", None)):
        raise refusal("goal_turn", True, f"False: goals of {config.env_id} hold no attitude")
    if config.goal_turn and part_for(config.env_kwargs, venv.single_observation_space) is not None:
        raise refusal("goal_turn", True, "False: networks read no goals in the reduced frame")
    _ALGORITHMS[config.algo].check(config, venv)


def build_model(config: Config, env: VecEnv) -> Any:
    """The untrained model, whose optimisers refuse gradients that are not finite.

    Args:
        config: Config of the run.
        env: Environment to train on.
    """
    algorithm = _ALGORITHMS[config.algo]
    model = algorithm.build(config, env)
    for optimizer in algorithm.parts(model).optimizers.values():
        guard_optimizer(optimizer)
    return model


def iterate(model: BaseAlgorithm, config: Config, callback: BaseCallback) -> None:
    """One update: collect steps, then gradient steps.

    Args:
        model: SB3 model.
        config: Config of the run.
        callback: Hooks of SB3.
    """
    algorithm_of(model).iterate(model, config, callback)
