"""The registered environments by id: `rigid-envs list`."""

import difflib
import inspect
from collections.abc import Mapping
from typing import Any

from rigid_envs import ENVIRONMENTS
from rigid_envs.cli.tables import table
from rigid_envs.envs.boundary import action_space, new_task, observation_space
from rigid_envs.tasks import Task

__all__ = ["UnknownIdError", "checked_id", "list_all", "story", "task_of", "time_limit"]


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


def story(kind: type[object]) -> list[str]:
    """Paragraphs of the docstring of a class, without its lists of attributes and errors."""
    parts = (inspect.getdoc(kind) or "").split("\n\n")
    kept = [part for part in parts if not part.startswith(("Attributes:", "Raises:"))]
    return [" ".join(part.replace("``", "`").split()) for part in kept]


def time_limit(env_id: str, task: Task) -> str:
    """The time limit of an id in steps and in seconds."""
    steps = ENVIRONMENTS[env_id][1]
    return f"{steps} steps ({steps * task.dt:g} s)"


def list_all() -> str:
    """Every id with its summary, shapes, control period, time limit and cost."""
    header = ("id", "action", "observation", "dt [s]", "time limit", "cost")
    tasks = {env_id: task_of(env_id) for env_id in ENVIRONMENTS}
    rows = [
        (
            env_id,
            str(action_space(task).shape),
            str(observation_space(task).shape),
            f"{task.dt:g}",
            time_limit(env_id, task),
            task.cost_unit,
        )
        for env_id, task in tasks.items()
    ]
    head, rule, *lines = table(header, rows, "<<<>", indent=0).splitlines()
    summaries = (story(type(task))[0] for task in tasks.values())
    entries = (f"{line}\n    {text}" for line, text in zip(lines, summaries, strict=True))
    return "\n".join([head, rule, *entries])
