"""Models of Stable-Baselines3 as policy files."""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common import vec_env
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.torch_layers import CombinedExtractor, FlattenExtractor
from torch import Tensor, nn

from rigid_envs.base.checks import ConfigError
from rigid_envs.engine.compiler import kernel_hash
from rigid_envs.engine.provenance import commit, cpu_name, versions
from rigid_envs.envs.lookup import task_of
from rigid_envs.envs.spaces import observation_space
from rigid_envs.scores.trained import N_ROTATIONS, CompiledPolicy, write_policy
from rigid_envs.tasks.registry import ENVIRONMENTS

# Layers that SB3 does not have: a fast tanh, and the relative rotation of two attitudes.


class _Tanh(torch.autograd.Function):
    """tanh(x) = 2 sigmoid(2 x) - 1, in place; the error is at most 2e-7, some roundings of float32.

    Torch takes its tanh from the Math Kernel Library, which is slow on processors of AMD: twice as
    slow as this one. On others it is twice as fast.
    """

    @staticmethod
    def forward(ctx: Any, x: Tensor) -> Tensor:
        y = torch.sigmoid(2.0 * x).mul_(2.0).sub_(1.0)
        ctx.save_for_backward(y)
        return y

    @staticmethod
    def backward(ctx: Any, *gradients: Any) -> Any:
        (y,) = ctx.saved_tensors
        return torch.ops.aten.tanh_backward(gradients[0], y)


class Tanh(nn.Module):
    """Hyperbolic tangent, by torch's sigmoid."""

    def forward(self, x: Tensor) -> Tensor:
        """Shape as x."""
        y: Tensor = _Tanh.apply(x)  # type: ignore[no-untyped-call]
        return y


_MKL: Any = torch.backends.mkl
_MKL_IS_SLOW = _MKL.is_available() and "AMD" in cpu_name()

ACTIVATIONS: dict[str, type[nn.Module]] = {
    "tanh": Tanh if _MKL_IS_SLOW else nn.Tanh,
    "relu": nn.ReLU,
    "elu": nn.ELU,
    "silu": nn.SiLU,
}
"""By the name that a config and a policy file give them."""


class AttitudeExtractor(CombinedExtractor):
    """Concatenated parts of an observation, then ``R^T R'`` and ``R' R^T`` of two attitudes in it.

    They are the rotation from one to the other, in body and in world axes. The action depends on
    nothing else, and linear layers learn products of their inputs slowly.
    """

    def __init__(self, observation_space: spaces.Dict, achieved: int, desired: int) -> None:
        """As SB3's, with the indices at which the nine entries of R and R', row by row, begin."""
        super().__init__(observation_space)
        self._places = achieved, desired
        self._features_dim += N_ROTATIONS

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Shape (N, n + 18)."""
        return turned(super().forward(observations), *self._places)


def turned(inputs: Tensor, achieved: int, desired: int) -> Tensor:
    """Inputs, shape (..., n), and behind them the relative rotations of two matrices in them."""
    shape = (*inputs.shape[:-1], 3, 3)
    here, there = (inputs[..., at : at + 9].reshape(shape) for at in (achieved, desired))
    back = here.mT
    return torch.cat([inputs, (back @ there).flatten(-2), (there @ back).flatten(-2)], dim=-1)


def attitudes(task: Any) -> dict[str, int]:
    """Indices in the input at which the rotation matrices of both goals begin; empty without.

    Args:
        task: The task of an environment; None for one that has none.
    """
    symbols = [] if task is None else [entry.symbol for entry in task.features()[: task.n_goal]]
    if "R11" not in symbols:
        return {}
    at = symbols.index("R11")  # SB3 puts the parts in the order of their names: achieved_goal first
    return {"achieved": at, "desired": at + task.n_goal}


# Networks of the policies of Stable-Baselines3's models, as policy files hold them.

Arrays = dict[str, NDArray[Any]]

_ACTIVATIONS: dict[type[nn.Module], str] = {
    nn.Tanh: "tanh",
    **{kind: name for name, kind in ACTIVATIONS.items()},
}
_EXTRACTORS = (FlattenExtractor, CombinedExtractor, AttitudeExtractor)


class Network(NamedTuple):
    """A multilayer perceptron and its action distribution.

    Attributes:
        head: Action distribution; one of `rigid_envs.scores.trained.HEADS`.
        activation: Of the hidden layers, by name.
        attitudes: Where two rotation matrices are in the inputs, whose relative rotations the
            first layer takes too; None if it does not.
        arrays: The layers, what the head needs, and the value network of PPO and A2C.
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


