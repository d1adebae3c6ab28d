"""`rigid-envs bench`: the figures as tables."""

from collections.abc import Sequence
from typing import Any

from rigid_envs.bench import Figures
from rigid_envs.bench.accuracy import FreeRun
from rigid_envs.bench.costs import FORMS
from rigid_envs.bench.interleaved import Throughput
from rigid_envs.bench.workloads import COLUMNS
from rigid_envs.pages.tables import paragraphs, table
from rigid_envs.provenance import heading

__all__ = ["as_factor", "as_text", "as_time"]


def as_text(where: dict[str, Any], figures: Figures) -> str:
    """Tables, 100 columns wide.

    Args:
        where: versions, machine and date, see `provenance`.
        figures: what was measured.
    """
    parts = (
        heading(where),
        _speeds(figures),
        _mujoco(figures),
        _costs(figures),
        _ratios(figures),
        _accuracy(figures.runs),
        _startups(figures),
    )
    return "\n\n".join(filter(None, parts))


def _speeds(figures: Figures) -> str:
    names = list(dict.fromkeys(speed.name for speed in figures.speeds))
    cells = {(speed.name, speed.column): _speed(speed) for speed in figures.speeds}
    rows = [(name, *(cells.get((name, column), "") for column in COLUMNS)) for name in names]
    title = (
        f"Environment steps per second, resets included: median and half the interquartile "
        f"range of {figures.rounds} interleaved rounds of {1e3 * figures.seconds:.0f} ms. Single "
        "as gymnasium.make gives it (made) and without its wrappers (bare); vectors of N rows in "
        "one thread; 4096 rows in 2 threads. By CPU time, but 2 threads by wall-clock time."
    )
    header = ("", *COLUMNS)
    return paragraphs(title, 0) + "\n\n" + table(header, rows, "<" + ">" * 7, indent=0)


def _mujoco(figures: Figures) -> str:
    rows = [
        (s.name, f"{s.errors.energy:.1e}", f"{s.errors.duration:g} s", s.why)
        for s in figures.mujoco
    ]
    header = ("substeps per control period", "energy error", "within", "chosen for")
    return table(header, rows, "<>>", indent=0) if rows else ""


def _costs(figures: Figures) -> str:
    cells = {
        (cost.name, cost.column): (as_time(cost.seconds), f"{cost.ratio:.2f}")
        for cost in figures.costs
    }
    names = dict.fromkeys(name for name, _ in cells)
    rows = [
        (name, *(cell for column in FORMS for cell in cells.get((name, column), ("", ""))))
        for name in names
    ]
    header = ["time of", *(word for text in FORMS.values() for word in (text, "x median"))]
    return table(header, rows, "<" + ">" * 2 * len(FORMS), indent=0) if rows else ""


def _ratios(figures: Figures) -> str:
    rows = [
        (r.name, r.form, r.peer, as_factor(r.median), " .. ".join(map(as_factor, r.quartiles)))
        for r in figures.ratios
    ]
    header = ("speed of", "form", "against", "median", "quartiles")
    return table(header, rows, "<<<>>", indent=0) if rows else ""


def _accuracy(runs: Sequence[FreeRun]) -> str:
    rows = [
        (
            f"{run.duration:g} s in steps of {run.dt:g} s",
            *(f"{error:.1e}" for error in (run.L_squared, run.energy, run.omega_end)),
        )
        for run in runs
    ]
    header = ("error of a free body", "|L|^2, relative", "energy, relative", "final omega [rad/s]")
    return table(header, rows, "<>>>", indent=0)


def _startups(figures: Figures) -> str:
    rows = [(s.env_id, f"{s.medians[1]:.2f} s", f"{s.medians[0]:.2f} s") for s in figures.startups]
    header = ("import to first step in a new process", "compiled before", "empty cache")
    return table(header, rows, "<>>", indent=0)


def _speed(speed: Throughput) -> str:
    """Median and half the interquartile range: ``1.23M 4%``."""
    low, high = speed.quartiles
    return f"{_steps(speed.median)} {50.0 * (high - low) / speed.median:2.0f}%"


def _steps(speed: float) -> str:
    unit, size = ("M", 1e6) if speed >= 999.5e3 else ("k", 1e3)
    return f"{speed / size:.3g}{unit}"


def as_time(time: float) -> str:
    """A time of a step [s]: ``1.23 us`` or ``45.6 ns``."""
    return f"{1e6 * time:.2f} us" if time >= 1e-6 else f"{1e9 * time:.1f} ns"


def as_factor(ratio: float) -> str:
    """A ratio: ``1.23 x``."""
    return f"{ratio:.3g} x" if ratio < 999.5 else f"{ratio:.0f} x"
