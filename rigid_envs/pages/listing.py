"""All environments in two tables: `rigid-envs list`."""

from typing import Any

from gymnasium import spaces

from rigid_envs.catalogue import task_of
from rigid_envs.envs.task_spaces import action_space, observation_space
from rigid_envs.pages.sections import summary_of
from rigid_envs.pages.tables import table
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.tasks import Task

__all__ = ["list_all", "size_of", "time_limit"]


def size_of(space: spaces.Space[Any]) -> str:
    """Size of a space: entries of a box, number of choices, or entries beside those of a goal."""
    if isinstance(space, spaces.Discrete):
        return f"{space.n} choices"
    if isinstance(space, spaces.Dict):
        return f"{size_of(space['observation'])}, goal {size_of(space['desired_goal'])}"
    return ", ".join(map(str, space.shape or ()))


def time_limit(env_id: str, task: Task) -> str:
    """Time limit of an id in steps and in seconds."""
    steps = ENVIRONMENTS[env_id].max_episode_steps
    return f"{steps} steps ({steps * task.dt:g} s)"


def list_all() -> str:
    """Every id with its summary, then with its sizes, time limit and cost."""
    tasks = {env_id: task_of(env_id) for env_id in ENVIRONMENTS}
    summaries = [(env_id, summary_of(type(task))) for env_id, task in tasks.items()]
    header = ("id", "action", "observation", "time limit", "cost")
    rows = [
        (
            env_id,
            size_of(action_space(task)),
            size_of(observation_space(task)),
            f"{ENVIRONMENTS[env_id].max_episode_steps} x {task.dt:g} s",
            task.cost_unit,
        )
        for env_id, task in tasks.items()
    ]
    parts = (table(("id", "task"), summaries, indent=0), table(header, rows, "<>>>", indent=0))
    return "\n\n".join(parts)
