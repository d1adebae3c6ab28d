"""Export of the policy of a model in training."""

from __future__ import annotations

from stable_baselines3.common.base_class import BaseAlgorithm

from rigid_envs.sb3.exporting import contents

from ..config.by_algorithm import Config
from ..policies.mlp import Policy

__all__ = ["export_policy"]


def export_policy(model: BaseAlgorithm, config: Config) -> Policy:
    """The policy of a model.

    Args:
        model: SB3 model.
        config: Config of the run.
    """
    document, arrays = contents(model, config.env_id, config.env_kwargs)
    return Policy({**document, "seed": config.seed}, arrays)
