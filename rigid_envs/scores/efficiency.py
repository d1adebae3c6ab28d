"""What an episode costs, and the efficiency of a success.

Success and cost are never mixed in a number that hides either. From each start the efficiency is
``s b / max(b, c)``: s is 1 for a success and 0 for a failure, c the cost of the episode, b the best
cost that is known from that start. A failure has 0, however little it spent; a success has 1 if
nobody is known to have done better.

Source: Anderson et al. 2018, *On Evaluation of Embodied Navigation Agents*, arXiv:1807.06757 (SPL).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.scores.metrics import metrics_of
from rigid_envs.tasks import Task

__all__ = ["FLOOR", "Cost", "cost_of", "efficiencies"]

Array = npt.NDArray[np.float64]

FLOOR = 0.01
"""Least path [m], effort [unit of the task], error and loss that count; of times, it is a step."""


class Cost(NamedTuple):
    """The number of an episode that its efficiency is computed from.

    Attributes:
        name: Name of the metric, one of `rigid_envs.registry.COSTS`.
        unit: Its unit; empty where it has none.
        floor: Costs below it count as it, so that nothing is divided by 0.
    """

    name: str
    unit: str
    floor: float


def cost_of(env_id: str, task: Task) -> Cost:
    """The cost of an id: the first of its metrics.

    Args:
        env_id: Gymnasium's id.
        task: Its task, with its settings.
    """
    metric = metrics_of(env_id)[0]
    return Cost(metric.name, metric.unit(task), task.dt if metric.name == "time" else FLOOR)


def efficiencies(
    successes: npt.ArrayLike, costs: npt.ArrayLike, best: npt.ArrayLike, floor: float
) -> Array:
    """Success-weighted efficiency from each start, shape (n,).

    Args:
        successes: Whether the episodes succeeded, shape (n,).
        costs: What they cost, shape (n,); of failures it may be anything.
        best: Best known costs, shape (n,); NaN where nobody is known to have succeeded: then the
            first to succeed has 1.
        floor: See `Cost`.
    """
    won = np.asarray(successes).astype(bool)
    cost = np.where(won, costs, np.inf)
    known = np.maximum(np.where(np.isnan(best), cost, best), floor)
    return np.where(won, known, 0.0) / np.where(won, np.maximum(known, cost), 1.0)
