"""Plot of the learning curve of a run."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from rigid_envs.base.files import write_atomic
from rigid_envs.scores.leaderboard import INK, MUTED, dress, file_of
from rigid_envs.scores.statistics import wilson_interval

from ..storage.logs import read_evaluations
from ..storage.runs import Run

_HELD_OUT, _TRAINING = "#1f5fbf", "#c9772b"


def draw_learning_curve(run: Run) -> Path:
    """Draw success and return against steps, in training and on the held-out starts.

    Args:
        run: A run with `progress.csv` and `evaluations.npz`.

    Returns:
        The picture, `learning_curve.png`.
    """
    with open(run / "progress.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    held_out = read_evaluations(run / "evaluations.npz")
    config = run.config()
    figure = Figure(figsize=(8.0, 6.4), dpi=150, layout="constrained", facecolor="white")
    top, bottom = figure.subplots(2, 1, sharex=True)
    _draw_success(top, rows, held_out)
    _draw_return(bottom, rows, held_out)
    top.set_title(
        f"{config.env_id}   {config.algo.upper()}   seed {config.seed}",
        loc="left", fontsize=12, color=INK, pad=26,
    )  # fmt: skip
    bottom.set_xlabel("environment steps", color=MUTED)
    bottom.xaxis.set_major_formatter(FuncFormatter(short_number))
    bottom.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]))
    bottom.set_xlim(0, 1.02 * held_out["timesteps"].max(initial=1))
    figure.align_ylabels()
    path = run / "learning_curve.png"
    write_atomic(path, file_of(figure))
    return path


def _draw_success(axes: Axes, rows: Sequence[dict[str, str]], held_out: dict[str, Any]) -> None:
    steps, wins = held_out["timesteps"], held_out["successes"]
    ends = np.array([wilson_interval(int(row.sum()), len(row)) for row in wins])
    axes.plot(*_column(rows, "rollout/success_rate", 100), color=_TRAINING, lw=1.3, alpha=0.9,
              label="training, last 500 episodes")  # fmt: skip
    axes.fill_between(steps, *(100 * ends.T), color=_HELD_OUT, alpha=0.15, lw=0)
    axes.plot(steps, 100 * wins.mean(axis=1), color=_HELD_OUT, lw=2, marker="o", ms=3.5,
              label=f"{wins.shape[1]} held-out starts, 95 % interval")  # fmt: skip
    axes.set_ylim(-3, 103)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f} %"))
    dress(axes, "success")
    axes.legend(
        loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=2, frameon=False, fontsize=9,
        labelcolor=MUTED, borderaxespad=0.2, handlelength=1.6,
    )  # fmt: skip


def _draw_return(axes: Axes, rows: Sequence[dict[str, str]], held_out: dict[str, Any]) -> None:
    steps, results = held_out["timesteps"], held_out["results"]
    low, high = np.quantile(results, [0.25, 0.75], axis=1)
    axes.plot(*_column(rows, "rollout/ep_rew_mean"), color=_TRAINING, lw=1.3, alpha=0.9)
    axes.fill_between(steps, low, high, color=_HELD_OUT, alpha=0.15, lw=0)
    axes.plot(steps, results.mean(axis=1), color=_HELD_OUT, lw=2, marker="o", ms=3.5)
    axes.annotate("band: middle half of the episodes", (0.99, 0.04), xycoords="axes fraction",
                  ha="right", fontsize=9, color=MUTED)  # fmt: skip
    dress(axes, "return of an episode")


def _column(
    rows: Sequence[dict[str, str]], name: str, scale: float = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    points = [(float(row["time/total_timesteps"]), float(row[name])) for row in rows if row[name]]
    steps, values = np.array(points).reshape(-1, 2).T
    return steps, scale * values


def short_number(value: float, _: object = None) -> str:
    """A number of steps as 3 M or 200 k."""
    for size, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= size:
            return f"{value / size:g} {letter}"
    return f"{value:g}"
