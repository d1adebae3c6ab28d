"""Environments by id, as data names them: nothing is imported because a file says so."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
from gymnasium import spaces
from gymnasium.vector import VectorEnv

import rigid_envs  # noqa: F401, registers the environments
from rigid_envs.errors import ConfigError
from rigid_envs.settings import refusal

__all__ = ["make", "part_for"]


def make(
    env_id: str, env_kwargs: Mapping[str, Any], num_envs: int, entry: str = "env_kwargs"
) -> VectorEnv[Any, Any, Any]:
    """A native vector environment whose rows reset in the step that ends their episode.

    Args:
        env_id: A registered id; `module:id` only of a module that is imported already.
        env_kwargs: Hyperparameters of its task.
        num_envs: Number of rows.
        entry: Config entry that a refusal of a hyperparameter names.

    Raises:
        ConfigError: "config.env_id: ..." or "config.env_kwargs....: ...".
    """
    module, _, name = env_id.rpartition(":")
    if module and module not in sys.modules:
        raise refusal(
            "env_id", env_id, f"no import of {module}: allow it with --allow_import {module}"
        )
    if name not in gym.registry or gym.registry[name].vector_entry_point is None:
        known = [key for key, spec in gym.registry.items() if spec.vector_entry_point is not None]
        close = difflib.get_close_matches(name, known, n=1) or sorted(known)
        raise refusal(
            "env_id",
            env_id,
            "a registered environment with a native vector form: "
            f"did you mean {', '.join(map(repr, close))}?",
        )
    try:
        return gym.make_vec(
            name,
            num_envs=num_envs,
            vectorization_mode="vector_entry_point",
            autoreset_mode="SameStep",
            **env_kwargs,
        )
    except (TypeError, ValueError) as error:
        why = str(error)
        prefix = f"config.{entry}."
        nested = why.startswith("config.")
        why = prefix + why[7:] if nested else f"config.{entry}: {why}"
        raise ConfigError(why) from error


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
