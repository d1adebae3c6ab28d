"""Common to all algorithms: constructor arguments, trainable parts, layers for export."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.type_aliases import Schedule
from stable_baselines3.common.vec_env import VecEnv
from torch import nn
from torch.optim import Optimizer

from rigid_envs.scores.starts import row_seeds

from ...config.by_algorithm import Config
from ...policies.activations import ACTIVATIONS
from .extractor import AttitudeExtractor, attitudes

__all__ = ["Network", "Parts", "arguments", "layers", "policy_arguments"]

Arrays = dict[str, NDArray[Any]]

_WINDOW = 500  # episodes that the means of a rollout are over: two of each of 256 rows


class Parts(NamedTuple):
    """Trainable parts of a model.

    Attributes:
        weights: Tensors by name, the live ones.
        optimizers: Optimisers by name.
    """

    weights: dict[str, torch.Tensor]
    optimizers: dict[str, Optimizer]


class Network(NamedTuple):
    """Network of a policy, free of SB3.

    Attributes:
        head: Action distribution; a key of `policies.heads.HEADS`.
        arrays: The layers, and what the head needs.
    """

    head: str
    arrays: Arrays


def arguments(config: Config, env: VecEnv) -> dict[str, Any]:
    """Constructor arguments of every algorithm of SB3.

    Args:
        config: Config of the run.
        env: Environment to train on.
    """
    several = isinstance(env.observation_space, spaces.Dict)
    return {
        "policy": "MultiInputPolicy" if several else "MlpPolicy",
        "env": env,
        "learning_rate": _schedule(config.learning_rate),
        "gamma": config.gamma,
        "stats_window_size": _WINDOW,
        # SB3 takes 32 bits: a hash of all 64 keeps seeds apart that agree in the lower half.
        "seed": row_seeds(config.seed, 1, "learner")[0] % 2**32,
        "device": "cpu",
    }


def policy_arguments(config: Config, env: VecEnv, eps: float = 1e-8) -> dict[str, Any]:
    """SB3's `policy_kwargs`, common to all algorithms.

    Args:
        config: Config of the run.
        env: Environment to train on.
        eps: Of Adam, as SB3 has it for the algorithm.
    """
    plain = {
        "net_arch": list(config.net_arch),
        "activation_fn": ACTIVATIONS[config.activation],
        # one pass over small tensors, where the default takes a dozen for each
        "optimizer_kwargs": {"fused": True, "eps": eps},
    }
    if not config.goal_turn:
        return plain
    return {
        **plain,
        "features_extractor_class": AttitudeExtractor,
        "features_extractor_kwargs": attitudes(env.get_attr("task", [0])[0]),
    }


def layers(modules: Iterable[nn.Module]) -> Arrays:
    """Weights and biases of linear layers, under the names of a policy file.

    Args:
        modules: Modules in the order that they are applied; others than linear ones are left out.
    """
    arrays: Arrays = {}
    linear = [module for module in modules if isinstance(module, nn.Linear)]
    for k, layer in enumerate(linear):
        arrays[f"layers.{k}.weight"] = layer.weight.detach().numpy()
        arrays[f"layers.{k}.bias"] = layer.bias.detach().numpy()
    return arrays


def _schedule(rate: float | tuple[float, float]) -> float | Schedule:
    if not isinstance(rate, tuple):
        return rate
    start, end = rate
    # The last update can lie beyond the end of the run, where SB3's progress turns negative.
    return lambda remaining: end + (start - end) * max(remaining, 0.0)
