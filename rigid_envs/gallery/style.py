"""Look of all figures: fonts, colours, grid, sizes. Readable where the page is 700 pixels wide."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

from rigid_envs.render.needed import needed

__all__ = [
    "BLACK",
    "BLUE",
    "DPI",
    "GREEN",
    "GRID",
    "INK",
    "MUTED",
    "ORANGE",
    "PURPLE",
    "RED",
    "SKY",
    "STYLE",
    "SURFACE",
    "lay_out",
    "new_figure",
    "require_matplotlib",
]

# Okabe & Ito's colours, which people with colour-blindness tell apart.
BLUE, RED, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
SKY, ORANGE, BLACK = "#56B4E9", "#E69F00", "#000000"
INK, MUTED, GRID, SURFACE = "#22272e", "#5b6470", "#e3e7ec", "#f1f4f8"

DPI = 125
"""Pixels per inch of the pictures: a figure 7.2 inches wide has 900."""

STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same letters everywhere
    "font.size": 9.5,
    "mathtext.fontset": "dejavusans",
    "axes.titlesize": 10.0,
    "axes.titleweight": "normal",
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "axes.titlepad": 7.0,
    "axes.labelsize": 9.5,
    "axes.labelcolor": MUTED,
    "axes.edgecolor": "#b4bcc6",
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "xtick.major.size": 0.0,
    "ytick.major.size": 0.0,
    "lines.linewidth": 1.8,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "legend.labelcolor": INK,
    "legend.handlelength": 1.5,
    "legend.borderaxespad": 0.3,
    "figure.facecolor": "white",
    "figure.dpi": DPI,
    "savefig.dpi": DPI,
    "svg.hashsalt": "rigid-envs",  # the same names of clip paths in every run
    "path.simplify": True,
}


def require_matplotlib() -> None:
    """Import matplotlib.

    Raises:
        DependencyNotInstalled: it is missing; names the command that installs it.
    """
    needed("matplotlib", "figures need matplotlib")


def new_figure(size: tuple[float, float]) -> Figure:
    """An empty figure, white, to draw into.

    Args:
        size: width and height [inch].
    """
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout=None)


def lay_out(figure: Figure, below: float, above: float) -> None:
    """Let the panels fill what is left between the lower and the upper edge, labels included.

    Args:
        figure: with its panels.
        below: height of what is at the bottom [inch].
        above: height of what is on top [inch].
    """
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    height = figure.get_figheight()
    rect = (0.0, below / height, 1.0, 1.0 - (below + above) / height)
    engine = ConstrainedLayoutEngine(rect=rect, w_pad=0.07, h_pad=0.07, wspace=0.05, hspace=0.05)
    figure.set_layout_engine(engine)
