"""The frame of a figure of the gallery: its claim, its numbers, its looks."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Bools, one_named
from rigid_envs.envs.display import needed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# A figure of the gallery as data: what it shows, the law, the source, how it is drawn.


class Match(NamedTuple):
    """A quantity that a figure computes in two ways.

    Attributes:
        what: the quantity; of an error, the two sides that are compared.
        value: as simulated, or the error.
        expected: by theory; 0 for an error.
        bound: largest difference of the two that is allowed.
        unit: of both; empty for a pure number.
    """

    what: str
    value: float
    expected: float
    bound: float
    unit: str = ""

    @property
    def error(self) -> float:
        """Difference of the two values."""
        return abs(self.value - self.expected)

    @property
    def holds(self) -> bool:
        """Whether the difference is within the bound; NaN never is."""
        return self.error <= self.bound

    def __str__(self) -> str:
        """One line: an error alone, or both values and their difference."""
        unit = f" {self.unit}" if self.unit else ""
        if self.expected == 0.0:
            return f"{self.what}: {self.value:.0e}{unit}"
        apart = f"{self.error:.0e}" if self.error else "0"
        return (
            f"{self.what}: {self.value:.6g}{unit} simulated, "
            f"{self.expected:.6g}{unit} by theory, difference {apart}"
        )

    def as_json(self) -> dict[str, Any]:
        """JSON values."""
        return {
            "what": self.what,
            "value": float(self.value),
            "expected": float(self.expected),
            "error": float(self.error),
            "bound": self.bound,
            "unit": self.unit,
            "holds": bool(self.holds),
        }


Draw = Callable[..., tuple[Match, ...]]
"""Draws into an empty figure, with parameters of its own, and gives the numbers that it shows."""


class Exhibit(NamedTuple):
    """A figure, and the function that makes it: ``flip(omega=(0.1, 1.0, 0.1))``.

    Attributes:
        name: on the command line, and of the files.
        title: heading of the picture.
        caption: what is seen, in one or two sentences.
        law: equation in plain text.
        source: book or paper of the law.
        draw: draws it; its keywords are the parameters, its numbers begin with the main one.
        size: width and height [inch].
    """

    name: str
    title: str
    caption: str
    law: str
    source: str
    draw: Draw
    size: tuple[float, float]

    @property
    def command(self) -> str:
        """The command that makes the figure."""
        return f"rigid-envs gallery {self.name} --out DIR"

    @property
    def code(self) -> str:
        """Source of the function that draws it, without its helpers."""
        source = inspect.getsource(self.draw)
        return source[source.index("def ") :]

    @property
    def __signature__(self) -> inspect.Signature:
        """What a call takes: the keywords of `draw`, with those of the gallery left out."""
        signature = inspect.signature(self.draw)
        return signature.replace(parameters=[*signature.parameters.values()][1:])

    def __call__(self, **parameters: Any) -> Figure:
        """The figure, with title, legend and numbers.

        Args:
            **parameters: in place of those of the gallery, by the names of `draw`.

        Raises:
            DependencyNotInstalled: matplotlib is missing.
            ValueError: a parameter that the figure does not take, or one that makes no sense.
        """
        return self.compose(**parameters)[0]

    def compose(self, **parameters: Any) -> tuple[Figure, tuple[Match, ...]]:
        """The same with its numbers."""
        needed("matplotlib", "figures need matplotlib")
        from matplotlib import rc_context

        for name in parameters:
            one_named(name, self.__signature__.parameters, "parameter")
        with rc_context(cast(Any, STYLE)):
            figure, height = new_figure(self.size), self.size[1]
            numbers = self.draw(figure, **parameters)
            # Title on top; at the bottom the legend of the figure, if it has one, and the numbers.
            figure.text(
                0.014, 1.0 - 0.1 / height, self.title,
                va="top", fontsize=12.5, fontweight="bold", in_layout=False,
            )  # fmt: skip
            figure.text(
                0.014, 0.09 / height, "\n".join(map(str, numbers)),
                va="bottom", fontsize=8.5, color=MUTED, linespacing=1.35, in_layout=False,
            )  # fmt: skip
            below = 0.14 + 0.165 * len(numbers)
            for legend in figure.legends:
                legend.set_in_layout(False)
                legend.set_loc("lower center")
                legend.set_bbox_to_anchor((0.5, below / height))
                below += 0.07 + 0.2 * math.ceil(len(legend.get_texts()) / legend._ncols)  # type: ignore[attr-defined]
            lay_out(figure, below, 0.38)
        return figure, numbers


def exhibit(
    *, title: str, caption: str, law: str, source: str, size: tuple[float, float] = (7.2, 4.2)
) -> Callable[[Draw], Exhibit]:
    """Decorator that makes a figure of the function that draws it, with its name.

    Args:
        title: as of `Exhibit`.
        caption: likewise.
        law: likewise.
        source: likewise.
        size: likewise.
    """
    return lambda draw: Exhibit(draw.__name__, title, caption, law, source, draw, size)


# Look of all figures: fonts, colours, grid, sizes. Readable where the page is 700 pixels wide.

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


def new_figure(size: tuple[float, float]) -> Figure:
    """An empty figure, white, to draw into; Jupyter shows it.

    Args:
        size: width and height [inch].
    """
    from rigid_envs.watch.figure_class import ShownFigure

    return ShownFigure(figsize=size, layout=None)


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


# Pictures of three dimensions as lines on the page: parallel projection, hidden parts told apart.
#
# All coordinates are in the axes of the picture: x, y and z, z up.


class Eye(NamedTuple):
    """A far eye.

    Attributes:
        azimuth: of the eye, from x towards y [degrees].
        elevation: of the eye above the plane z = 0 [degrees].
    """

    azimuth: float
    elevation: float

    @property
    def axes(self) -> Array:
        """Unit vectors to the right, up, and towards the eye, the rows of (3, 3)."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        toward = [math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)]
        right = [-math.sin(a), math.cos(a), 0.0]
        return np.array([right, np.cross(toward, right), toward])

    def project(self, points: npt.ArrayLike) -> Array:
        """Place on the page, shape (..., 2), of points, shape (..., 3)."""
        return np.asarray(np.asarray(points, dtype=np.float64) @ self.axes[:2].T)

    def faces(self, points: Array, tensor: npt.ArrayLike) -> Bools:
        """Whether points of the ellipsoid x . A x = 1 are on the side of the eye, shape (...)."""
        return np.asarray(points @ np.asarray(tensor) @ self.axes[2] >= 0.0)

    def behind(self, points: Array, tensor: npt.ArrayLike) -> Bools:
        """Whether the ellipsoid x . A x = 1 hides points outside of it, shape (...)."""
        A, d = np.asarray(tensor), self.axes[2]
        a, b = d @ A @ d, points @ A @ d
        c = np.sum(points @ A * points, axis=-1) - 1.0
        return np.asarray((b * b - a * c > 0.0) & (b < 0.0))