def layers_of(model: Any) -> tuple[list[nn.Module], list[nn.Module]]:
    """Layers of the policy and of the value network of PPO and A2C, with their activations."""
    policy, hidden = model.policy, model.policy.mlp_extractor
    return [*hidden.policy_net, policy.action_net], [*hidden.value_net, policy.value_net]


def _actor_critic(model: Any) -> tuple[Sequence[nn.Module], str, Arrays]:
    modules, values = layers_of(model)
    arrays, _ = _layers(values, "value")
    if isinstance(model.action_space, spaces.Discrete):
        return modules, "categorical", arrays
    box = _bounds(model.action_space)
    return modules, "gaussian", arrays | {"log_std": _numbers(model.policy.log_std), **box}


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


def _layers(modules: Sequence[nn.Module], prefix: str = "layers") -> tuple[Arrays, str]:
    """Weights and biases under the names of a policy file, and the activation between them."""
    arrays: Arrays = {}
    for k, layer in enumerate(modules[::2]):
        if not isinstance(layer, nn.Linear):
            raise _refusal("layer", layer, "linear layers with an activation between them")
        arrays[f"{prefix}.{k}.weight"] = _numbers(layer.weight)
        arrays[f"{prefix}.{k}.bias"] = _numbers(layer.bias)
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


# Policies of Stable-Baselines3's models in files that need neither it nor torch.

_PACKAGES = ("gymnasium", "numba", "numpy", "stable-baselines3", "torch")


def export(model: BaseAlgorithm, path: str | Path) -> Path:
    """Write the policy of a model into a file that `rigid_envs.load` plays without torch.

    Args:
        model: A model of PPO, A2C, SAC, TQC or DQN that has its environment; its policy is a
            multilayer perceptron (MlpPolicy, MultiInputPolicy) of tanh, ReLU, ELU or SiLU.
            Observations scaled by VecNormalize stay so. The file keeps the value network of PPO and
            A2C, from which `load_model` goes on.
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
    """Document and arrays of the file of a policy; see `rigid_envs.scores.trained.CompiledPolicy`.

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


def _environment(model: BaseAlgorithm) -> vec_env.VecEnv:
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


def _inputs(model: BaseAlgorithm, env: vec_env.VecEnv) -> list[list[Any]] | None:
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


def _part(env: vec_env.VecEnv) -> str | None:
    """The one part of a dictionary that a model sees; None if it sees all."""
    part = None
    while isinstance(env, vec_env.VecEnvWrapper):
        if isinstance(env, vec_env.VecExtractDictObs):
            part = env.key
        elif not isinstance(env, vec_env.VecNormalize | vec_env.VecMonitor | vec_env.VecCheckNan):
            expected = "no wrapper that changes observations but VecNormalize and VecExtractDictObs"
            raise _refusal("env", type(env).__name__, expected)
        env = env.venv
    return part


def _statistics(scaled: vec_env.VecNormalize, seen: spaces.Space[Any]) -> Arrays:
    """Means and variances, in the order of the inputs."""
    running: Any = scaled.obs_rms
    if isinstance(seen, spaces.Dict) and set(running) != set(seen):
        raise _refusal("norm_obs_keys", list(running), f"all parts: {list(seen)}")
    each = [running[name] for name in seen] if isinstance(seen, spaces.Dict) else [running]
    return {
        "observation.mean": np.concatenate([statistic.mean for statistic in each]),
        "observation.var": np.concatenate([statistic.var for statistic in each]),
    }
