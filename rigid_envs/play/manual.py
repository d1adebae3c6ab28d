"""Which keys do what."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rigid_envs.catalogue import task_of
from rigid_envs.play.hands import HELP
from rigid_envs.play.steering import Steering, steering_of
from rigid_envs.render.views import view_of
from rigid_envs.tasks import Task

__all__ = ["help_lines", "keys", "keys_of"]

_OTHERS = (
    "Space, P\tpause",
    "Tab\tslow motion: 1/2, 1/4, 1",
    "R\tthe same start again",
    "N, Return\tthe next start",
    "H\tthese lines",
    "Esc\tquit",
    "",
    "mouse\tleft button: towards the pointer; right button: twist",
    "gamepad\tsticks; Start pauses, A again, Y next, X slow",
)


def keys_of(task: Task, parameters: Mapping[str, float]) -> Steering:
    """How a task is steered, seen with its own camera."""
    return steering_of(task, view_of(task, dict(parameters)).scene.camera.azimuth)


def keys(env_id: str, config: Mapping[str, Any] | None = None) -> str:
    """Keys of an environment and what they do, as text.

    Args:
        env_id: Gymnasium's id.
        config: hyperparameters of the task.

    Raises:
        ValueError: an unknown id, or a wrong hyperparameter.
    """
    task = task_of(env_id, config)
    system = task.system()
    parameters = {name: getattr(system, name) for name in task.system_type.parameter_names()}
    parts = (line.partition("\t") for line in help_lines(keys_of(task, parameters)))
    return "\n".join(f"{first:20}{second}".rstrip() for first, _, second in parts)


def help_lines(steering: Steering) -> tuple[str, ...]:
    """Keys and what they do; a tabulator parts both."""
    axes = (f"{HELP[axis]}\t{text}" for axis, text in steering.axes.items())
    return (steering.title, "", *axes, "", *_OTHERS)
