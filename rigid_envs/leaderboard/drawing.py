"""The plot of the leaderboard."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.leaderboard.escaping import in_plot
from rigid_envs.leaderboard.rows import Row, kind_of
from rigid_envs.leaderboard.style import INK, MUTED, dress, look
from rigid_envs.render.needed import needed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw", "require_matplotlib"]


def require_matplotlib() -> None:
    """Import matplotlib.

    Raises:
        DependencyNotInstalled: it is missing; names the command that installs it.
    """
    needed("matplotlib", "the plot of the leaderboard needs matplotlib")


def draw(results: Sequence[Row]) -> Figure:
    """One line for each environment, with the efficiency of each policy and its interval.

    Args:
        results: Ranked ones, in the order of the lines.
    """
    from matplotlib.figure import Figure

    ids = list(dict.fromkeys(each.env_id for each in results))
    names = list(dict.fromkeys(map(kind_of, results)))
    figure = Figure(
        figsize=(8.0, 1.4 + 0.36 * len(ids)), dpi=150, layout="constrained", facecolor="white"
    )
    axes = figure.subplots()
    for k, name in enumerate(names):
        own = [each for each in results if kind_of(each) == name]
        figures = np.array([each.efficiency for each in own])
        at = [-ids.index(r.env_id) - 0.5 * (k / max(len(names) - 1, 1) - 0.5) for r in own]
        colour, marker = look(k)
        axes.hlines(at, figures[:, 1], figures[:, 2], color=colour, lw=1.6, alpha=0.6)
        axes.plot(figures[:, 0], at, marker, ms=4.5, color=colour, label=in_plot(name))
    axes.set_yticks([-k for k in range(len(ids))], [i.split("/")[-1] for i in ids], color=INK)
    axes.set_xlim(-0.02, 1.02)
    dress(axes, "")
    axes.set_xlabel("efficiency", color=MUTED)
    if names:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8,
                    labelcolor=MUTED)  # fmt: skip
    return figure
