"""Environments as JSON values, for programs: `rigid-envs list --json` and `describe --json`."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from typing import Any

from rigid_envs.catalogue import checked_id, task_of
from rigid_envs.pages.sections import summary_of
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.tasks import Entry, Task

__all__ = ["description", "overview"]


def overview(env_id: str) -> dict[str, Any]:
    """What a list of environments says of an id.

    Args:
        env_id: Gymnasium's id.
    """
    record, task = ENVIRONMENTS[env_id], task_of(env_id)
    return {
        "id": env_id,
        "summary": summary_of(type(task)),
        "family": record.family,
        "goal": record.goal,
        "max_episode_steps": record.max_episode_steps,
        "dt": task.dt,
        "cost": task.cost_unit,
        "metrics": list(record.metrics),
        "controllers": list(record.controllers),
    }


def description(env_id: str, config: Mapping[str, Any]) -> dict[str, Any]:
    """Spaces, rewards and arguments of an environment.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters that differ from their defaults.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
    """
    env_id = checked_id(env_id)
    task = task_of(env_id, config)
    seen, n = task.observations(), task.n_goal
    reduced = [] if task.reduction is None else task.reduction.features
    return overview(env_id) | {
        "dt": task.dt,
        "action": _entries(task.actions()),
        "choices": task.n_choices,
        "observation": _entries(seen[2 * n :]),
        "goal_entries": _entries(seen[:n]),
        "reduced_observation": _entries(reduced),
        "reward": dict(zip(task.terms, task.weights(), strict=True)),
        "arguments": [_argument(task, field) for field in fields(task)],
    }


def _entries(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    return [asdict(entry) for entry in entries]


def _argument(task: Task, field: Any) -> dict[str, Any]:
    rule = field.metadata["rule"]
    return {
        "name": field.name,
        "value": getattr(task, field.name),
        "default": field.default,
        "unit": rule.unit,
        "allowed": str(rule),
        "meaning": rule.text,
    }
