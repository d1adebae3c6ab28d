"""Predictive control of the rows of an environment: plans that are made anew as time goes on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.control.predictive import Prediction, PredictiveControl
from rigid_envs.envs import RigidVectorEnv
from rigid_envs.kernels.layout import CLOCK
from rigid_envs.scores.controllers import Controller
from rigid_envs.scores.scripts import Rows, Script

__all__ = ["predicting"]

Array = npt.NDArray[np.float64]


def predicting(
    law: PredictiveControl,
    dt: float,
    period: int,
    goals: Callable[[RigidVectorEnv], npt.NDArray[Any]] = lambda envs: np.zeros((envs.num_envs, 0)),
) -> Controller:
    """A controller that plans every row anew after some steps, beginning with its last plan.

    Args:
        law: The plans; their first `period` intervals are control periods.
        dt: Control period [s].
        period: Number of steps after which a row is planned again.
        goals: Numbers that the cost of each row depends on, shape (N, n_goal).
    """
    plans: dict[int, Prediction] = {}

    def plan(envs: RigidVectorEnv, rows: Rows) -> Array:
        y, goal = envs.y, goals(envs)
        begins = envs.get_state()["clock"][:, CLOCK.elapsed] == 0
        for row in rows:
            last = None if begins[row] or row not in plans else plans[row]
            near = None if last is None else law.later(last, period * dt)
            plans[row] = law.plan(y[row], goal[row], near)
        return np.stack([plans[row].actions[:period] for row in rows], axis=1)

    return Script(plan, period=period)
