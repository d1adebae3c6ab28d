"""Holonomy of a rolling ball: it comes back turned, by the area that it ran round."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.analytic import rolling_ball as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.space import bare
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, MUTED, RED
from rigid_envs.systems import RollingBall

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
    turns = [_turn_after_circle(float(size)) for size in _SIZES]
    exact = theory.circle_holonomy(_SIZES, 1.0)
    error = float(np.max(rotations.distance(np.array(turns), exact)))
    area = math.pi * _SIZES**2
    angle = np.array([float(rotations.angle(turn)) for turn in turns])
    grown = np.concatenate([angle[: int(np.argmax(angle)) + 1], 2 * math.pi - angle[int(np.argmax(angle)) + 1 :]])
    fine = np.linspace(1e-3, math.sqrt(3.0), 200)
    whole = np.linalg.norm(theory.circle_rotation_vector(fine, 1.0), axis=-1) - 2.0 * math.pi
    right.plot(math.pi * fine**2, np.degrees(whole), color=BLUE, label="closed form")
    right.plot(math.pi * fine**2, np.degrees(math.pi * fine**2), color=RED, ls="--", lw=1.3, label="A / r^2")
    right.plot(area, np.degrees(grown), "o", color=BLACK, ms=4.5, label="simulated, circle", zorder=4)
    _squares(right)
    right.set_xlim(0.0, 9.6), right.set_ylim(0.0, 375.0)
    right.set_xlabel("area A of the loop, over r^2")
    right.set_title("turn of the ball [degrees]")
    _draw_loop(left)
    figure.legend(ncols=4, columnspacing=1.2)
    small = float(rotations.angle(_turn_after_circle(0.1))) / (math.pi * 0.01)
    return (
        Number("largest error of the turn against the closed form", error, 0.0, 1e-5, "rad"),
        Number("turn over A / r^2, circle of radius r / 10", small, 1.0, 3e-3),
    )


def _turn_after_circle(size: float, n: int = 4000) -> Array:
    """Turn after one round, rolled along a polygon of n sides, counter-clockwise."""
    a = 2.0 * math.pi * (np.arange(n) + 0.5) / n
    speed = 2.0 * n * size * math.sin(math.pi / n)  # sides of the polygon with these corners
    velocity = speed * np.stack([-np.sin(a), np.cos(a), np.zeros(n)], axis=-1)
    return np.asarray(_BALL.simulate(_BALL.state(), np.linspace(0.0, 1.0, n + 1), velocity)["q"][-1])


def _squares(axes: Axes) -> None:
    for side in (0.5, 1.0, 1.5, 2.0):
        sides = side * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        velocity = np.concatenate([sides, np.zeros((4, 1))], axis=-1)
        turn = _BALL.simulate(_BALL.state(), np.arange(5.0), velocity)["q"][-1]
        axes.plot(side**2, math.degrees(float(rotations.angle(turn))), "s", color=GREEN, ms=5, zorder=4)
    axes.plot([], [], "s", color=GREEN, ms=5, label="simulated, square")


def _draw_loop(axes: Axes) -> None:
    """A round of radius 0.8, and a mark on top of the ball along the way."""
    bare(axes)
    axes.set_title("one round, seen from above: the marked\ndirection e1 comes back turned")
    size, n = 0.8, 240
    a = 2.0 * math.pi * (np.arange(n) + 0.5) / n
    speed = 2.0 * n * size * math.sin(math.pi / n)
    velocity = speed * np.stack([-np.sin(a), np.cos(a), np.zeros(n)], axis=-1)
    y = _BALL.state(position=[size, 0.0])
    motion = _BALL.simulate(y, np.linspace(0.0, 1.0, n + 1), velocity)
    place = 3.0 * motion["position"]
    axes.plot(*place.T, color=MUTED, lw=1.3)
    for k in range(0, n + 1, n // 8):
        _draw_ball(axes, place[k], motion["R"][k], k == n)


def _draw_ball(axes: Axes, place: Array, R: Array, last: bool) -> None:
    t = np.linspace(0.0, 2.0 * math.pi, 73)
    move = np.array([1.35, 0.0]) if last else np.zeros(2)  # beside where it began
    size = 0.6
    rim = place + move + size * np.stack([np.cos(t), np.sin(t)], axis=-1)
    axes.fill(*rim.T, fc="#fdf3ea" if last else "#eef2f6", ec=RED if last else MUTED, lw=1.0, zorder=2)
    for k, color in enumerate((RED, GREEN, BLUE)):
        tip = R[:, k]
        for sign in (1.0, -1.0):
            if sign * tip[2] > -1e-9:
                end = place + move + sign * size * tip[:2]
                axes.plot(*end, "o", ms=5, mfc=color if sign > 0 else "white", mec=color, zorder=4)


HOLONOMY = Entry(
    name="holonomy",
    title="Holonomy of a ball: area against turn",
    caption="A ball that rolls round a loop comes back turned, for a small loop by A / r^2 about "
    "the vertical, whatever its shape. Left: dots are the ends of the body axes on the upper half "
    "(open: the negative ends); the ball after the round is drawn beside its start.",
    law="turn = 2 pi (sqrt(1 + rho^2) - 1), rho = radius of the circle / r;  -A / r^2 for small A",
    source="Hammersley 1983; Jurdjevic 1993, doi:10.1007/BF00375605",
    draw=draw,
    size=(7.2, 4.2),
)
