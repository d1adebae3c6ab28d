"""Pictures of three dimensions as lines on the page: parallel projection, hidden parts told apart.

All coordinates are in the axes of the picture: x, y and z, z up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rigid_envs.gallery.style import INK, MUTED, SURFACE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Camera", "arrow", "bare", "circle", "curve", "page_arrow", "solid", "surface_grid"]

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Camera:
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

    def faces(self, points: Array, tensor: npt.ArrayLike) -> Mask:
        """Whether points of the ellipsoid x . A x = 1 are on the side of the eye, shape (...)."""
        return np.asarray(points @ np.asarray(tensor) @ self.axes[2] >= 0.0)

    def behind(self, points: Array, tensor: npt.ArrayLike) -> Mask:
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
    camera: Camera,
    points: Array,
    seen: Mask | None = None,
    *,
    faint: float = 0.2,
    **style: Any,
) -> None:
    """Draw a curve; what is hidden is thin and faint.

    Args:
        axes: where.
        camera: the eye.
        points: shape (n, 3).
        seen: which of them are in view; all, if left out.
        faint: opacity of what is hidden.
        **style: of the line.
    """
    page = camera.project(points)
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
    camera: Camera,
    start: npt.ArrayLike,
    end: npt.ArrayLike,
    text: str = "",
    color: str = INK,
    **style: Any,
) -> None:
    """Draw an arrow with a text beyond its head."""
    tail, head = camera.project(start), camera.project(end)
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


def solid(axes: Axes, camera: Camera, semi_axes: npt.ArrayLike = (1.0, 1.0, 1.0)) -> None:
    """Fill the outline of an ellipsoid whose axes are x, y and z."""
    sizes = np.asarray(semi_axes, dtype=np.float64)
    rim = circle(camera.axes[2] / sizes, 1.0, np.zeros(3)) * sizes
    axes.fill(*camera.project(rim).T, fc=SURFACE, ec=MUTED, lw=0.9, zorder=1.0)


def surface_grid(
    axes: Axes, camera: Camera, semi_axes: npt.ArrayLike = (1.0, 1.0, 1.0), step: int = 30
) -> None:
    """Draw meridians and parallels of an ellipsoid on the side of the eye."""
    sizes = np.asarray(semi_axes, dtype=np.float64)
    along, tensor = np.radians(np.linspace(-180, 180, 181)), np.diag(sizes**-2.0)
    grid = [(np.full(181, np.radians(v)), along) for v in range(-90 + step, 90, step)]
    grid += [(along, np.full(181, np.radians(v))) for v in range(0, 180, step)]
    for lat, lon in grid:
        line = [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
        points = np.stack(line, axis=-1) * sizes
        page = np.where(camera.faces(points, tensor)[:, None], camera.project(points), np.nan)
        axes.plot(*page.T, color="#d5dbe3", lw=0.6, zorder=1.2)
