"""Goal environments: dictionary observations, and rewards that can be recomputed.

The interface of Gymnasium-Robotics and of hindsight experience replay: `observation`,
`achieved_goal`, `desired_goal`, and ``compute_reward(achieved, desired, info)``, bit for bit the
reward of `step`. The episode does not end at the goal: staying there has the largest reward.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import real_numbers
from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.spaces import goal_parts
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.tasks.task import Task

Part = npt.NDArray[np.float32]


class _Goals:
    """Functions of achieved and desired goals, single or in batches."""

    task: Task

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Reward of a step that leads to the achieved goal; float64.

        Args:
            achieved_goal: shape (..., n_goal).
            desired_goal: shape (..., n_goal).
            info: not used.

        Raises:
            ValueError: no real numbers, or wrong shapes.
        """
        reward = self.task.goal_reward(achieved_goal, desired_goal)
        return reward if np.ndim(reward) else float(reward)

    def compute_terminated(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """False everywhere; so is `compute_truncated`, for time limits are the wrapper's."""
        shape = real_numbers(achieved_goal, "achieved_goal").shape[:-1]
        return np.zeros(shape, dtype=np.bool_) if shape else False

    compute_truncated = compute_terminated


class RigidGoalEnv(_Goals, RigidEnv):
    """One row of a goal task; arguments and errors as `RigidEnv`."""

    def _observer(self) -> Callable[[], Any]:
        parts = goal_parts(self._core.observations[0], self.task.n_goal)
        return partial(_copies, *parts.values())


class RigidGoalVectorEnv(_Goals, RigidVectorEnv):
    """N rows of a goal task; arguments and errors as `RigidVectorEnv`."""

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """One control period of all rows; see `RigidVectorEnv.step`."""
        flat, rewards, terminated, truncated, infos = super().step(actions)
        if "final_obs" in infos:
            infos["final_obs"] = goal_parts(infos["final_obs"], self.task.n_goal)
        return goal_parts(flat, self.task.n_goal), rewards, terminated, truncated, infos

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        """Begin new episodes; see `RigidVectorEnv.reset`."""
        flat, infos = super().reset(**arguments)
        return goal_parts(flat, self.task.n_goal), infos


def _copies(observation: Part, achieved: Part, desired: Part) -> dict[str, Part]:
    """Faster than views of one copy: a slice takes longer than a copy of so few numbers."""
    return {
        "observation": observation.copy(),
        "achieved_goal": achieved.copy(),
        "desired_goal": desired.copy(),
    }
