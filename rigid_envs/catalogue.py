"""Look-up of registered environments by id."""

import dataclasses
import difflib
import importlib
from collections.abc import Iterable, Mapping
from typing import Any

from rigid_envs.envs.arguments import new_task
from rigid_envs.errors import ConfigError
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.tasks import Task

__all__ = ["SEEN", "UnknownIdError", "changed", "checked_id", "families", "one_of_each", "task_of"]

SEEN = ("rotation", "observe_params", "frame")
"""Settings that change what is seen of a task, and not the task."""


class UnknownIdError(ConfigError):
    """No environment of that id is registered."""


def checked_id(env_id: str) -> str:
    """A registered id; of "module:id", the module is imported first, as `gym.make` does.

    Raises:
        UnknownIdError: names the nearest id.
    """
    module, colon, name = env_id.rpartition(":")
    if colon:
        try:
            importlib.import_module(module)
        except (ModuleNotFoundError, ValueError) as error:
            raise UnknownIdError(
                f"env_id = {env_id!r}; expected a module that can be imported: {error}"
            ) from None
    if name in ENVIRONMENTS:
        return name
    known = {name.lower(): name for name in ENVIRONMENTS}
    (near,) = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.0)
    raise UnknownIdError(
        f"env_id = {env_id!r}; expected the id of an environment: did you mean {known[near]!r}? "
        "`rigid-envs list` shows all of them"
    )


def task_of(env_id: str, config: Mapping[str, Any] | None = None) -> Task:
    """The task of an id.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters that differ from their defaults.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
    """
    return new_task(ENVIRONMENTS[checked_id(env_id)].task, config or {})


def changed(env_id: str, task: Task) -> dict[str, Any]:
    """Hyperparameters of a task that differ from those that its id is registered with.

    Args:
        env_id: Gymnasium's id.
        task: A task of this id.
    """
    now, then = dataclasses.asdict(task), dataclasses.asdict(task_of(env_id))
    return {key: value for key, value in now.items() if value != then[key]}


def one_of_each(ids: Iterable[str] = ENVIRONMENTS) -> list[str]:
    """The first id of every kind: continuous actions, discrete actions, goals."""
    first: dict[tuple[bool, bool], str] = {}
    for env_id in ids:
        task = task_of(env_id)
        first.setdefault((task.n_choices > 0, task.n_goal > 0), env_id)
    return list(first.values())


def families(ids: Iterable[str] = ENVIRONMENTS) -> dict[str, list[str]]:
    """Ids by family, in the order of registration."""
    found: dict[str, list[str]] = {}
    for env_id in ids:
        found.setdefault(ENVIRONMENTS[env_id].family, []).append(env_id)
    return found
