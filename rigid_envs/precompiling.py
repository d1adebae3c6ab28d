"""Compilation of environments before their first use, in processes side by side."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid_envs.catalogue import checked_id, task_of
from rigid_envs.core import Core
from rigid_envs.tasks import Task

__all__ = ["Kernel", "compile_all", "kernels_of"]


@dataclass(frozen=True)
class Kernel:
    """Compiled loop of an environment.

    Attributes:
        env_id: Gymnasium's id, also "module:id".
        config: Hyperparameters of the task.
        part: "reset", "step" or, of a goal environment, "reward".
    """

    env_id: str
    config: Mapping[str, Any]
    part: str

    def __str__(self) -> str:
        """What is shown while it is compiled."""
        settings = "".join(f", {key} = {value}" for key, value in self.config.items())
        return f"{checked_id(self.env_id).rpartition('/')[2]} {self.part}{settings}"


def kernels_of(env_id: str, config: Mapping[str, Any] | None = None) -> list[Kernel]:
    """The kernels of an environment.

    Args:
        env_id: Gymnasium's id or a short form of it, also "module:id".
        config: Hyperparameters of the task; None takes the defaults, in both frames where the task
            has a reduced one.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
    """
    task = task_of(env_id, config)
    parts = ("step", "reset", "reward") if task.n_goal else ("step", "reset")
    configs: list[Mapping[str, Any]] = [config or {}]
    if not config and task.reduction:
        configs.append({"frame": "reduced"})
    return [Kernel(env_id, each, part) for each in configs for part in parts]


def compile_all(kernels: list[Kernel], jobs: int) -> Iterator[tuple[Kernel, bool]]:
    """Compile kernels, or find them in the cache.

    Args:
        kernels: Which.
        jobs: Number of processes.

    Yields:
        Each kernel when it is there, and whether it was in the cache.
    """
    context = multiprocessing.get_context("spawn")  # a fork would copy locks of other threads
    with ProcessPoolExecutor(min(jobs, len(kernels)), context) as pool:
        waiting = {pool.submit(_compile, kernel): kernel for kernel in kernels}
        for done in as_completed(waiting):
            yield waiting[done], done.result()


def _compile(kernel: Kernel) -> bool:
    task = task_of(kernel.env_id, kernel.config)
    episode = task.episode if kernel.part == "reward" else task.compiled
    _PARTS[kernel.part](task)
    return bool(getattr(episode, kernel.part).stats.cache_hits)


def _reset(task: Task) -> None:
    Core(task, 1).reset(np.zeros(1, dtype=np.int64))


def _step(task: Task) -> None:
    Core(task, 1).step()


def _reward(task: Task) -> None:
    goal = np.zeros(task.n_goal, dtype=np.float32)
    task.goal_reward(goal, goal)


_PARTS: dict[str, Callable[[Task], None]] = {"reset": _reset, "step": _step, "reward": _reward}
