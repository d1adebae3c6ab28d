"""Rows of the leaderboard: of evaluations, of published policies, of what needs no training."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rigid_envs import ENVIRONMENTS
from rigid_envs.catalogue import task_of
from rigid_envs.policies import published
from rigid_envs.scores.best import best_known
from rigid_envs.scores.efficiency import Cost, cost_of
from rigid_envs.scores.published import published_evaluation
from rigid_envs.scores.result import Estimate, Evaluation
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, VERSION

__all__ = ["Row", "kind_of", "packaged_rows", "row_of", "sorted_rows"]


class Row(NamedTuple):
    """A row of the leaderboard.

    Attributes:
        env_id: Gymnasium's id.
        policy: Who acted.
        success: Rate of success.
        efficiency: Mean efficiency; None where no best is known, of what is not ranked.
        cost: What an episode costs.
        means: Of the successes, the mean cost, best known cost and bound; NaN where there is none.
        gap: How far the mean cost is above the mean bound; None without a bound.
        source: Starts, versions and commit.
        unranked: Why it is listed apart; None if it is ranked.
    """

    env_id: str
    policy: str
    success: Estimate
    efficiency: Estimate | None
    cost: Cost | None
    means: tuple[float, float, float]
    gap: float | None
    source: str
    unranked: str | None


def row_of(found: Evaluation) -> Row:
    """The row of an evaluation."""
    cost, best, bound = (found.mean(each) for each in (found.costs, found.best, found.bounds))
    return Row(
        found.env_id,
        found.policy,
        found.success,
        found.efficiency,
        found.cost,
        (cost, best, bound),
        found.gap,
        _source(found.n, found.seed, found.provenance),
        _objection(found),
    )


def packaged_rows() -> list[Row]:
    """Rows of what comes with the package: published policies, and those without training."""
    rows = [row_of(published_evaluation(name)) for name in published()]
    for env_id in ENVIRONMENTS:
        known = best_known(env_id)
        if known is not None:
            cost = cost_of(env_id, task_of(env_id))
            rows += [
                _untrained(env_id, name, summary, cost, known.provenance)
                for name, summary in known.policies.items()
            ]
    return rows


def sorted_rows(rows: Sequence[Row]) -> list[Row]:
    """By environment, the most efficient first."""
    known = list(ENVIRONMENTS)
    return sorted(rows, key=lambda row: (known.index(row.env_id), -_rank(row)))


def kind_of(row: Row) -> str:
    """Legend entry: reference controllers, whose names differ by environment, share one."""
    best = next(iter(ENVIRONMENTS[row.env_id].controllers), None)
    return "reference controller" if row.policy == best else row.policy


def _untrained(
    env_id: str, name: str, summary: Mapping[str, Any], cost: Cost, where: Mapping[str, Any]
) -> Row:
    """The row of a policy that `rigid-envs best` has played, from its summary."""
    means = [summary[key] for key in ("cost_mean", "best_mean", "bound_mean")]
    mean, best, bound = (np.nan if each is None else float(each) for each in means)
    return Row(
        env_id,
        name,
        Estimate(summary["success_rate"], *summary["success_rate_95"]),
        Estimate(summary["efficiency"], *summary["efficiency_95"]),
        cost,
        (mean, best, bound),
        summary["gap"],
        _source(summary["episodes"], TEST_SEED, where),
        None,
    )


def _objection(found: Evaluation) -> str | None:
    """Why an evaluation is listed apart; None if it is ranked. Few starts may be easy ones."""
    if found.unranked is None and found.n != N_STARTS:
        return f"n = {found.n}; expected all {N_STARTS} starts"
    return found.unranked or ("no best is known" if found.efficiencies is None else None)


def _rank(row: Row) -> float:
    return -1.0 if row.efficiency is None else row.efficiency.mean


def _source(n: int, seed: int, where: Mapping[str, Any]) -> str:
    commit = "no commit" if where["git_commit"] is None else f"commit {where['git_commit'][:12]}"
    return (
        f"{n} starts of seed {seed}, evaluation set {VERSION}; rigid-envs "
        f"{where['versions']['rigid-envs']}, kernels {where['kernel_hash']}, {commit}"
        f"{' with changes' if where['git_dirty'] else ''}."
    )
