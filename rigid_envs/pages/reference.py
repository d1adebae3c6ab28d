"""Success, efficiency and cost of the untrained policies of an environment, from its data."""

from collections.abc import Mapping
from typing import Any

from rigid_envs.pages.task_tables import Table
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores.best import Best, best_known
from rigid_envs.scores.efficiency import cost_of
from rigid_envs.scores.metrics import METRICS, Metric
from rigid_envs.scores.theory import limit_of
from rigid_envs.tasks import Task

__all__ = ["reference_section"]

_INTRODUCTION = (
    "Over the {n} starts of the evaluation set with the default arguments, computed by `rigid-envs "
    "best`: success [%] and efficiency with their 95 % intervals. `zero` is the action 0 "
    "throughout, `random` the random policy; the others are controllers."
)
_EFFICIENCY = (
    "- `efficiency`: 0 for a failure; for a success b / max(b, c), c its `{cost}` and b the best "
    "known `{cost}` from its start, both at least {floor:g}{unit}. The best known are of {finders}."
)


def reference_section(env_id: str, task: Task) -> list[str | Table]:
    """Table of the untrained policies, and what its columns are; empty for an id without data.

    Args:
        env_id: Gymnasium's id.
        task: Its task.
    """
    found = best_known(env_id)
    if found is None:
        return []
    names = [name for name in ENVIRONMENTS[env_id].metrics if name != "success"]
    meanings = [_meaning(env_id, METRICS[name]) for name in names]
    lead = _INTRODUCTION.format(n=len(found.costs))
    return [lead, _table(task, names, found), _efficiency(env_id, task, found), *meanings,
            *_bound(env_id, found)]  # fmt: skip


def _table(task: Task, names: list[str], found: Best) -> Table:
    """One row for each policy."""
    rows = [_row(policy, names, summary) for policy, summary in found.policies.items()]
    header = ("Policy", "success", "95 %", "efficiency", "95 %",
              *(_heading(task, name) for name in names))  # fmt: skip
    return Table(header, rows, "=" + ">" * (len(header) - 1))


def _row(policy: str, names: list[str], summary: Mapping[str, Any]) -> tuple[str, ...]:
    low, high = (100.0 * end for end in summary["success_rate_95"])
    least, most = summary["efficiency_95"]
    return (
        policy,
        f"{100.0 * summary['success_rate']:.1f}",
        f"{low:.1f} .. {high:.1f}",
        f"{summary['efficiency']:.3f}",
        f"{least:.3f} .. {most:.3f}",
        *(_figure(summary["metrics"][name]) for name in names),
    )


def _heading(task: Task, name: str) -> str:
    """Name of a metric with its unit."""
    unit = METRICS[name].unit(task)
    return f"{name} [{unit}]" if unit else name


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _meaning(env_id: str, metric: Metric) -> str:
    """Definition of a metric, as an item of a list."""
    text, error = metric.text, ENVIRONMENTS[env_id].error
    if metric.name == "error" and error is not None:
        text = text.replace("the error", f"the {error.text}", 1)
    whose = ", mean of the successes" if metric.of_successes else ""
    return f"- `{metric.name}`: {text}{whose}."


def _efficiency(env_id: str, task: Task, found: Best) -> str:
    cost = cost_of(env_id, task)
    finders = ", ".join(f"`{name}` ({count})" for name, count in found.shares.items()) or "nobody"
    return _EFFICIENCY.format(
        cost=cost.name, floor=cost.floor, unit=f" {cost.unit}".rstrip(), finders=finders
    )


def _bound(env_id: str, found: Best) -> list[str]:
    """What theory says of the cost, beside the best known; empty where it says nothing."""
    limit = limit_of(env_id, found.cost)
    # the best of the reference controllers stands for all: its successes have the mean bound
    first = next(iter(found.policies.values()))
    if limit is None or first["bound_mean"] is None:
        return []
    bound, best = first["bound_mean"], first["best_mean"]
    gap = f", a gap of {100.0 * (best / bound - 1.0):.1f} %" if bound > 0.0 else ""
    name = "The optimum" if limit.kind == "exact" else "A lower bound"
    return [
        f"{name} of `{found.cost}`, {limit.text}: {bound:.4g} where `{next(iter(found.policies))}` "
        f"succeeds; the best known is {best:.4g}{gap}."
    ]
