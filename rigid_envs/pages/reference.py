"""Scores of the untrained policies of an environment, from the data of `rigid-envs anchors`."""

import re

from rigid_envs.pages.task_tables import Table
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores.metrics import METRICS, Metric
from rigid_envs.scores.scales import Anchors, ScoreScale, anchors
from rigid_envs.tasks import Task

__all__ = ["reference_section"]

_UNITS = {"success": "%", "time": "s", "path": "m"}
_INTRODUCTION = (
    "Means over the {n} starts of the evaluation set with the default arguments, computed by "
    "`rigid-envs anchors`. `zero` is the action 0 throughout, `random` the random policy; the "
    "others are controllers. Policies are ranked by `{first}`."
)


def reference_section(env_id: str, task: Task) -> list[str | Table]:
    """Table of the untrained policies, and what its metrics are; empty for an id without anchors.

    Args:
        env_id: Gymnasium's id.
        task: Its task.
    """
    found = anchors().get(env_id)
    if found is None:
        return []
    names = ENVIRONMENTS[env_id].metrics
    lead = _INTRODUCTION.format(n=found.n_starts, first=names[0])
    meanings = [_meaning(env_id, METRICS[name], found.scales.get(name)) for name in names]
    return [lead, _table(task, names, found), *meanings]


def _table(task: Task, names: tuple[str, ...], found: Anchors) -> Table:
    """One row for each policy, and one for the anchors of the scores."""
    rows = [
        (policy, *(_figure(name, means[name]) for name in names))
        for policy, means in found.means.items()
    ]
    anchor = [
        _figure(name, found.scales[name].anchor) if name in found.scales else "" for name in names
    ]
    header = ("Policy", *(_heading(task, name) for name in names))
    return Table(header, [*rows, ("score 1", *anchor)], "=" + ">" * len(names))


def _heading(task: Task, name: str) -> str:
    """Name of a metric with its unit."""
    unit = _UNITS.get(name, "")
    if name == "effort":
        unit = "".join(re.findall(r"\[(.+)\]", task.cost_unit))
    return f"{name} [{unit}]" if unit else name


def _figure(name: str, value: float) -> str:
    return f"{100.0 * value if name == 'success' else value:.4g}"


def _meaning(env_id: str, metric: Metric, scale: ScoreScale | None) -> str:
    """Definition of a metric, and its anchor, as an item of a list."""
    text, error = metric.text, ENVIRONMENTS[env_id].error
    if metric.name == "error" and error is not None:
        text = text.replace("the error", f"the {error.text}", 1)
    if scale is None:
        return f"- `{metric.name}`: {text}."
    why = {
        "exact": f"is the optimum: {scale.why}",
        "bound": f"is a bound: {scale.why}",
        "reference": f"is `{scale.why}`",
    }[scale.kind]
    return f"- `{metric.name}`: {text}. Score 1 {why}."
