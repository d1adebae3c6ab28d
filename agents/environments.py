"""Vector environments by id, as data names them."""

import importlib
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
from gymnasium import spaces
from gymnasium.vector import VectorEnv

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.settings import refusal
from rigid_envs.envs.lookup import nearest_id, task_of
from rigid_envs.tasks.registry import ENVIRONMENTS

# Modules that register environments: the only code that a command imports by its name.


def import_allowed(modules: Sequence[str]) -> None:
    """Import modules that --allow-import names, which register environments of their own.

    Args:
        modules: Their names.

    Raises:
        ImportError: There is no such module.
    """
    for module in modules:
        importlib.import_module(module)


# Environments by id, as data names them: no file and no option says what code is run.

_NO_SETTINGS = (
    *("id", "num_envs", "vectorization_mode", "vector_kwargs", "wrappers"),  # of gym.make_vec
    *("autoreset_mode", "render_mode"),
)
"""Keywords that say how an environment is made, and not what it is."""


def make(
    env_id: str, env_kwargs: Mapping[str, Any], num_envs: int, entry: str = "env_kwargs"
) -> VectorEnv[Any, Any, Any]:
    """A native vector environment whose rows reset in the step that ends their episode.

    Args:
        env_id: A registered id; `module:id` only of a module that is imported already.
        env_kwargs: Hyperparameters of its task, and `max_episode_steps`; nothing else that a
            constructor takes.
        num_envs: Number of rows.
        entry: Config entry that a refusal of a hyperparameter names.

    Raises:
        ConfigError: "config.env_id: ..." or "config.env_kwargs....: ...".
    """
    module, _, name = env_id.rpartition(":")
    if module and module not in sys.modules:
        expected = f"no import of {module}: allow it with --allow-import {module}"
        raise refusal("env_id", env_id, expected)
    if name not in gym.registry or gym.registry[name].vector_entry_point is None:
        known = [key for key, spec in gym.registry.items() if spec.vector_entry_point is not None]
        hint = f"did you mean {nearest_id(name, known)!r}?"
        expected = f"a registered environment with a native vector form: {hint}"
        raise refusal("env_id", env_id, expected)
    try:
        _refuse_others(name, env_kwargs)
        return gym.make_vec(
            name,
            num_envs=num_envs,
            vectorization_mode="vector_entry_point",
            autoreset_mode="SameStep",
            **env_kwargs,
        )
    except (TypeError, ValueError) as error:
        why, prefix = str(error), f"config.{entry}"
        nested = why.startswith("config.")
        raise ConfigError(f"{prefix}{why[6:]}" if nested else f"{prefix}: {why}") from error


def _refuse_others(env_id: str, env_kwargs: Mapping[str, Any]) -> None:
    """Refuse what is no setting: code, wrappers, windows.

    Raises:
        ConfigError: "config.<key>: ...".
    """
    if env_id in ENVIRONMENTS:  # a time limit is one of the environment, not of its task
        task_of(env_id, {key: env_kwargs[key] for key in env_kwargs if key != "max_episode_steps"})
        return
    registered = gym.registry[env_id].kwargs  # of one of our classes, its task is code
    for key in (*_NO_SETTINGS, *({"task"} & registered.keys())):
        if key in env_kwargs:
            raise refusal(key, env_kwargs[key], f"no such key: it is no setting of {env_id}")


def part_for(env_kwargs: Mapping[str, Any], space: spaces.Space[Any]) -> str | None:
    """Name of the part of an observation that networks read; None for all of it.

    In the reduced frame of a goal task `observation` says where the goal is, seen from the state.
    The two goals beside it are in the frame of the world: they would undo the reduction.

    Args:
        env_kwargs: Hyperparameters of its task.
        space: Space of its observations.
    """
    alone = env_kwargs.get("frame") == "reduced" and isinstance(space, spaces.Dict)
    return "observation" if alone else None
