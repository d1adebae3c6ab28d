"""Check of gradients for NaN and infinity, before a weight follows them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.type_aliases import Schedule
from stable_baselines3.common.vec_env import VecEnv
from torch.optim import Optimizer

from rigid_envs.sb3.adapter import NonFiniteError
from rigid_envs.sb3.exporting import AttitudeExtractor, attitudes
from rigid_envs.scores.layers import ACTIVATIONS
from rigid_envs.scores.starts import row_seeds

from ...config.entries import Config

# Check of gradients for NaN and infinity, before a weight follows them.


def guard_optimizer(optimizer: Optimizer) -> None:
    """Make an optimiser refuse gradients that are not finite.

    A loss that is NaN has gradients that are NaN, and so has a loss that is infinite after the
    clipping of the norm; so this is the one place to look, whatever the algorithm.
    """
    optimizer.register_step_pre_hook(_refuse_bad_gradients)


def _refuse_bad_gradients(optimizer: Optimizer, *_: Any) -> None:
    gradients = [p.grad for group in optimizer.param_groups for p in group["params"]]
    present = [gradient for gradient in gradients if gradient is not None]
    if not math.isfinite(torch.nn.utils.get_total_norm(present).item()):
        raise NonFiniteError(
            "the gradient of the loss is not finite; no weight has followed it. "
            "Try a lower learning_rate, or max_grad_norm"
        )


# Common to all algorithms: constructor arguments, trainable parts, layers for export.

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


def _schedule(rate: float | tuple[float, float]) -> float | Schedule:
    if not isinstance(rate, tuple):
        return rate
    start, end = rate
    # The last update can lie beyond the end of the run, where SB3's progress turns negative.
    return lambda remaining: end + (start - end) * max(remaining, 0.0)
