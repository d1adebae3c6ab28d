"""The result of an evaluation: its row, its file, its standing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Singles, printable
from rigid_envs.base.files import sealed, write_document
from rigid_envs.scores.starts import METRICS, VERSION, Cost, efficiencies, row_seeds
from rigid_envs.scores.statistics import mean_interval, wilson_interval

FORMAT = "rigid-envs result 3"


class Estimate(NamedTuple):
    """A mean over starts with its 95 % interval."""

    mean: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One episode of a policy from each of n starts.

    Success and cost are never mixed: `success` says how often, `efficiency` how well, and is 0 for
    a failure; `cost` is of the successes alone.

    Attributes:
        env_id: Gymnasium's id.
        policy: Who acted.
        config: Hyperparameters of the task.
        seed: Seed that the starts are drawn from.
        cost: What an episode costs; None for an environment that has no record.
        values: "success", "return", "length", "cost" and the metrics of the id by name, each of
            shape (n,). Success and cost are what the rows themselves publish; in environments of
            others what ``info`` says.
        provenance: Versions, kernels, commit, machine and date.
        unranked: Why it does not stand beside the best known; None if its actions, played again in
            the registered task from the starts of the evaluation set, gave the same figures.
        best: Best known costs, shape (n,), NaN where nobody succeeded; None for an id without data,
            or where this is not ranked.
        bounds: Least costs that theory allows, shape (n,); None where it says nothing.
        actions: As they were applied, in the frame of the task, 0 after an episode, shape
            (T, n, m), of choices (T, n, 1); None where this is not ranked, or was read from a file.
    """

    env_id: str
    policy: str
    config: Mapping[str, Any]
    seed: int
    cost: Cost | None
    values: Mapping[str, Array]
    provenance: Mapping[str, Any]
    unranked: str | None
    best: Array | None = None
    bounds: Array | None = None
    actions: Singles | None = None

    def __post_init__(self) -> None:
        """Refuse text that cannot be shown, and read again."""
        for name in ("env_id", "policy", "config", "cost", "provenance", "unranked"):
            printable(getattr(self, name), name)

    @property
    def n(self) -> int:
        """Number of starts."""
        return len(self.values["success"])

    @property
    def seeds(self) -> list[int]:
        """Seed of each start; `reset(seed=[...])` gives it again."""
        return row_seeds(self.seed, self.n, "test")

    @property
    def successes(self) -> npt.NDArray[np.bool_]:
        """Whether each episode succeeded, shape (n,)."""
        return self.values["success"] > 0.0

    @property
    def costs(self) -> Array:
        """Cost of each episode, also where it failed, shape (n,)."""
        return self.values["cost" if self.cost is None else self.cost.name]

    @property
    def success(self) -> Estimate:
        """Rate of success, with the interval of Wilson."""
        won = int(self.successes.sum())
        return Estimate(won / self.n, *wilson_interval(won, self.n))

    @property
    def efficiencies(self) -> Array | None:
        """Success-weighted efficiency from each start, shape (n,); None where no best is known."""
        if self.cost is None or self.best is None:
            return None
        return efficiencies(self.successes, self.costs, self.best, self.cost.floor)

    @property
    def efficiency(self) -> Estimate | None:
        """Mean efficiency, with a bootstrap interval; None where no best is known."""
        each = self.efficiencies
        return None if each is None else Estimate(float(each.mean()), *mean_interval(each))

    @property
    def gap(self) -> float | None:
        """Mean cost of the successes over their mean bound, less 1; None without such a bound."""
        if self.bounds is None or not self.successes.any():
            return None
        bound = self.bounds[self.successes].mean()
        return float(self.mean(self.costs) / bound - 1.0) if bound > 0.0 else None

    @property
    def records(self) -> npt.NDArray[np.bool_]:
        """Starts from which this is better than the best that is known, shape (n,)."""
        if self.best is None:
            return np.zeros(self.n, dtype=bool)
        return self.successes & ~(self.best <= self.costs * (1.0 + 1e-9))

    def mean(self, values: Array | None) -> float:
        """Mean over the successes; NaN without any."""
        won = self.successes
        return float("nan") if values is None or not won.any() else float(values[won].mean())

    def against(self, best: Array | None) -> Evaluation:
        """The same episodes beside other best known costs."""
        return replace(self, best=best)

    def figures(self) -> dict[str, Any]:
        """What it is ranked by, as JSON values; costs are of the successes alone."""
        efficiency = self.efficiency
        return {
            "episodes": self.n,
            "successes": int(self.successes.sum()),
            "success_rate": self.success.mean,
            "success_rate_95": [self.success.low, self.success.high],
            "efficiency": None if efficiency is None else efficiency.mean,
            "efficiency_95": None if efficiency is None else [efficiency.low, efficiency.high],
            "cost_mean": _plain(self.mean(self.costs)),
            "best_mean": _plain(self.mean(self.best)),
            "bound_mean": _plain(self.mean(self.bounds)),
            "gap": self.gap,
        }

    def summary(self) -> dict[str, Any]:
        """All rates, means and intervals, as JSON values."""
        others = self.values.keys() - {"success", "length", "cost"}
        return {
            **self.figures(),
            "records": int(self.records.sum()),
            "return_mean": float(self.values["return"].mean()),
            "length_mean": float(self.values["length"].mean()),
            "metrics": {name: self._metric(name) for name in sorted(others)},
        }

    def _metric(self, name: str) -> float | None:
        values = self.values[name]
        whole = not METRICS[name].of_successes
        return _plain(float(values.mean()) if whole else self.mean(values))

    def row(self) -> dict[str, Any]:
        """A row of the leaderboard, as JSON values, with every start and the digest of it all."""
        starts = {"best": self.best, "bound": self.bounds, **self.values}
        row = {
            "format": FORMAT,
            "env_id": self.env_id,
            "algo": self.policy,
            "config": dict(self.config),
            "evaluation_version": VERSION,
            "test_seed": self.seed,
            "unranked": self.unranked,
            "cost": None if self.cost is None else list(self.cost),
            "policy": self.summary(),
            **self.provenance,
            "starts": {
                name: None if values is None else [_plain(value) for value in values.tolist()]
                for name, values in starts.items()
            },
        }
        return sealed(row)

    def save(self, path: str | Path) -> Path:
        """Write the row, atomically; `rigid_envs.scores.read_evaluation` reads it.

        Args:
            path: A JSON file in a folder that exists.
        """
        file = Path(path)
        write_document(file, self.row())
        return file

    def __str__(self) -> str:
        """A small table."""
        config = "".join(f" {key}={value!r}" for key, value in self.config.items())
        lines = [
            f"{self.env_id}{config}: {self.policy}, {self.n} starts of seed {self.seed}",
            f"{'success':12}{100 * self.success.mean:9.1f} %   "
            f"{100 * self.success.low:.1f} .. {100 * self.success.high:.1f}",
        ]
        if (found := self.efficiency) is not None:
            lines.append(
                f"{'efficiency':12}{found.mean:9.3f}     {found.low:.3f} .. {found.high:.3f}"
            )
        elif self.cost is not None:
            why = "no best is known" if self.unranked is None else f"not ranked: {self.unranked}"
            lines.append(f"{'efficiency':12}        -     {why}")
        label = "cost" if self.cost is None else self.cost.title
        parts = {"best known": self.mean(self.best), "bound": self.mean(self.bounds)}
        told = [f"{name} {value:.4g}" for name, value in parts.items() if not np.isnan(value)]
        told += [] if self.gap is None else [f"gap {100 * self.gap:.1f} %"]
        beside = f"     of successes; {', '.join(told)}" if told else "     of successes"
        lines.append(f"{label:12}{_figure(self.mean(self.costs)):>9}{beside}")
        lines.append(f"{'return':12}{_figure(float(self.values['return'].mean())):>9}")
        if n := int(self.records.sum()):
            lines.append(f"better than the best known from {n} starts: keep it by rigid-envs best")
        return "\n".join(lines)


def rates_of(figures: Mapping[str, Any]) -> tuple[str, str, str, str]:
    """Rate of success [%], its 95 % interval, efficiency and its interval, as cells of a table."""
    efficiency = figures["efficiency"]
    return (
        f"{100 * figures['success_rate']:.1f} %",
        interval(figures["success_rate_95"], 100.0),
        "-" if efficiency is None else f"{efficiency:.3f}",
        interval(figures["efficiency_95"]),
    )


def interval(ends: Sequence[float] | None, scale: float = 1.0) -> str:
    """Ends of an interval as a cell of a table, in parts of 1, or of a scale as 100 [%]."""
    digits = 1 if scale > 1.0 else 3
    return "-" if ends is None else " .. ".join(f"{scale * end:.{digits}f}" for end in ends)


def _plain(value: float) -> float | None:
    return None if np.isnan(value) else value


def _figure(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4g}"
