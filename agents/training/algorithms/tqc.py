"""Truncated quantile critics: SAC with distributions as critics; with HER in goal environments."""

from __future__ import annotations

from sb3_contrib import TQC
from stable_baselines3.common.vec_env import VecEnv

from ...config.entries import TQCConfig
from .common import policy_arguments
from .off_policy import iterate, off_policy_arguments
from .sac import COLUMNS, COUNTERS, check, parts

__all__ = ["COLUMNS", "COUNTERS", "MODEL", "build", "check", "iterate", "parts"]

MODEL = TQC


def build(config: TQCConfig, env: VecEnv) -> TQC:
    """The untrained model.

    Args:
        config: Config of the run.
        env: Environment to train on.
    """
    return TQC(
        ent_coef=config.ent_coef,
        top_quantiles_to_drop_per_net=config.n_dropped,
        policy_kwargs={**policy_arguments(config, env), "n_quantiles": config.n_quantiles},
        **off_policy_arguments(config, env),
    )
