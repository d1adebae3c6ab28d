"""What an evaluation may stand beside: best known costs and bounds, of the registered task."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.catalogue import SEEN, task_of
from rigid_envs.envs import RigidVectorEnv
from rigid_envs.errors import ConfigError
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores.best import best_known
from rigid_envs.scores.efficiency import Cost
from rigid_envs.scores.metrics import metrics_of
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, row_seeds
from rigid_envs.scores.theory import limit_of

__all__ = [
    "best_of",
    "bounds_of",
    "objection",
    "other_task",
    "refuse_impossible",
    "registered_rows",
]

Array = npt.NDArray[np.float64]

_ROUNDING = 1e-6  # of float32 actions, and what a finite horizon leaves: share of a bound


def other_task(env_id: str, config: Mapping[str, Any]) -> str | None:
    """The setting that makes a task another one than the registered one; None if none does.

    Free is what changes neither the task nor its cost: what is seen, and the weights of the reward
    unless the cost is made of it.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters of the task.
    """
    task, registered = task_of(env_id, config), task_of(env_id)
    paid = metrics_of(env_id)[0].name == "loss"
    for key in config:
        given, expected = getattr(task, key), getattr(registered, key)
        free = key in SEEN or (key.startswith("weight_") and not paid)
        if given != expected and not free:
            return f"{key} = {given!r}; expected {expected!r}, as registered"
    return None


def objection(env_id: str, config: Mapping[str, Any], seed: int, n: int) -> str | None:
    """Why episodes of a task are not ranked, whoever acts; None if nothing speaks against it.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters of the task.
        seed: Seed that the starts are drawn from.
        n: Number of starts.
    """
    if env_id not in ENVIRONMENTS:
        return f"env_id = {env_id!r}; expected a registered one"
    if seed != TEST_SEED:
        return f"seed = {seed}; expected {TEST_SEED}, of the evaluation set"
    if n > N_STARTS:
        return f"n = {n}; expected {N_STARTS} at most, the evaluation set"
    return other_task(env_id, config)


def best_of(env_id: str, n: int) -> Array | None:
    """Best known costs from the first n starts; None where there are none, or not so many.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
    """
    known = best_known(env_id)
    return None if known is None or n > len(known.costs) else known.costs[:n]


def registered_rows(env_id: str, n: int, config: Mapping[str, Any]) -> RigidVectorEnv:
    """N rows of an id as the registry of this package has it; Gymnasium's can be written over.

    Args:
        env_id: Gymnasium's id.
        n: Number of rows.
        config: Hyperparameters of the task.
    """
    record = ENVIRONMENTS[env_id]
    limit = record.max_episode_steps
    return RigidVectorEnv(record.task, n, limit, autoreset_mode="SameStep", **config)


def bounds_of(env_id: str, n: int, seed: int, config: Mapping[str, Any]) -> Array | None:
    """Least costs that theory allows, shape (n,); None where it says nothing.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
        seed: Seed that the starts are drawn from.
        config: Hyperparameters of the task.
    """
    limit = limit_of(env_id, metrics_of(env_id)[0].name)
    if limit is None:
        return None
    envs = registered_rows(env_id, n, config)
    envs.reset(seed=row_seeds(seed, n, "test"))
    return limit.values(envs)


def refuse_impossible(
    cost: Cost, successes: npt.NDArray[np.bool_], costs: Array, bounds: Array | None
) -> None:
    """Refuse successes that cost less than theory allows.

    Args:
        cost: What an episode costs.
        successes: Whether each episode succeeded, shape (n,).
        costs: Cost of each episode, shape (n,).
        bounds: Least costs that theory allows, shape (n,); None where it says no more than 0.

    Raises:
        ConfigError: Names the first one.
    """
    least = np.zeros(len(costs)) if bounds is None else bounds
    impossible = successes & ~(costs >= least * (1.0 - _ROUNDING))  # NaN too
    if impossible.any():
        k = int(impossible.argmax())
        raise ConfigError(
            f"{cost.name} of start {k} = {costs[k]}; expected at least {least[k]}, the bound of "
            "theory for a success: what is told of the episode is not what the task gives"
        )
