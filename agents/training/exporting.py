"""Export of the policy of an SB3 model, free of SB3."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm

from rigid_envs.kernels.cache import kernel_hash
from rigid_envs.provenance import commit

from ..config.by_algorithm import Config
from ..environments.factory import part_for
from ..policies.mlp import Policy
from ..storage.manifest import manifest
from .algorithms import algorithm_of

__all__ = ["export_policy"]


def export_policy(model: BaseAlgorithm, config: Config) -> Policy:
    """The policy of a model.

    Args:
        model: SB3 model.
        config: Config of the run.
    """
    network = algorithm_of(model).network(model)
    env = model.get_env()
    assert env is not None
    space = env.unwrapped.observation_space
    normalize: Any = model.get_vec_normalize_env()
    normalized = normalize is not None and normalize.norm_obs
    document = {
        "algo": config.algo,
        "env_id": config.env_id,
        "env_kwargs": dict(config.env_kwargs),
        "seed": config.seed,
        "timesteps": model.num_timesteps,
        "network": {
            "activation": config.activation,
            "distribution": network.head,
            "inputs": _inputs(config, space),
            "attitudes": list(model.policy.features_extractor_kwargs.values()) or None,
            "normalized": normalized,
            "clip": normalize.clip_obs if normalized else None,
            "epsilon": normalize.epsilon if normalized else None,
        },
        "spaces": {"observation": str(space), "action": str(model.action_space)},
        "versions": manifest()["versions"],
        **_sources(),
    }
    statistics = _statistics(normalize) if normalized else {}
    return Policy(document, {**network.arrays, **statistics})


@functools.cache
def _sources() -> dict[str, Any]:
    """Commit and kernels; asked for once, for git takes a while."""
    return {**commit(), "kernel_hash": kernel_hash()}


def _inputs(config: Config, space: spaces.Space[Any]) -> list[list[Any]] | None:
    """Names and sizes of the parts of an observation, in the order that the network takes them."""
    if not isinstance(space, spaces.Dict):
        return None
    alone = part_for(config.env_kwargs, space)
    return [[name, spaces.flatdim(part)] for name, part in space.items() if alone in (None, name)]


def _statistics(normalize: Any) -> dict[str, NDArray[np.float64]]:
    running = normalize.obs_rms
    each = list(running.values()) if isinstance(running, dict) else [running]
    return {
        "observation.mean": np.concatenate([statistic.mean for statistic in each]),
        "observation.var": np.concatenate([statistic.var for statistic in each]),
    }
