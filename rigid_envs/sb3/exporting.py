"""Policies of Stable-Baselines3's models in files that need neither it nor torch."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import (
    VecCheckNan,
    VecEnv,
    VecEnvWrapper,
    VecExtractDictObs,
    VecMonitor,
    VecNormalize,
)

from rigid_envs.catalogue import task_of
from rigid_envs.envs.task_spaces import observation_space
from rigid_envs.errors import ConfigError
from rigid_envs.kernels.cache import kernel_hash
from rigid_envs.policies import CompiledPolicy, write_policy
from rigid_envs.provenance import commit, versions
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.sb3.networks import network_of

__all__ = ["contents", "export"]

_PACKAGES = ("gymnasium", "numba", "numpy", "stable-baselines3", "torch")


def export(model: BaseAlgorithm, path: str | Path) -> Path:
    """Write the policy of a model into a file that `rigid_envs.load` plays without torch.

    Args:
        model: A model of PPO, A2C, SAC, TQC or DQN that has its environment; its policy is a
            multilayer perceptron (MlpPolicy, MultiInputPolicy) of tanh, ReLU, ELU or SiLU.
            Observations scaled by VecNormalize stay so.
        path: File to write, ``NAME.safetensors``; its folder is made if it is not there.

    Returns:
        The file.

    Raises:
        ConfigError: A model or environment that a policy file does not hold; names what.
        ValueError: Weights that are not finite, or more layers than a policy file holds.
    """
    file = Path(path)
    if file.suffix != ".safetensors":
        raise ConfigError(f"path = {path}; expected a file NAME.safetensors")
    env_id, env_kwargs = _origin(model)
    document, arrays = contents(model, env_id, env_kwargs)
    CompiledPolicy(document, arrays)  # refuses what could not be loaded
    file.parent.mkdir(parents=True, exist_ok=True)
    return write_policy(file, document, arrays)


def contents(
    model: BaseAlgorithm, env_id: str, env_kwargs: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Document and arrays of the file of a policy; see `rigid_envs.policies.StoredPolicy`.

    Args:
        model: See `export`.
        env_id: The environment that it was trained on.
        env_kwargs: Its settings.

    Raises:
        ConfigError: See `export`.
    """
    network, env = network_of(model), _environment(model)
    scaled: Any = model.get_vec_normalize_env()
    normalized = scaled is not None and scaled.norm_obs
    statistics = _statistics(scaled, model.observation_space) if normalized else {}
    document = {
        "algo": type(model).__name__.lower(),
        "env_id": env_id,
        "env_kwargs": dict(env_kwargs),
        "seed": model.seed,
        "timesteps": model.num_timesteps,
        "network": {
            "activation": network.activation,
            "distribution": network.head,
            "inputs": _inputs(model, env),
            "attitudes": network.attitudes,
            "normalized": normalized,
            "clip": scaled.clip_obs if normalized else None,
            "epsilon": scaled.epsilon if normalized else None,
        },
        "spaces": {
            "observation": str(env.unwrapped.observation_space),
            "action": str(model.action_space),
        },
        "versions": versions(_PACKAGES),
        **_sources(),
    }
    return document, {**network.arrays, **statistics}


@functools.cache
def _sources() -> dict[str, Any]:
    """Commit and kernels; asked for once, for git takes a while."""
    return {**commit(), "kernel_hash": kernel_hash()}


def _environment(model: BaseAlgorithm) -> VecEnv:
    env = model.get_env()
    if env is None:
        raise ConfigError("model: env = None; expected the environment of its training: set_env")
    return env


def _origin(model: BaseAlgorithm) -> tuple[str, dict[str, Any]]:
    """Id and settings of the environment of a model, whose observations are those of the id."""
    env = _environment(model).unwrapped
    spec = env.get_attr("spec", [0])[0]
    if spec is None:
        raise ConfigError("model: env has no spec; expected an environment of a registered id")
    if spec.id not in ENVIRONMENTS:
        return spec.id, {}
    known = asdict(task_of(spec.id))
    settings = {key: value for key, value in spec.kwargs.items() if key in known}
    if env.observation_space != observation_space(task_of(spec.id, settings)):
        raise ConfigError(
            f"model: observations are not those of {spec.id}; expected them without wrappers of "
            "the environment: what those do is not in a policy file"
        )
    return spec.id, settings


def _inputs(model: BaseAlgorithm, env: VecEnv) -> list[list[Any]] | None:
    """Names and sizes of the parts of an observation, in the order that the network takes them."""
    part = _part(env)
    seen = model.observation_space
    parts = seen.spaces if isinstance(seen, spaces.Dict) else {part or "observation": seen}
    for name, space in parts.items():
        if not (isinstance(space, spaces.Box) and len(space.shape) == 1):
            raise ConfigError(f"model: {name} = {space}; expected a Box of one axis")
    if part is None and not isinstance(seen, spaces.Dict):
        return None
    return [[name, spaces.flatdim(space)] for name, space in parts.items()]


def _part(env: VecEnv) -> str | None:
    """The one part of a dictionary that a model sees; None if it sees all."""
    part = None
    while isinstance(env, VecEnvWrapper):
        if isinstance(env, VecExtractDictObs):
            part = env.key
        elif not isinstance(env, VecNormalize | VecMonitor | VecCheckNan):
            raise ConfigError(
                f"model: env = {type(env).__name__}; expected no wrapper that changes observations "
                "but VecNormalize and VecExtractDictObs"
            )
        env = env.venv
    return part


def _statistics(scaled: VecNormalize, seen: spaces.Space[Any]) -> dict[str, NDArray[np.float64]]:
    """Means and variances, in the order of the inputs."""
    running: Any = scaled.obs_rms
    if isinstance(seen, spaces.Dict) and set(running) != set(seen):
        raise ConfigError(
            f"model: norm_obs_keys = {list(running)}; expected all parts: {list(seen)}"
        )
    each = [running[name] for name in seen] if isinstance(seen, spaces.Dict) else [running]
    return {
        "observation.mean": np.concatenate([statistic.mean for statistic in each]),
        "observation.var": np.concatenate([statistic.var for statistic in each]),
    }
