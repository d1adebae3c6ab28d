"""Looks of the plots of policies: colours, markers, grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["INK", "MUTED", "dress", "look"]

INK, MUTED, _GRID = "#22272e", "#6b7480", "#e3e7ec"
_COLOURS = ("#1f5fbf", "#c9772b", "#3a8f5c", "#8a4fbf", "#b8383d", "#2a9aa8", "#7a7f2b", "#6b7480")
_MARKERS = "osD^v"


def look(k: int) -> tuple[str, str]:
    """Colour and marker of the k-th of many policies; no two of the first 40 look the same."""
    rounds, colour = divmod(k, len(_COLOURS))
    return _COLOURS[colour], _MARKERS[rounds % len(_MARKERS)]


def dress(axes: Axes, label: str) -> None:
    """Give a plot our looks.

    Args:
        axes: The plot.
        label: What its vertical axis shows.
    """
    axes.set_ylabel(label, color=MUTED)
    axes.grid(True, color=_GRID, lw=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(colors=MUTED, length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.spines["bottom"].set_color(_GRID)
