"""Table of the best known costs beside what theory allows, for a page of the documentation."""

from __future__ import annotations

import numpy as np

from rigid_envs.catalogue import task_of
from rigid_envs.pages.markdown import table_lines
from rigid_envs.pages.task_tables import Table
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores import best_known
from rigid_envs.scores.efficiency import cost_of
from rigid_envs.scores.standing import bounds_of
from rigid_envs.scores.starts import TEST_SEED

__all__ = ["PROVEN", "best_costs"]

PROVEN = 0.02
"""Gap up to which the best known is called proven."""


def best_costs() -> str:
    """Table of the ids of this package: mean best known cost, mean bound, gap, and who found it."""
    rows = []
    for env_id in ENVIRONMENTS:
        known, cost = best_known(env_id), cost_of(env_id, task_of(env_id))
        if known is None or not env_id.startswith("RigidEnvs/"):
            continue
        bounds = bounds_of(env_id, len(known.costs), TEST_SEED, {})
        mean = float(np.nanmean(known.costs))
        bound, gap, verdict = "", "", "no bound is known"
        if bounds is not None:
            least = float(bounds.mean())
            bound = f"{least:.4g}"
            gap = "" if least <= 0.0 else f"{max(100.0 * (mean / least - 1.0), 0.0):.1f} %"
            proven = mean <= (1.0 + PROVEN) * least
            verdict = "proven" if proven else "open"
        shares = ", ".join(f"`{name}` {count}" for name, count in known.shares.items())
        name = env_id.removeprefix("RigidEnvs/").removesuffix("-v0")
        unit = f" [{cost.unit}]" if cost.unit else ""
        link = f"[`{name}`](environments/{name}.md)"
        rows.append((link, cost.name + unit, f"{mean:.4g}", bound, gap, verdict, shares))
    names = ("id", "cost", "best known", "bound", "gap", "", "found by, of the starts")
    return "\n".join(table_lines(Table(names, rows, "<<>>><<")))
