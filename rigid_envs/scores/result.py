"""Result of an evaluation: figures with intervals, a table, a row of the leaderboard as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.files import DamagedFileError, lined_json, read_bytes, write_atomic
from rigid_envs.scores.best import best_known
from rigid_envs.scores.efficiency import Cost, efficiencies
from rigid_envs.scores.intervals import mean_interval, wilson_interval
from rigid_envs.scores.metrics import METRICS
from rigid_envs.scores.starts import TEST_SEED, VERSION, row_seeds

__all__ = ["FORMAT", "Estimate", "Evaluation", "read_evaluation"]

Array = npt.NDArray[np.float64]

FORMAT = "rigid-envs result 2"

_LIMIT = 2**24  # bytes


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
        values: "success", "return", "length", "cost" (sum of ``info["cost"]``) and the metrics of
            the id by name, each of shape (n,).
        best: Best known costs, shape (n,), NaN where nobody succeeded; None where nothing is known:
            for an id without data, other starts, or another task than the registered one.
        bounds: Least costs that theory allows, shape (n,); None where it says nothing.
        provenance: Versions, kernels, commit, machine and date.
    """

    env_id: str
    policy: str
    config: Mapping[str, Any]
    seed: int
    cost: Cost | None
    values: Mapping[str, Array]
    best: Array | None
    bounds: Array | None
    provenance: Mapping[str, Any]

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

    def summary(self) -> dict[str, Any]:
        """Rates, means and intervals, as JSON values; costs are of the successes alone."""
        efficiency, others = self.efficiency, self.values.keys() - {"success", "length", "cost"}
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
        """A row of the leaderboard, as JSON values, with every start."""
        starts = {"best": self.best, "bound": self.bounds, **self.values}
        return {
            "format": FORMAT,
            "env_id": self.env_id,
            "algo": self.policy,
            "config": dict(self.config),
            "evaluation_version": VERSION,
            "test_seed": self.seed,
            "cost": None if self.cost is None else list(self.cost),
            "policy": self.summary(),
            **self.provenance,
            "starts": {
                name: None if values is None else [_plain(value) for value in values.tolist()]
                for name, values in starts.items()
            },
        }

    def save(self, path: str | Path) -> Path:
        """Write the row, atomically; `read_evaluation` reads it.

        Args:
            path: A JSON file in a folder that exists.
        """
        file = Path(path)
        write_atomic(file, lined_json(self.row()))
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
            lines.append(f"{'efficiency':12}        -     no best is known for this task")
        label = "cost" if self.cost is None else self.cost.name
        unit = f" [{self.cost.unit}]" if self.cost is not None and self.cost.unit else ""
        parts = {"best known": self.mean(self.best), "bound": self.mean(self.bounds)}
        told = [f"{name} {value:.4g}" for name, value in parts.items() if not np.isnan(value)]
        told += [] if self.gap is None else [f"gap {100 * self.gap:.1f} %"]
        beside = f"     of successes; {', '.join(told)}" if told else "     of successes"
        lines.append(f"{label + unit:12}{_figure(self.mean(self.costs)):>9}{beside}")
        lines.append(f"{'return':12}{_figure(float(self.values['return'].mean())):>9}")
        if n := int(self.records.sum()):
            lines.append(f"better than the best known from {n} starts: keep it by rigid-envs best")
        return "\n".join(lines)


def read_evaluation(path: str | Path, *, anew: bool = False) -> Evaluation:
    """Read a row of the leaderboard, and compute its figures again.

    Args:
        path: A file that `Evaluation.save` wrote, or one with more entries beside.
        anew: Set it beside what is best known now, not what was then.

    Raises:
        DamagedFileError: Another format, or figures that do not follow from the starts.
        FileNotFoundError: No such file.
    """
    file = Path(path)
    try:
        found = evaluation_of(json.loads(read_bytes(file, _LIMIT)))
    except (KeyError, TypeError, ValueError) as error:
        why = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise DamagedFileError(f"{file}: {why}; write it anew: Evaluation.save") from error
    return up_to_date(found) if anew else found


def evaluation_of(row: Mapping[str, Any]) -> Evaluation:
    """The evaluation that a row was made of.

    Args:
        row: JSON values.

    Raises:
        ValueError: Another format, or figures that do not follow from the starts.
    """
    if row.get("format") != FORMAT or row.get("evaluation_version") != VERSION:
        raise ValueError(
            f"format = {row.get('format')!r}, evaluation_version = "
            f"{row.get('evaluation_version')!r}; expected {FORMAT!r}, {VERSION}"
        )
    starts = {name: None if each is None else _array(each) for name, each in row["starts"].items()}
    best, bounds = starts.pop("best"), starts.pop("bound")
    known = {name: values for name, values in starts.items() if values is not None}
    lengths = {len(values) for values in (best, bounds, *known.values()) if values is not None}
    if len(lengths) != 1:
        raise ValueError(f"starts: numbers of entries {sorted(lengths)}; expected one for all")
    found = Evaluation(
        env_id=row["env_id"],
        policy=row["algo"],
        config=row["config"],
        seed=row["test_seed"],
        cost=None if row["cost"] is None else Cost(*row["cost"]),
        values=known,
        best=best,
        bounds=bounds,
        provenance={key: row[key] for key in _PROVENANCE if key in row},
    )
    for name, value in json.loads(json.dumps(found.summary())).items():
        told = row["policy"].get(name)
        if told != value and not _close(told, value):
            raise ValueError(f"policy.{name} = {told!r}; expected {value!r}, as the starts have it")
    return found


def up_to_date(found: Evaluation) -> Evaluation:
    """An evaluation beside what is best known now, if it was beside what was then."""
    now = best_known(found.env_id)
    comparable = found.best is not None and found.seed == TEST_SEED
    if now is None or not comparable or found.n > len(now.costs):
        return found
    return found.against(now.costs[: found.n])


_PROVENANCE = (
    *("versions", "kernel_hash", "cpu", "cores", "system", "load"),
    *("git_commit", "git_dirty", "date"),
)


def _close(told: Any, value: Any) -> bool:
    """Whether numbers, or lists or mappings of them, agree but for rounding."""
    if isinstance(value, dict):
        return (
            isinstance(told, dict)
            and told.keys() == value.keys()
            and all(_close(told[key], value[key]) for key in value)
        )
    if told is None or value is None:
        return told is value
    try:
        return bool(np.allclose(told, value, rtol=1e-9, atol=1e-12))
    except (TypeError, ValueError):
        return False


def _array(values: list[Any]) -> Array:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _plain(value: float) -> float | None:
    return None if np.isnan(value) else value


def _figure(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4g}"
