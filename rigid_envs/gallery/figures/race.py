"""Race of a sphere, a cylinder and a hoop down an incline."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.analytic import roller as theory
from rigid_envs.bodies import Body, hollow_sphere, hoop, solid_cylinder, solid_sphere
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.space import bare
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, INK, PURPLE, RED
from rigid_envs.systems import Roller

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["RACE", "RUNNERS", "inertia_ratio"]

_RADIUS, _SLOPE, _HEIGHT, _G = 0.1, math.radians(20.0), 1.0, 9.81
RUNNERS: tuple[tuple[str, Body, str], ...] = (
    ("solid sphere", solid_sphere(1.0, _RADIUS), BLUE),
    ("cylinder", solid_cylinder(1.0, _RADIUS, 0.1), GREEN),
    ("hollow sphere", hollow_sphere(1.0, _RADIUS), PURPLE),
    ("hoop", hoop(1.0, _RADIUS), RED),
)
"""Name, body of the radius 0.1 m about whose axis z it rolls, colour."""


def inertia_ratio(body: Body) -> float:
    """I3 / (m radius^2) of one of the runners."""
    return float(body.inertia[2, 2]) / (body.mass * _RADIUS**2)


def draw(figure: Figure) -> tuple[Number, ...]:
    """Simulate the descents until the last one is down, compare the times of arrival."""
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    length = _HEIGHT / math.sin(_SLOPE)
    exact = [_descent(body).time for _, body, _ in RUNNERS]
    bare(left)
    left.set_title(f"when the sphere arrives, after {exact[0]:.2f} s")
    end = 1.08 * length * np.array([math.cos(_SLOPE), -math.sin(_SLOPE)])
    left.plot([0.0, end[0]], [0.0, end[1]], color=INK, lw=1.2)
    errors = []
    for k, (name, body, color) in enumerate(RUNNERS):
        system = Roller(1.0, _RADIUS, inertia_ratio(body), _G, _SLOPE)
        s = system.simulate(system.state(), [0.0, *sorted(exact)])["arc_length"]
        errors.append(abs(float(s[1 + sorted(exact).index(exact[k])]) - length))
        _draw_runner(left, float(s[1]), k, color)
        t = np.linspace(0.0, exact[k], 60)
        path = system.simulate(system.state(), t)["arc_length"]
        right.plot(t, path, color=color, label=name)
        right.plot(exact[k], length, "o", color=BLACK, ms=5, zorder=4)
    right.plot([], [], "o", color=BLACK, ms=5, label="arrival, closed form")
    right.axhline(length, color=INK, lw=0.9)
    right.set_xlabel("time [s]"), right.set_title("way down the incline [m]")
    right.set_xlim(0.0, None), right.set_ylim(0.0, None)
    figure.legend(ncols=5, columnspacing=1.0)
    error = max(errors)
    return (Number("largest distance from the goal when due there", error, 0.0, 1e-12, "m"),)


def _descent(body: Body) -> theory.Descent:
    ratio = inertia_ratio(body)
    return theory.descend(_HEIGHT, slope=_SLOPE, beta=ratio, radius=_RADIUS, g=_G)


def _draw_runner(axes: Axes, s: float, k: int, color: str) -> None:
    """A runner on a lane of its own, with a spoke that has turned by s / radius."""
    along = np.array([math.cos(_SLOPE), -math.sin(_SLOPE)])
    up = np.array([math.sin(_SLOPE), math.cos(_SLOPE)])
    lane = 0.42 * (3 - k) * up
    foot = lane + s * along
    ends = np.array([lane, lane + _HEIGHT / math.sin(_SLOPE) * along])
    axes.plot(*ends.T, color="#d5dbe3", lw=1.0, zorder=1)
    axes.plot(*np.array([ends[1], ends[1] + 0.3 * up]).T, color=INK, lw=1.0, ls=":")
    size = 0.16  # drawn larger than it is
    t = np.linspace(0.0, 2.0 * math.pi, 121)
    centre = foot + size * up
    rim = centre + size * np.stack([np.cos(t), np.sin(t)], axis=-1)
    solid = k < 2
    axes.fill(*rim.T, fc=color if solid else "white", ec=color, lw=3.0, alpha=0.9, zorder=3)
    turn = -s / _RADIUS
    spoke = centre + size * np.array([[0.0, 0.0], [math.cos(turn), math.sin(turn)]])
    axes.plot(*spoke.T, color="white" if solid else color, lw=1.6, zorder=4)


RACE = Entry(
    name="race",
    title="Race down an incline: the smallest inertia ratio wins",
    caption="From rest down one metre on a slope of 20 degrees. Neither mass nor radius counts, "
    "only beta = I / (m r^2): 2/5 for the sphere, 1/2 for the cylinder, 2/3 for the hollow "
    "sphere, 1 for the hoop. Bodies are drawn larger than they are, each on a lane of its own.",
    law="a = g sin(slope) / (1 + beta)",
    source="Goldstein, section 2.4; Landau & Lifshitz, Mechanics, section 38",
    draw=draw,
    size=(7.2, 3.8),
)
