"""Metrics of an episode, and the metrics of an id."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores.episodes import Episodes
from rigid_envs.tasks import Task

__all__ = ["METRICS", "Metric", "metrics_of"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Metric:
    """One number of an episode.

    Attributes:
        name: Short name.
        text: Definition, with the unit.
        higher_is_better: Whether a larger value is better.
        values: Values of episodes of a task, shape (n,).
        of_successes: Whether a mean is that of the successes alone: failures may well be cheap.
    """

    name: str
    text: str
    higher_is_better: bool
    values: Callable[[Episodes, Task], Array]
    of_successes: bool = False

    def unit(self, task: Task) -> str:
        """Unit of its values in a task; empty where they have none."""
        if self.name in ("path", "effort"):
            return task.cost_unit.rpartition("[")[2].rstrip("]") if "[" in task.cost_unit else ""
        return "s" if self.name == "time" else ""


def _success(episodes: Episodes, _: Task) -> Array:
    return episodes.successes.astype(np.float64)


def _time(episodes: Episodes, task: Task) -> Array:
    """Time from which on success lasts, less the time for which it must hold; else the limit."""
    held = round(getattr(task, "hold", 0.0) / task.dt)
    steps = np.where(episodes.successes, episodes.since - held, episodes.limit)
    return np.asarray(task.dt * steps)


def _error(episodes: Episodes, task: Task) -> Array:
    assert episodes.errors is not None
    return episodes.errors


_ALL = (
    Metric("success", "rate of success", True, _success),
    Metric("return", "sum of rewards", True, lambda episodes, _: episodes.returns),
    Metric("time", "time [s] until success, to stay", False, _time, True),
    Metric("path", "distance rolled [m]", False, lambda episodes, _: episodes.costs, True),
    Metric(
        "effort",
        'sum of info["cost"], mostly an impulse',
        False,
        lambda episodes, _: episodes.costs,
        True,
    ),
    Metric("error", "root mean square of the error", False, _error, True),
    Metric("loss", "minus the return, a quadratic cost", False, lambda e, _: -e.returns, True),
)
METRICS = {metric.name: metric for metric in _ALL}
"""All metrics by name."""


def metrics_of(env_id: str) -> tuple[Metric, ...]:
    """The metrics of an id, its cost first; none for an unknown id."""
    record = ENVIRONMENTS.get(env_id)
    return () if record is None else tuple(METRICS[name] for name in record.metrics)
