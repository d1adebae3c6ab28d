"""Sampling model predictive control of any environment: its own kernels are the model.

Every decision copies the state of a row K times, rolls out K plans, and takes the first step of
the plan improved by their costs. The copies are stepped and rewarded by the functions that step
and reward the rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.control.mppi import CrossEntropyChoices, PathIntegral
from rigid_envs.core import Core
from rigid_envs.envs import RigidVectorEnv
from rigid_envs.kernels.layout import CLOCK, FLAGS
from rigid_envs.scores.controllers import Controller
from rigid_envs.tasks import Task

__all__ = ["Rollouts", "SamplingController", "sampling"]

Array = npt.NDArray[np.float64]

_COPIES = 8192  # rows that are rolled out together: they stay in the cache


class Rollouts:
    """Copies of rows, for the costs of plans from their states.

    A copy goes on as its row would, with the same parameters and the same noise. Its cost is the
    negative sum of its rewards until its episode ends; in a goal task, where the reward says
    nothing on the way, each step also costs the squared distance of the achieved goal from the
    desired one.
    """

    def __init__(self, task: Task, n_rows: int, n_samples: int) -> None:
        """Make room for copies.

        Args:
            task: Task of the rows.
            n_rows: Number of rows N.
            n_samples: Copies of each row K.
        """
        self._task, self._k = task, n_samples
        self._core = Core(task, n_rows * n_samples)

    def __call__(self, state: Mapping[str, Array], actions: npt.NDArray[Any]) -> Array:
        """Costs of plans, shape (N, K).

        Args:
            state: From `RigidVectorEnv.get_state`, of N rows.
            actions: Shape (T, N, K, m).
        """
        core = self._core
        core.set_state({key: part.repeat(self._k, axis=0) for key, part in state.items()})
        cost, alive = np.zeros(core.n_rows), np.ones(core.n_rows, dtype=bool)
        for action in actions.reshape(len(actions), *core.actions.shape):
            core.actions[...] = action
            core.step()
            cost -= np.where(alive, core.results[-1] - self._distance(), 0.0)
            alive &= ~core.flags[FLAGS.terminated]
        return cost.reshape(-1, self._k)

    def _distance(self) -> Array:
        n = self._task.n_goal  # 0 without a goal: no entries, and no distance
        off = self._core.observations[:, :n] - self._core.observations[:, n : 2 * n]
        return np.asarray(np.sum(off.astype(np.float64) ** 2, axis=-1))


class SamplingController:
    """Sampling controller of the rows of any task.

    The same draws are added to the plans of all rows: what a row does is what it would do alone.

    Attributes:
        planner: Method by which plans are drawn and improved.
    """

    def __init__(
        self,
        planner: PathIntegral | CrossEntropyChoices,
        rng: np.random.Generator,
    ) -> None:
        """Plan nothing yet.

        Args:
            planner: Method by which plans are drawn and improved.
            rng: Generator of the random draws.
        """
        self.planner, self._rng = planner, rng
        self._plan = np.zeros((0, 0, 0))
        self._blocks: list[slice] = []
        self._rollouts: dict[int, Rollouts] = {}

    def __call__(self, envs: RigidVectorEnv) -> npt.NDArray[Any]:
        """Actions of all rows; a row at its first step gets a new plan."""
        task, n, m = envs.task, envs.num_envs, len(envs.task.actions())
        state = envs.get_state()
        fresh = state["clock"][:, CLOCK.elapsed] == 0
        if self._plan.shape[1] != n:
            self._make_room(task, n)
            fresh[:] = True
        self._plan[:, fresh] = self.planner.start((int(fresh.sum()),), m)
        draws = self.planner.draw(self._rng, m)
        for block in self._blocks:
            samples: Any = self.planner.sample(self._plan[:, block], draws)
            rollouts = self._rollouts[samples.shape[1]]
            costs = rollouts({key: part[block] for key, part in state.items()}, samples)
            self._plan[:, block] = self.planner.improve(samples, costs)
        due = self._plan[0]
        self._plan = self.planner.shift(self._plan)
        return np.asarray(np.argmax(due, axis=-1) if task.n_choices else due)

    def _make_room(self, task: Task, n: int) -> None:
        """Plans of n rows, and copies of as many of them at a time as stay in the cache."""
        self._plan = self.planner.start((n,), len(task.actions()))
        size = max(1, _COPIES // self.planner.n_samples)
        self._blocks = [slice(k, min(k + size, n)) for k in range(0, n, size)]
        sizes = {block.stop - block.start for block in self._blocks}
        self._rollouts = {size: Rollouts(task, size, self.planner.n_samples) for size in sizes}


def sampling(
    task: Task,
    n_samples: int = 256,
    horizon: int | None = None,
    spread: float = 1.0,
    temperature: float = 0.2,
    memory: float = 0.8,
    seed: int = 0,
) -> Controller:
    """Sampling model predictive control of any task.

    Args:
        task: Any task, with its settings.
        n_samples: Plans that are tried in each step.
        horizon: Their number of steps; None for those of 3 s, and 30 at least.
        spread: See `PathIntegral`.
        temperature: See `PathIntegral`.
        memory: See `PathIntegral`.
        seed: Seed of the draws.
    """
    horizon = max(30, round(3.0 / task.dt)) if horizon is None else horizon
    planner: PathIntegral | CrossEntropyChoices
    if task.n_choices:
        planner = CrossEntropyChoices(n_samples, horizon, task.n_choices, temperature)
    else:
        planner = PathIntegral(n_samples, horizon, spread, temperature, memory)
    return SamplingController(planner, np.random.default_rng(seed))
