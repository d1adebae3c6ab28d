"""The figures of a bench as text for people and as JSON for programs."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rigid_envs.cli.bench.accuracy import FreeRun
from rigid_envs.cli.bench.costs import FORMS, Cost
from rigid_envs.cli.bench.environments import COLUMNS
from rigid_envs.cli.bench.goals import FLAGSHIP, Goal
from rigid_envs.cli.bench.mujoco_body import Opponent
from rigid_envs.cli.bench.race import Result
from rigid_envs.cli.bench.startup import Startup
from rigid_envs.pages.tables import paragraphs, table
from rigid_envs.provenance import heading

__all__ = ["Figures"]


@dataclass(frozen=True)
class Figures:
    """All that a bench has found.

    Attributes:
        provenance: where and when, see `provenance`.
        rounds: rounds of the race.
        seconds: aimed length of a turn [s].
        results: speeds.
        opponents: the MuJoCo bodies, if it is installed.
        costs: of a step of every environment, beside the others.
        runs: free runs for 60 and 6000 s.
        startups: processes started.
        goals: figures with a target.
    """

    provenance: dict[str, Any]
    rounds: int
    seconds: float
    results: Sequence[Result]
    opponents: Sequence[Opponent]
    costs: Sequence[Cost]
    runs: Sequence[FreeRun]
    startups: Sequence[Startup]
    goals: Sequence[Goal]

    def as_json(self) -> dict[str, Any]:
        """JSON values, every sample among them."""
        return {
            "provenance": self.provenance,
            "rounds": self.rounds,
            "seconds_per_turn": self.seconds,
            "steps_per_second": [
                {**asdict(r), "median": r.median, "quartiles": r.quartiles} for r in self.results
            ],
            "mujoco": [{"name": o.name, **asdict(o)} for o in self.opponents],
            "costs": [asdict(cost) for cost in self.costs],
            "accuracy": [asdict(run) for run in self.runs],
            "import_to_first_step": [asdict(startup) for startup in self.startups],
            "goals": [{**asdict(goal), "is_met": goal.is_met} for goal in self.goals],
        }

    def as_text(self) -> str:
        """Tables for a page of 100 columns."""
        parts = [
            heading(self.provenance),
            self._speeds(),
            *self._mujoco(),
            *self._costs(),
            self._starts(),
            self._targets(),
        ]
        return "\n\n".join(parts)

    def _speeds(self) -> str:
        names = list(dict.fromkeys(result.name for result in self.results))
        cells = {(result.name, result.column): _speed(result) for result in self.results}
        rows = [(name, *(cells.get((name, column), "") for column in COLUMNS)) for name in names]
        title = (
            f"Environment steps per second, resets included: median and half the interquartile "
            f"range of {self.rounds} interleaved rounds of {1e3 * self.seconds:.0f} ms. Single as "
            "gymnasium.make gives it (made) and without its wrappers (bare); vectors of N rows in "
            "one thread; 4096 rows in 2 threads. By CPU time, but 2 threads by wall-clock time."
        )
        header = ("", *COLUMNS)
        return paragraphs(title, 0) + "\n\n" + table(header, rows, "<" + ">" * 7, indent=0)

    def _mujoco(self) -> list[str]:
        if not self.opponents:
            return []
        rows = [
            (o.name, f"{o.errors.energy:.1e}", f"{o.errors.duration:g} s", o.why)
            for o in self.opponents
        ]
        header = ("substeps per control period", "energy error", "within", "chosen for")
        return [table(header, rows, "<>>", indent=0)]

    def _costs(self) -> list[str]:
        if not self.costs:
            return []
        cells = {
            (cost.name, cost.column): (_seconds(cost.seconds), f"{cost.ratio:.2f}")
            for cost in self.costs
        }
        names = dict.fromkeys(cost.name for cost in self.costs)
        rows = [
            (name, *(cell for column in FORMS for cell in cells.get((name, column), ("", ""))))
            for name in names
        ]
        header = ["time of", *(word for text in FORMS.values() for word in (text, "x median"))]
        return [table(header, rows, "<" + ">" * 2 * len(FORMS), indent=0)]

    def _starts(self) -> str:
        rows = [(s.env_id, f"{s.medians[1]:.2f} s", f"{s.medians[0]:.2f} s") for s in self.startups]
        header = ("import to first step in a new process", "compiled before", "empty cache")
        return table(header, rows, "<>>", indent=0)

    def _targets(self) -> str:
        rows = [
            (
                goal.text,
                _number(goal.value) + ("" if goal.unit == "1" else f" {goal.unit}"),
                "" if goal.quartiles is None else " .. ".join(map(_number, goal.quartiles)),
                f"{'>=' if goal.at_least else '<='} {goal.target:g}",
                "met" if goal.is_met else "not met",
            )
            for goal in self.goals
        ]
        header = (f"goal ({FLAGSHIP})", "measured", "quartiles", "target", "")
        return table(header, rows, "<>>>", indent=0)


def _speed(result: Result) -> str:
    """Median and half the interquartile range: ``1.23M 4%``."""
    low, high = result.quartiles
    return f"{_steps(result.median)} {50.0 * (high - low) / result.median:2.0f}%"


def _steps(speed: float) -> str:
    unit, size = ("M", 1e6) if speed >= 999.5e3 else ("k", 1e3)
    return f"{speed / size:.3g}{unit}"


def _seconds(time: float) -> str:
    return f"{1e6 * time:.2f} us" if time >= 1e-6 else f"{1e9 * time:.1f} ns"


def _number(value: float) -> str:
    """Three digits; an exponent where the number is tiny."""
    if abs(value) < 1e-3:
        return f"{value:.2e}"
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"
