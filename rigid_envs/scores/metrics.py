"""What is measured of an episode, and which of it matters for an id."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.scores.episodes import Episodes, Error
from rigid_envs.tasks import Task

__all__ = ["METRICS", "PRIMARY", "Metric", "error_of", "metrics_of"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Metric:
    """One number of an episode; that of a policy is the mean over its episodes.

    Attributes:
        name: Short name.
        text: What it is.
        more: Whether more is better.
        values: Its values, shape (n,), of episodes of a task.
        failed: Episodes, shape (n,), that count as the mean of the random policy does, as their
            own value would flatter them; None for none.
    """

    name: str
    text: str
    more: bool
    values: Callable[[Episodes, Task], Array]
    failed: Callable[[Episodes], Bools] | None = None

    def of(self, episodes: Episodes, task: Task, chance: float | None = None) -> Array:
        """The metric of every episode, shape (n,).

        Args:
            episodes: The episodes.
            task: Their task.
            chance: Plain mean of the random policy, for which episodes that failed count; None
                lets them keep their own value.
        """
        values = self.values(episodes, task)
        if self.failed is None or chance is None:
            return values
        return np.where(self.failed(episodes), chance, values)


def _success(episodes: Episodes, _: Task) -> Array:
    return episodes.successes.astype(np.float64)


def _time(episodes: Episodes, task: Task) -> Array:
    """Steps to where success lasts, less those for which it must have held to be one."""
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

_SPIN = Error("spin", 10.0, "distance from the aimed spin in target rates")
_TILT = Error("upright", 10.0, "tilt [rad]")
_CIRCLE = Error("circle", 10.0, "relative error of the curvature")
_ERRORS = {
    "IntermediateAxis": _SPIN,
    "IntermediateAxisRandom": _SPIN,
    "IntermediateAxisSingle": Error("axis", 10.0, "angle of the spin from e2 [rad]"),
    "SpinCapture": _SPIN,
    "SleepingTop": _TILT,
    "SleepingTopRandom": _TILT,
    "PivotTop": _TILT,
    "TopPrecession": Error("tilt", 10.0, "tilt off the commanded one [rad]"),
    "TopRandom": _TILT,
    "BallSteer": Error("close", 5.0, "pose error [radii and rad]"),
    "BallPlate": Error("near", 5.0, "distance from the point [m]"),
    "DiskRoll": _CIRCLE,
    "DiskRollRandom": _CIRCLE,
}

_UNTIMED = ("AxisFlip", "BallSteer")  # success is at a commanded time, or a mean
_PATHS = (
    *("BallPark", "BallParkRandom", "BallParkGoal", "BallReorient"),
    *("BallSteer", "BallGrid", "CoinPark"),
)
_TIMES = ("Reorient", "BallParkDynamic", "RollPump")
_AIMS = ("BallSteer", "DiskRoll", "DiskRollRandom")

PRIMARY = {
    **dict.fromkeys(_PATHS, "path"),
    **dict.fromkeys(_TIMES, "time"),
    **dict.fromkeys(_AIMS, "error"),
    "BallPlate": "time",
    "Detumble": "return",
    "PivotTop": "return",  # who falls at once spares effort
}
"""The metric that ranks policies, by task; "effort" for a task that is not here."""


def error_of(task: Task) -> Error | None:
    """The error that a task is about; None where it is about none."""
    return _ERRORS.get(type(task).__name__)


def metrics_of(task: Task) -> tuple[Metric, ...]:
    """The metrics that matter for a task, the one that ranks policies first."""
    kind = type(task).__name__
    names = ["success", "return"]
    if kind not in _UNTIMED:
        names.append("time")
    if task.cost_unit.startswith("distance rolled"):
        names.append("path")
    elif not task.cost_unit.startswith("time"):
        names.append("effort")
    if kind in _ERRORS:
        names.append("error")
    first = PRIMARY.get(kind, "effort" if "effort" in names else "return")
    return tuple(METRICS[name] for name in (first, *(name for name in names if name != first)))
