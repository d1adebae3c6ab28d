"""Holonomy of a rolling ball: it comes back turned, by the area that it ran round."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.analytic import rolling_ball as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.space import bare
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, MUTED, RED
from rigid_envs.systems import RollingBall, Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["HOLONOMY"]

Array = npt.NDArray[np.float64]
_BALL = RollingBall(radius=1.0)
_SIZES = np.linspace(0.1, math.sqrt(3.0), 18)  # radii of the circles


def draw(figure: Figure) -> tuple[Number, ...]:
    """Roll round circles of many sizes; compare the turn that is left with the closed form."""
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    turns = _roll_round(_SIZES, 4000)["q"][-1]
    error = float(np.max(rotations.distance(turns, theory.circle_holonomy(_SIZES, 1.0))))
    angles = rotations.angle(turns)
    _draw_turns(right, angles)
    _squares(right)
    _draw_loop(left)
    figure.legend(ncols=4, columnspacing=1.2)
    small = float(angles[0]) / (math.pi * float(_SIZES[0]) ** 2)
    return (
        Number("largest error of the turn against the closed form", error, 0.0, 1e-5, "rad"),
        Number("turn over A / r^2, circle of radius r / 10", small, 1.0, 3e-3),
    )


def _roll_round(sizes: Array, n: int) -> Trajectory:
    """Roll counter-clockwise round polygons of n sides in circles of these radii, all at once."""
    a = 2.0 * math.pi * (np.arange(n) + 0.5) / n
    sides = 2.0 * n * math.sin(math.pi / n) * np.stack([-np.sin(a), np.cos(a), 0.0 * a], axis=-1)
    y = _BALL.state(position=sizes[:, None] * [1.0, 0.0])
    return _BALL.simulate(y, np.linspace(0.0, 1.0, n + 1), sides[:, None] * sizes[:, None])


def _draw_turns(axes: Axes, angles: Array) -> None:
    """Turn against area, beyond half a turn as well."""
    fine = np.linspace(1e-3, math.sqrt(3.0), 200)
    whole = np.linalg.norm(theory.circle_rotation_vector(fine, 1.0), axis=-1) - 2.0 * math.pi
    area = math.pi * fine**2
    axes.plot(area, np.degrees(whole), color=BLUE, label="closed form")
    axes.plot(area, np.degrees(area), color=RED, ls="--", lw=1.3, label="A / r^2")
    grown: list[float] = [0.0, 0.0]
    for angle in angles.tolist():  # a turn by an angle is one by the rest of a whole turn, too
        ahead = 2.0 * grown[-1] - grown[-2]
        grown.append(min(angle, 2.0 * math.pi - angle, key=lambda value: abs(value - ahead)))
    dots: dict[str, Any] = {"color": BLACK, "ms": 4.5, "zorder": 4}
    axes.plot(math.pi * _SIZES**2, np.degrees(grown[2:]), "o", label="simulated, circle", **dots)
    axes.set_xlim(0.0, 9.6), axes.set_ylim(0.0, 375.0)
    axes.set_xlabel("area A of the loop, over r^2")
    axes.set_title("turn of the ball [degrees]")


def _squares(axes: Axes) -> None:
    size = np.array([0.5, 1.0, 1.5, 2.0])
    sides = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    y = _BALL.state(position=np.zeros((4, 2)))
    turns = _BALL.simulate(y, np.arange(5.0), sides[:, None] * size[:, None])["q"][-1]
    angles = np.degrees(rotations.angle(turns))
    axes.plot(size**2, angles, "s", color=GREEN, ms=5, zorder=4, label="simulated, square")


def _draw_loop(axes: Axes) -> None:
    """A round of half a radius, and the ball on the way; loop drawn larger than the ball."""
    bare(axes)
    axes.set_title("once round, counter-clockwise, from above")
    n = 8 * 30
    motion = _roll_round(np.array([0.5]), n)
    place, R = 4.4 * motion["position"][:, 0], motion["R"][:, 0]
    axes.plot(*place.T, color=MUTED, lw=1.2, zorder=1)
    for k in range(0, n, 30):
        _draw_ball(axes, place[k], R[k])
    beside = place[0] + [1.75, 0.0]
    _draw_ball(axes, beside, R[-1])
    axes.text(place[0, 0] - 0.85, 0.0, "start", ha="right", va="center", color=MUTED)
    axes.text(beside[0], -1.1, "end", ha="center", color=MUTED)


def _draw_ball(axes: Axes, place: Array, R: Array) -> None:
    """A ball from above: the mark runs from the body axis e3 (dot) to e1."""
    size = 0.72
    a = np.linspace(0.0, 2.0 * math.pi, 145)
    rim = place + size * np.stack([np.cos(a), np.sin(a)], axis=-1)
    axes.fill(*rim.T, fc="#eef2f6", ec=MUTED, lw=0.9, zorder=2)
    for first, second in ((0, 1), (1, 2), (2, 0)):
        ring = np.outer(np.cos(a), R[:, first]) + np.outer(np.sin(a), R[:, second])
        page = np.where(ring[:, 2:] >= 0.0, place + size * ring[:, :2], np.nan)
        axes.plot(*page.T, color="#b9c3cf", lw=0.8, zorder=2.2)
    b = np.linspace(0.0, 0.5 * math.pi, 46)
    mark = np.outer(np.cos(b), R[:, 2]) + np.outer(np.sin(b), R[:, 0])
    page = np.where(mark[:, 2:] >= -1e-9, place + size * mark[:, :2], np.nan)
    axes.plot(*page.T, color=RED, lw=2.4, zorder=3)
    if R[2, 2] > 0.0:
        axes.plot(*(place + size * R[:2, 2]), "o", color=BLUE, ms=5, zorder=4)


HOLONOMY = Entry(
    name="holonomy",
    title="Holonomy of a ball: area against turn",
    caption="A ball that rolls round a loop comes back turned, for a small loop by A / r^2 about "
    "the vertical, whatever its shape. Left: a ball with a mark from e3 (dot) to e1 rolls round a "
    "circle of radius r / 2, drawn larger; the red mark comes back turned.",
    law="turn = 2 pi (sqrt(1 + rho^2) - 1), rho = radius of the circle / r;  -A / r^2 for small A",
    source="Hammersley 1983; Jurdjevic 1993, doi:10.1007/BF00375605",
    draw=draw,
    size=(7.2, 4.2),
)
