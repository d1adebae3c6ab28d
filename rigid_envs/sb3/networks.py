"""Networks of the policies of Stable-Baselines3's models, as policy files hold them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.torch_layers import CombinedExtractor, FlattenExtractor
from torch import Tensor, nn

from rigid_envs.errors import ConfigError
from rigid_envs.policies.layers import ACTIVATIONS
from rigid_envs.sb3.extractor import AttitudeExtractor

__all__ = ["Network", "network_of"]

Arrays = dict[str, NDArray[Any]]

_ACTIVATIONS: dict[type[nn.Module], str] = {
    nn.Tanh: "tanh",
    **{kind: name for name, kind in ACTIVATIONS.items()},
}
_EXTRACTORS = (FlattenExtractor, CombinedExtractor, AttitudeExtractor)


class Network(NamedTuple):
    """A multilayer perceptron and its action distribution.

    Attributes:
        head: Action distribution; one of `rigid_envs.policies.arrays.HEADS`.
        activation: Of the hidden layers, by name.
        attitudes: Where two rotation matrices are in the inputs, whose relative rotations the
            first layer takes too; None if it does not.
        arrays: The layers, and what the head needs.
    """

    head: str
    activation: str
    attitudes: list[int] | None
    arrays: Arrays


def network_of(model: Any) -> Network:
    """The network of the policy of a model.

    Args:
        model: A model of PPO, A2C, SAC, TQC or DQN.

    Raises:
        ConfigError: Another algorithm, or a part of the policy that policy files do not hold;
            names it.
    """
    kinds = [f"{kind.__module__.partition('.')[0]}.{kind.__name__}" for kind in type(model).__mro__]
    algorithm = next((kind for kind in kinds if kind in _READERS), None)
    if algorithm is None:
        known = ", ".join(name.partition(".")[2] for name in _READERS)
        raise ConfigError(f"model = {type(model).__name__}; expected one of {known}")
    policy = model.policy
    if type(policy).__module__.partition(".")[0] not in ("stable_baselines3", "sb3_contrib"):
        raise _refusal("policy", type(policy).__name__, "MlpPolicy or MultiInputPolicy")
    if policy.features_extractor_class not in _EXTRACTORS:
        known = ", ".join(kind.__name__ for kind in _EXTRACTORS)
        raise _refusal("features_extractor_class", policy.features_extractor_class.__name__, known)
    if getattr(model, "use_sde", False):
        raise _refusal("use_sde", True, "False: its actions need the state of its noise")
    modules, head, more = _READERS[algorithm](model)
    arrays, activation = _layers(modules)
    told = list(policy.features_extractor_kwargs.values())
    turned = policy.features_extractor_class is AttitudeExtractor
    return Network(head, activation, told if turned else None, arrays | more)


_Reader = Callable[[Any], tuple[Sequence[nn.Module], str, Arrays]]
"""Modules from the features to the parameters of the distribution, its name, and its arrays."""


def _actor_critic(model: Any) -> tuple[Sequence[nn.Module], str, Arrays]:
    modules = [*model.policy.mlp_extractor.policy_net, model.policy.action_net]
    if isinstance(model.action_space, spaces.Discrete):
        return modules, "categorical", {}
    box = _bounds(model.action_space)
    return modules, "gaussian", {"log_std": _numbers(model.policy.log_std), **box}


def _squashed(model: Any) -> tuple[Sequence[nn.Module], str, Arrays]:
    actor = model.actor
    spread, _ = _layers([actor.log_std])
    arrays = {
        "log_std.weight": spread["layers.0.weight"],
        "log_std.bias": spread["layers.0.bias"],
        **_bounds(model.action_space),
    }
    return [*actor.latent_pi, actor.mu], "squashed gaussian", arrays


def _greedy(model: Any) -> tuple[Sequence[nn.Module], str, Arrays]:
    return list(model.q_net.q_net), "greedy", {}


_READERS: dict[str, _Reader] = {
    "stable_baselines3.PPO": _actor_critic,
    "stable_baselines3.A2C": _actor_critic,
    "stable_baselines3.SAC": _squashed,
    "sb3_contrib.TQC": _squashed,
    "stable_baselines3.DQN": _greedy,
}


def _bounds(space: spaces.Space[Any]) -> Arrays:
    if not isinstance(space, spaces.Box):
        raise _refusal("action_space", space, "Box or Discrete")
    return {"action.low": space.low, "action.high": space.high}


def _layers(modules: Sequence[nn.Module]) -> tuple[Arrays, str]:
    """Weights and biases under the names of a policy file, and the activation between them."""
    arrays: Arrays = {}
    for k, layer in enumerate(modules[::2]):
        if not isinstance(layer, nn.Linear):
            raise _refusal("layer", layer, "linear layers with an activation between them")
        arrays[f"layers.{k}.weight"] = _numbers(layer.weight)
        arrays[f"layers.{k}.bias"] = _numbers(layer.bias)
    between = {_name(module) for module in modules[1::2]}
    if len(between) > 1:
        raise _refusal("activation_fn", ", ".join(sorted(between)), "one for all hidden layers")
    return arrays, next(iter(between), "tanh")


def _name(module: nn.Module) -> str:
    """Name of an activation."""
    if type(module) not in _ACTIVATIONS or getattr(module, "alpha", 1.0) != 1.0:
        known = ", ".join(sorted({kind.__name__ for kind in _ACTIVATIONS}))
        raise _refusal("activation_fn", module, known)
    return _ACTIVATIONS[type(module)]


def _numbers(tensor: Tensor) -> NDArray[Any]:
    return np.asarray(tensor.detach().cpu().numpy())


def _refusal(name: str, value: Any, expected: str) -> ConfigError:
    return ConfigError(f"model: {name} = {value!s:.100}; expected {expected}")
