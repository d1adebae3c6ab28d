"""Look-up of registered environments by id."""

import dataclasses
import difflib
import importlib
from collections.abc import Iterable, Mapping
from typing import Any

from rigid_envs.checks import printable, require
from rigid_envs.envs.arguments import new_task
from rigid_envs.errors import ConfigError
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.tasks import Task

__all__ = [
    "SEEN",
    "UnknownIdError",
    "changed",
    "checked_id",
    "families",
    "full_id",
    "id_in_file",
    "one_of_each",
    "task_of",
]

SEEN = ("rotation", "observe_params", "frame")
"""Settings that change what is seen of a task, and not the task."""


class UnknownIdError(ConfigError):
    """No environment of that id is registered."""


def full_id(env_id: str) -> str:
    """The id that a short form means: of "BallPark" and "BallPark-v0" "RigidEnvs/BallPark-v0".

    Of several versions it is the newest. Any other text, and a name that two namespaces have, is
    given back as it is.

    Args:
        env_id: An id or a short form.
    """
    if env_id in ENVIRONMENTS:
        return env_id
    meant = [known for known in ENVIRONMENTS if env_id in _short_forms(known)]
    if len({known.rpartition("/")[0] for known in meant}) != 1:
        return env_id
    return max(meant, key=_version)


def _version(env_id: str) -> int:
    number = env_id.rpartition("-v")[2]
    return int(number) if number.isdecimal() else 0


def _short_forms(env_id: str) -> set[str]:
    bare, _, version = env_id.rpartition("-v")
    forms = {env_id, bare} if version.isdecimal() else {env_id}
    return forms | {form.rpartition("/")[2] for form in forms}


def checked_id(env_id: str) -> str:
    """A registered id; of "module:id", the module is imported first, as `gym.make` does.

    Args:
        env_id: An id or a short form, see `full_id`.

    Raises:
        UnknownIdError: names the nearest id.
        ValueError: no text.
    """
    require(isinstance(env_id, str), env_id, "env_id", "the id of an environment, a text")
    module, colon, name = env_id.rpartition(":")
    if colon:
        try:
            importlib.import_module(module)
        except (ModuleNotFoundError, ValueError) as error:
            raise UnknownIdError(
                f"env_id = {env_id!r}; expected a module that can be imported: {error}"
            ) from None
    name = full_id(name)
    if name in ENVIRONMENTS:
        return name
    known = {name.lower(): name for name in ENVIRONMENTS}
    (near,) = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.0)
    raise UnknownIdError(
        f"env_id = {env_id!r}; expected the id of an environment: did you mean {known[near]!r}? "
        "`rigid-envs list` shows all of them"
    )


def id_in_file(env_id: Any) -> str:
    """The id that a file names, without a module: nothing is imported because a file says so.

    Args:
        env_id: What the file has; "module:id" of an environment of another package.

    Raises:
        ValueError: no text that can be shown.
    """
    require(isinstance(env_id, str), env_id, "env_id", "the id of an environment")
    return str(printable(env_id, "env_id")).rpartition(":")[2]


def task_of(env_id: str, config: Mapping[str, Any] | None = None) -> Task:
    """The task of an id.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters that differ from their defaults.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
    """
    return new_task(ENVIRONMENTS[checked_id(env_id)].task, {} if config is None else config)


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