def bare(axes: Axes) -> None:
    """Make a panel for a picture: equal scales, no axes."""
    axes.set_aspect("equal")
    axes.set_anchor("N")
    axes.axis("off")


def curve(
    axes: Axes,
    eye: Eye,
    points: Array,
    seen: Bools | None = None,
    *,
    faint: float = 0.2,
    **style: Any,
) -> None:
    """Draw a curve; what is hidden is thin and faint.

    Args:
        axes: where.
        eye: the eye.
        points: shape (n, 3).
        seen: which of them are in view; all, if left out.
        faint: opacity of what is hidden.
        **style: of the line.
    """
    page = eye.project(points)
    seen = np.ones(len(page), dtype=bool) if seen is None else seen
    beside = np.zeros_like(seen)  # a hidden part begins at the last point that is seen
    beside[1:] |= ~seen[:-1]
    beside[:-1] |= ~seen[1:]
    hidden = ~seen | beside
    style = {"lw": 1.6, "solid_capstyle": "butt", **style}
    if not seen.all():
        thin = {**style, "lw": 0.6 * style["lw"], "alpha": faint, "label": None, "zorder": 2.4}
        axes.plot(*np.where(hidden[:, None], page, np.nan).T, **thin)
    axes.plot(*np.where(seen[:, None], page, np.nan).T, **{"zorder": 3.0, **style})


def arrow(
    axes: Axes,
    eye: Eye,
    start: npt.ArrayLike,
    end: npt.ArrayLike,
    text: str = "",
    color: str = INK,
    **style: Any,
) -> None:
    """Draw an arrow with a text beyond its head."""
    tail, head = eye.project(start), eye.project(end)
    page_arrow(axes, tail, head, color, **style)
    axes.plot(*np.stack([tail, head]).T, alpha=0.0)  # arrows alone do not count for the limits
    if text:
        way = 9.0 * (head - tail) / max(float(np.hypot(*(head - tail))), 1e-12)
        axes.annotate(
            text, _pair(head), _pair(way), textcoords="offset points", color=color,
            ha="center", va="center", zorder=5.0, annotation_clip=False,
        )  # fmt: skip


def page_arrow(
    axes: Axes, start: npt.ArrayLike, end: npt.ArrayLike, color: str, **style: Any
) -> None:
    """Draw an arrow between two points of the page, shape (2,)."""
    look = {"arrowstyle": "-|>", "color": color, "lw": 1.6, "shrinkA": 0.0, "shrinkB": 0.0, **style}
    axes.annotate("", _pair(end), _pair(start), arrowprops=look, zorder=4.0)


def _pair(point: npt.ArrayLike) -> tuple[float, float]:
    x, y = np.asarray(point, dtype=np.float64).tolist()
    return x, y


def circle(normal: npt.ArrayLike, radius: float, centre: npt.ArrayLike, n: int = 181) -> Array:
    """Points of a circle in space, shape (n, 3)."""
    axis = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first)
    a = np.linspace(0.0, 2.0 * np.pi, n)[:, None]
    around = np.cos(a) * first + np.sin(a) * np.cross(axis, first)
    return np.asarray(np.asarray(centre) + radius * around)


def solid(axes: Axes, eye: Eye, semi_axes: npt.ArrayLike = (1.0, 1.0, 1.0)) -> None:
    """Fill the outline of an ellipsoid whose axes are x, y and z."""
    sizes = np.asarray(semi_axes, dtype=np.float64)
    rim = circle(eye.axes[2] / sizes, 1.0, np.zeros(3)) * sizes
    axes.fill(*eye.project(rim).T, fc=SURFACE, ec=MUTED, lw=0.9, zorder=1.0)


def surface_grid(
    axes: Axes, eye: Eye, semi_axes: npt.ArrayLike = (1.0, 1.0, 1.0), step: int = 30
) -> None:
    """Draw meridians and parallels of an ellipsoid on the side of the eye."""
    sizes = np.asarray(semi_axes, dtype=np.float64)
    along, tensor = np.radians(np.linspace(-180, 180, 181)), np.diag(sizes**-2.0)
    grid = [(np.full(181, np.radians(v)), along) for v in range(-90 + step, 90, step)]
    grid += [(along, np.full(181, np.radians(v))) for v in range(0, 180, step)]
    for lat, lon in grid:
        line = [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
        points = np.stack(line, axis=-1) * sizes
        page = np.where(eye.faces(points, tensor)[:, None], eye.project(points), np.nan)
        axes.plot(*page.T, color="#d5dbe3", lw=0.6, zorder=1.2)
