"""Rolling and slipping: the friction that rolling needs, and sliding that ends in rolling."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.analytic import roller as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.figures.race import RUNNERS, inertia_ratio
from rigid_envs.gallery.style import BLACK, BLUE, INK, MUTED, RED, SKY
from rigid_envs.systems import Roller

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["SLIPPING"]

_RADIUS, _MU, _G, _SPEED = 0.1, 0.3, 9.81, 4.0
_BALL = {"beta": 0.4, "radius": _RADIUS, "mu": _MU, "g": _G}


def draw(figure: Figure) -> tuple[Number, ...]:
    """Friction that the systems need against closed form; a ball that slides first."""
    grid = figure.subplot_mosaic([["path", "path"], ["friction", "speeds"]], height_ratios=(1, 1.9))
    error = _draw_friction(grid["friction"])
    end = theory.slip_to_roll([_SPEED, 0.0], np.zeros(3), **_BALL)
    t = np.linspace(0.0, 1.9 * end.time, 1201)
    place, velocity, omega = theory.slide(t, [_SPEED, 0.0], np.zeros(3), **_BALL)
    _draw_path(grid["path"], t, place, omega, end)
    axes = grid["speeds"]
    axes.plot(t, velocity[:, 0], color=BLUE, label="v of the centre")
    axes.plot(t, _RADIUS * omega[:, 1], color=SKY, ls="--", label="r omega")
    axes.axvline(end.time, color=MUTED, lw=0.9, ls=":")
    axes.set_title("a ball that starts without spin [m/s]"), axes.set_xlabel("time [s]")
    axes.set_xlim(0.0, t[-1]), axes.set_ylim(0.0, 1.05 * _SPEED)
    axes.legend(loc="lower right")
    axes.annotate(
        "rolls: v = r omega", (end.time, 3.45), (6, 0), textcoords="offset points",
        fontsize=8.5, color=MUTED,
    )  # fmt: skip
    figure.legend(*grid["friction"].get_legend_handles_labels(), ncols=5, columnspacing=1.0)
    # the friction has no moment about a line on the ground
    momentum = velocity[:, 0] + _BALL["beta"] * _RADIUS * omega[:, 1]
    change = float(np.ptp(momentum) / momentum[0])
    return (
        Number("largest error of the friction that rolling needs", error, 0.0, 1e-12),
        Number("change of the momentum about the ground, relative", change, 0.0, 1e-12),
    )


def _draw_friction(axes: Axes) -> float:
    """Needed coefficients of friction on slopes up to 60 degrees; largest error."""
    slopes = np.radians(np.linspace(1.0, 60.0, 60))
    errors = []
    for name, body, color in RUNNERS:
        beta = inertia_ratio(body)
        systems = [Roller(1.0, _RADIUS, beta, _G, float(slope)) for slope in slopes]
        needed = np.array([float(system.needed_friction(system.state())) for system in systems])
        exact = [
            theory.descend(1.0, slope=float(s), beta=beta, radius=_RADIUS, g=_G).least_friction
            for s in slopes
        ]
        axes.plot(np.degrees(slopes), needed, color=color, label=name)
        axes.plot(np.degrees(slopes[4::10]), exact[4::10], "o", ms=3.5, color=BLACK, zorder=4)
        errors.append(float(np.max(np.abs(needed - exact))))
    axes.plot([], [], "o", ms=3.5, color=BLACK, label="closed form")
    axes.axhline(_MU, color=INK, lw=0.9, ls=":")
    axes.text(2.0, _MU + 0.02, f"mu = {_MU}: slips above", fontsize=8.5, color=MUTED)
    axes.set_xlim(0, 60), axes.set_ylim(0, 0.9)
    axes.set_xlabel("slope [degrees]"), axes.set_title("friction that rolling needs")
    return max(errors)


def _draw_path(
    axes: Axes, t: np.ndarray, place: np.ndarray, omega: np.ndarray, end: theory.SlipToRoll
) -> None:
    """A point of the rim, which starts at the ground: no cusps until the ball rolls."""
    turn = np.concatenate([[0.0], np.cumsum(0.5 * (omega[1:, 1] + omega[:-1, 1]) * np.diff(t))])
    x = place[:, 0] - _RADIUS * np.sin(turn)
    z = _RADIUS - _RADIUS * np.cos(turn)
    slides = t <= end.time
    axes.set_aspect("equal")
    axes.plot(x[slides], z[slides], color=RED)
    axes.plot(x[~slides], z[~slides], color=BLUE)
    axes.axhline(0.0, color=INK, lw=1.0)
    a = np.linspace(0.0, 2.0 * math.pi, 121)
    for k in (0, int(np.argmin(slides)), len(t) - 1):
        axes.plot(
            place[k, 0] + _RADIUS * np.cos(a), _RADIUS + _RADIUS * np.sin(a), color=MUTED, lw=1.0
        )
    axes.text(place[0, 0], 0.23, "slides", color=RED, ha="center", fontsize=9)
    axes.text(end.position[0], 0.23, "begins to roll", color=BLUE, ha="center", fontsize=9)
    axes.axis("off")


SLIPPING = Entry(
    name="slipping",
    title="Rolling and slipping",
    caption="Top: a ball pushed off without spin slides, slows down and spins up until its "
    "contact is at rest; from then on a point of its rim draws a cycloid. It keeps 5/7 of its "
    "speed whatever the friction. (The systems of the library roll, so the sliding is drawn by "
    "its closed form.) Left: the friction that rolling down a slope needs.",
    law="v = v0 / (1 + beta) when it rolls;  mu >= tan(slope) beta / (1 + beta)",
    source="Sommerfeld, Mechanics, section 27; Goldstein, sections 1.3 and 2.4",
    draw=draw,
    size=(7.2, 4.6),
)
