"""The registered environments by id: `rigid-envs list`."""

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

from gymnasium import spaces

from rigid_envs import ENVIRONMENTS
from rigid_envs.cli.sections import summary_of
from rigid_envs.cli.tables import table
from rigid_envs.envs.boundary import action_space, new_task, observation_space
from rigid_envs.systems import (
    DynamicBall,
    FreeBody,
    HeavyTop,
    Roller,
    RollingBall,
    RollingDisk,
    UprightCoin,
)
from rigid_envs.tasks import Task

__all__ = [
    "UnknownIdError",
    "checked_id",
    "families",
    "list_all",
    "one_of_each",
    "size_of",
    "task_of",
    "time_limit",
]


_FAMILIES = {
    "Free body": (FreeBody,),
    "Top": (HeavyTop,),
    "Ball": (RollingBall, DynamicBall),
    "Coin and wheel": (UprightCoin, RollingDisk, Roller),
}


class UnknownIdError(ValueError):
    """No environment of that id is registered."""


def checked_id(env_id: str) -> str:
    """The id itself.

    Raises:
        UnknownIdError: names the nearest id.
    """
    if env_id in ENVIRONMENTS:
        return env_id
    known = {name.lower(): name for name in ENVIRONMENTS}
    (near,) = difflib.get_close_matches(env_id.lower(), known, n=1, cutoff=0.0)
    raise UnknownIdError(
        f"{env_id!r} is not the id of an environment; did you mean {known[near]!r}? "
        "`rigid-envs list` shows all of them"
    )


def task_of(env_id: str, config: Mapping[str, Any] | None = None) -> Task:
    """The task behind an id, with these hyperparameters.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
    """
    return new_task(ENVIRONMENTS[checked_id(env_id)][0], None, config or {})


def one_of_each(ids: Iterable[str] = ENVIRONMENTS) -> list[str]:
    """The first id of every kind: with numbers, with choices, with goals."""
    first: dict[tuple[bool, bool], str] = {}
    for env_id in ids:
        task = task_of(env_id)
        first.setdefault((task.n_choices > 0, task.n_goal > 0), env_id)
    return list(first.values())


def families() -> dict[str, list[str]]:
    """Every id, by what it is that moves."""
    found: dict[str, list[str]] = {family: [] for family in _FAMILIES}
    for env_id in ENVIRONMENTS:
        system = task_of(env_id).system_type
        (family,) = (name for name, systems in _FAMILIES.items() if system in systems)
        found[family].append(env_id)
    return found


def size_of(space: spaces.Space[Any]) -> str:
    """How many numbers, how many choices, or how many numbers beside a goal of how many."""
    if isinstance(space, spaces.Discrete):
        return f"{space.n} choices"
    if isinstance(space, spaces.Dict):
        return f"{size_of(space['observation'])}, goal {size_of(space['desired_goal'])}"
    return ", ".join(map(str, space.shape or ()))


def time_limit(env_id: str, task: Task) -> str:
    """The time limit of an id in steps and in seconds."""
    steps = ENVIRONMENTS[env_id][1]
    return f"{steps} steps ({steps * task.dt:g} s)"


def list_all() -> str:
    """Every id with what is to be done, then with its sizes, time limit and cost."""
    tasks = {env_id: task_of(env_id) for env_id in ENVIRONMENTS}
    summaries = [(env_id, summary_of(type(task))) for env_id, task in tasks.items()]
    header = ("id", "action", "observation", "time limit", "cost")
    rows = [
        (
            env_id,
            size_of(action_space(task)),
            size_of(observation_space(task)),
            f"{ENVIRONMENTS[env_id][1]} x {task.dt:g} s",
            task.cost_unit,
        )
        for env_id, task in tasks.items()
    ]
    parts = (table(("id", "task"), summaries, indent=0), table(header, rows, "<>>>", indent=0))
    return "\n\n".join(parts)
