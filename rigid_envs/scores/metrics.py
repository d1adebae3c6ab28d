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
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Metric:
    """One number of an episode; that of a policy is the mean over its episodes.

    Attributes:
        name: Short name.
        text: Definition, with the unit.
        higher_is_better: Whether a larger value is better.
        measure: Own values of episodes of a task, shape (n,).
        failed: Episodes, shape (n,), whose own value would flatter them: they count as the mean of
            the random policy; None for none.
    """

    name: str
    text: str
    higher_is_better: bool
    measure: Callable[[Episodes, Task], Array]
    failed: Callable[[Episodes], Bools] | None = None

    def values(self, episodes: Episodes, task: Task, random_baseline: float | None = None) -> Array:
        """The metric of every episode, shape (n,).

        Args:
            episodes: One episode from each of n starts.
            task: Their task.
            random_baseline: Plain mean of the random policy, which episodes that failed count for;
                None lets them keep their own value.
        """
        values = self.measure(episodes, task)
        if self.failed is None or random_baseline is None:
            return values
        return np.where(self.failed(episodes), random_baseline, values)

    def unit(self, task: Task) -> str:
        """Unit of its values in a task; empty where they have none."""
        if self.name in ("path", "effort"):
            return task.cost_unit.rpartition("[")[2].rstrip("]") if "[" in task.cost_unit else ""
        return "s" if self.name == "time" else ""


def _success(episodes: Episodes, _: Task) -> Array:
    return episodes.successes.astype(np.float64)


def _time(episodes: Episodes, task: Task) -> Array:
    """Time from which on success lasts, less the time for which it must hold to count."""
    held = round(getattr(task, "hold", 0.0) / task.dt)
    steps = np.where(episodes.successes, episodes.since - held, episodes.limit)
    return np.asarray(task.dt * steps)


def _error(episodes: Episodes, task: Task) -> Array:
    assert episodes.errors is not None
    return episodes.errors


def _lost(episodes: Episodes) -> Bools:
    return np.asarray(~episodes.successes)


def _cut_short(episodes: Episodes) -> Bools:
    return np.asarray(episodes.terminated & ~episodes.successes)


_ALL = (
    Metric("success", "rate of success", True, _success),
    Metric("return", "sum of rewards", True, lambda episodes, _: episodes.returns),
    Metric(
        "time",
        "time [s] until success, to stay; failures count as the time limit",
        False,
        _time,
    ),
    Metric(
        "path",
        "distance rolled [m]; failures count as the random policy",
        False,
        lambda episodes, _: episodes.costs,
        _lost,
    ),
    Metric(
        "effort",
        'sum of info["cost"], mostly an impulse; failures count as the random policy',
        False,
        lambda episodes, _: episodes.costs,
        _lost,
    ),
    Metric(
        "error",
        "root mean square of the error; what fails before its time counts as the random policy",
        False,
        _error,
        _cut_short,
    ),
)
METRICS = {metric.name: metric for metric in _ALL}
"""All metrics by name."""


def metrics_of(env_id: str) -> tuple[Metric, ...]:
    """The metrics of an id, the one that ranks policies first; none for an unknown id."""
    record = ENVIRONMENTS.get(env_id)
    return () if record is None else tuple(METRICS[name] for name in record.metrics)
