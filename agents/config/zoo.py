"""Shipped configs as hyperparameter files of RL Baselines3 Zoo."""

from __future__ import annotations

import dataclasses
from typing import Any

import yaml
from gymnasium import spaces

from rigid_envs.tasks.registry import ENVIRONMENTS

from ..environments import make, part_for
from .entries import ALGORITHMS, Config, PPOConfig, config_from, config_to_dict
from .reading import recipe_for

__all__ = ["ALGOS", "hyperparameters", "zoo_config", "zoo_file"]

ALGOS = ("ppo", "dqn")
"""Algorithms that have a file; SAC has none, for the zoo has no word for `goal_turn`."""

_HEAD = """\
# Hyperparameters for RL Baselines3 Zoo, written by `python -m agents zoo configs/zoo`:
#
#   python -m rl_zoo3.train --algo {algo} --env ID --gym-packages rigid_envs \\
#     --conf-file configs/zoo/{algo}.yml --eval-env-kwargs "frame:'reduced'"
#
# The zoo makes its evaluation environment without the env_kwargs of a file: name the frame again,
# as above, where an entry has one. Its learning rates fall to 0. What else it has no word for is
# left out, and named above the entry.
"""
_OWN = {"log_std_init", "action_std", "log_every", "n_sampled_goal"}
_ACTIVATIONS = {"tanh": "Tanh", "relu": "ReLU", "elu": "ELU", "silu": "SiLU"}
_PART_ALONE = [
    {"gymnasium.wrappers.FilterObservation": {"filter_keys": ["observation"]}},
    "gymnasium.wrappers.FlattenObservation",
]
_WIDTH = 98


def zoo_file(algo: str) -> str:
    """Hyperparameters of all environments that have a config for an algorithm, as YAML.

    Args:
        algo: One of `ALGOS`.
    """
    ids = [env_id for env_id in ENVIRONMENTS if _is_shipped(recipe_for(env_id, algo))]
    return "\n".join((_HEAD.format(algo=algo), *(_entry(env_id, algo) for env_id in ids)))


def zoo_config(env_id: str, algo: str) -> tuple[Config, dict[str, Any]]:
    """The shipped config that the zoo is told of, and what is left out of it.

    It is that of the reduced frame. Where hyperparameters that hold in training alone go together
    with a price or a bonus, for which the zoo has no word, it is that of the frame of the world;
    without such a config, that of the reduced frame without all of them.

    Args:
        env_id: A registered id.
        algo: One of `ALGOS`.
    """
    recipe = recipe_for(env_id, algo)
    unsaid = _unsaid(recipe)
    if "train_kwargs" in unsaid and _is_shipped(world := recipe_for(env_id, algo, "world")):
        recipe, unsaid = world, _unsaid(world)
    left_out = {key: recipe[key] for key in unsaid}
    return config_from({key: recipe[key] for key in recipe if key not in unsaid}), left_out


def hyperparameters(config: Config) -> dict[str, Any]:
    """Entry of a config in a file of the zoo.

    Args:
        config: Config of a run of PPO or DQN.
    """
    names = {field.name for field in dataclasses.fields(ALGORITHMS[config.algo])}
    common = {field.name for field in dataclasses.fields(Config)}
    values = config_to_dict(config)
    return {
        "n_envs": config.n_envs,
        "n_timesteps": config.total_timesteps,
        **_environment(config),
        "gamma": config.gamma,
        "learning_rate": _rate(config.learning_rate),
        **{name: values[name] for name in values if name in names - common - _OWN},
        **_normalisation(config),
        "policy_kwargs": _policy(config),
    }


def _is_shipped(recipe: dict[str, Any]) -> bool:
    return "total_timesteps" in recipe  # else it is that of an id without config


def _unsaid(recipe: dict[str, Any]) -> list[str]:
    """Keys of a recipe that the zoo has no word for."""
    keys = [key for key in ("cost_price", "success_bonus", "action_std") if recipe.get(key)]
    paid = "cost_price" in keys or "success_bonus" in keys
    return [*keys, "train_kwargs"] if paid and recipe.get("train_kwargs") else keys


def _entry(env_id: str, algo: str) -> str:
    config, left_out = zoo_config(env_id, algo)
    said = "; ".join(f"{key}: {value}" for key, value in left_out.items())
    text = yaml.safe_dump({env_id: hyperparameters(config)}, sort_keys=False, width=_WIDTH)
    return (f"# left out: {said}\n" if said else "") + text


def _environment(config: Config) -> dict[str, Any]:
    """Arguments of the environment, its wrappers, and the policy that reads what these leave."""
    venv = make(config.env_id, config.env_kwargs, 1)
    space = venv.single_observation_space
    venv.close()
    alone = part_for(config.env_kwargs, space) is not None
    several = isinstance(space, spaces.Dict) and not alone
    return {
        "policy": "MultiInputPolicy" if several else "MlpPolicy",
        **({"env_kwargs": config.training_kwargs} if config.training_kwargs else {}),
        **({"env_wrapper": _PART_ALONE} if alone else {}),
    }


def _rate(rate: float | tuple[float, float]) -> float | str:
    return f"lin_{rate[0]}" if isinstance(rate, tuple) else rate


def _normalisation(config: Config) -> dict[str, Any]:
    seen, paid = config.normalize_observation, config.normalize_reward
    return {"normalize": {"norm_obs": seen, "norm_reward": paid}} if seen or paid else {}


def _policy(config: Config) -> str:
    spread = f"log_std_init={config.log_std_init}, " if isinstance(config, PPOConfig) else ""
    layers = f"net_arch={list(config.net_arch)}"
    return f"dict({spread}{layers}, activation_fn=nn.{_ACTIVATIONS[config.activation]})"
