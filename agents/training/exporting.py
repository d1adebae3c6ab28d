"""Export of the policy of a model in training."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm

from rigid_envs.sb3.exporting import contents

from ..config.by_algorithm import Config
from ..policies.mlp import Policy

__all__ = ["export_policy", "with_gain"]


def export_policy(model: BaseAlgorithm, config: Config) -> Policy:
    """The policy of a model.

    Args:
        model: SB3 model.
        config: Config of the run.
    """
    document, arrays = contents(model, config.env_id, config.env_kwargs)
    return Policy({**document, "seed": config.seed}, arrays)


def with_gain(arrays: Mapping[str, NDArray[Any]], gain: float) -> dict[str, NDArray[Any]]:
    """Arrays of a Gaussian policy whose actions are those of another times a factor.

    Args:
        arrays: Arrays of its file.
        gain: The factor.
    """
    last = sum(name.startswith("layers.") and name.endswith(".weight") for name in arrays) - 1
    factor = np.float32(gain)
    scaled = {
        name: arrays[name] * factor for name in (f"layers.{last}.weight", f"layers.{last}.bias")
    }
    return {**arrays, **scaled, "log_std": arrays["log_std"] + np.float32(math.log(gain))}
