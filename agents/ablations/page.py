"""The page of the ablations, from their records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.records import Record, read_record
from rigid_envs.scores.starts import cost_of

from .plan import NAMES, PARTS

__all__ = ["markdown"]

_INTRODUCTION = """<!-- Written by `python -m agents ablate --records docs/ablations`. -->

# Ablations

What the parts of a recipe in the reduced frame are worth. Each training has the network and the
rates of the recipe of its environment, neither a price on cost nor a bonus, and of the reduction
this part alone:

- *none*: the world frame, as every user of Gymnasium gets it.
- *schedule*: the world frame; the standard deviation of the actions decreases by equal factors over
  the run, from 0.6 to 0.1, and is not learnt.
- *features*: the world's observation and actions, and beside it all features of the reduction.
- *frame*: actions of the reduced frame, and in it plain coordinates of the state instead of all
  features.
- *all*: frame and features, and the schedule where the recipe has one.

Success and cost are means over the trainings, each of the policy that did best on other starts held
out, on the 500 test starts; in brackets those of the worst and the best training. Costs are of the
episodes that succeeded."""
_HEADER = ("part", "trainings", "success", "", "cost", "", "CPU")


def markdown(folder: Path) -> str:
    """The page.

    Args:
        folder: Of the records, a folder for each part.
    """
    parts = [_INTRODUCTION]
    for name in NAMES:
        found = {part: _records(folder / part, name) for part in PARTS}
        trained = {part: records for part, records in found.items() if records}
        if trained:
            env_id = f"RigidEnvs/{name}-v0"
            cost = cost_of(env_id, task_of(env_id))
            unit = f" [{cost.unit}]" if cost.unit else ""
            header = [f"{cost.name}{unit}" if text == "cost" else text for text in _HEADER]
            steps = next(iter(trained.values()))[0].training["timesteps"]
            rows = [_row(part, records) for part, records in trained.items()]
            parts += [f"## {name}, {steps:,} steps", _table(header, rows)]
    return "\n\n".join(parts) + "\n"


def _records(folder: Path, name: str) -> list[Record]:
    """Of all trainings of a part; the variants of a task begin with its name."""
    return [read_record(file) for file in sorted(folder.glob(f"{name}*/*.json"))]


def _row(part: str, records: Sequence[Record]) -> tuple[str, ...]:
    rates = [100.0 * record.success_rate for record in records]
    costs = [record.cost_mean for record in records if record.successes.any()]
    cpu = np.mean([record.training["cpu_seconds"] for record in records])
    return (
        part,
        str(len(records)),
        f"{np.mean(rates):.1f} %",
        f"({min(rates):.1f} .. {max(rates):.1f})",
        f"{np.mean(costs):.4g}" if costs else "-",
        f"({min(costs):.4g} .. {max(costs):.4g})" if costs else "",
        f"{cpu:.0f} s",
    )


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    rules = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, rules, *rows))
