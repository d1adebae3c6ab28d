"""Figures of the gallery: rollers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics.bodies.body import Body
from rigid_envs.mechanics.bodies.solids import hollow_sphere, hoop, solid_cylinder, solid_sphere
from rigid_envs.systems.roller import closed_forms as theory
from rigid_envs.systems.roller.controllers import Pump
from rigid_envs.systems.roller.system import Roller
from rigid_envs.watch import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Race of a sphere, a cylinder and a hoop down an incline.

_RADIUS, _G = 0.1, 9.81
RUNNERS: tuple[tuple[str, Body, str], ...] = (
    ("solid sphere", solid_sphere(1.0, _RADIUS), figures.BLUE),
    ("cylinder", solid_cylinder(1.0, _RADIUS, 0.1), figures.GREEN),
    ("hollow sphere", hollow_sphere(1.0, _RADIUS), figures.PURPLE),
    ("hoop", hoop(1.0, _RADIUS), figures.RED),
)
"""Name, body of the radius 0.1 m about whose axis z it rolls, colour."""


def inertia_ratio(body: Body) -> float:
    """I3 / (m radius^2) of one of the runners."""
    return float(body.inertia[2, 2]) / (body.mass * _RADIUS**2)


@figures.exhibit(
    title="Race down an incline: the smallest inertia ratio wins",
    caption="From rest down one metre on a slope of 20 degrees. Neither mass nor radius counts, "
    "only beta = I / (m r^2): 2/5 for the sphere, 1/2 for the cylinder, 2/3 for the hollow "
    "sphere, 1 for the hoop. Bodies are drawn larger than they are, each on a lane of its own.",
    law="a = g sin(slope) / (1 + beta)",
    source="Goldstein, section 2.4; Landau & Lifshitz, Mechanics, section 38",
    size=(7.2, 3.8),
)
def race(
    figure: Figure, *, slope: float = math.radians(20.0), height: float = 1.0
) -> tuple[figures.Match, ...]:
    """Simulate the descents until the last one is down, compare the times of arrival.

    Args:
        figure: empty.
        slope: of the incline [rad].
        height: by which they roll down [m].
    """
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    length = height / math.sin(slope)
    shape = {"slope": slope, "radius": _RADIUS, "g": _G}
    ratios = [inertia_ratio(body) for _, body, _ in RUNNERS]
    exact = [theory.descend(height, beta=ratio, **shape).time for ratio in ratios]
    figures.bare(left)
    left.set_title(f"when the sphere arrives, after {exact[0]:.2f} s")
    end = 1.08 * length * np.array([math.cos(slope), -math.sin(slope)])
    left.plot([0.0, end[0]], [0.0, end[1]], color=figures.INK, lw=1.2)
    errors = []
    for k, (name, _, color) in enumerate(RUNNERS):
        system = Roller(beta=ratios[k], **shape)
        s = system.simulate(system.state(), [0.0, *sorted(exact)])["arc_length"]
        errors.append(abs(float(s[1 + sorted(exact).index(exact[k])]) - length))
        _draw_runner(left, slope, length, float(s[1]), k, color)
        t = np.linspace(0.0, exact[k], 60)
        path = system.simulate(system.state(), t)["arc_length"]
        right.plot(t, path, color=color, label=name)
        right.plot(exact[k], length, "o", color=figures.BLACK, ms=5, zorder=4)
    right.plot([], [], "o", color=figures.BLACK, ms=5, label="arrival, closed form")
    right.axhline(length, color=figures.INK, lw=0.9)
    right.set_xlabel("time [s]"), right.set_title("way down the incline [m]")
    right.set_xlim(0.0, None), right.set_ylim(0.0, None)
    figure.legend(ncols=5, columnspacing=1.0)
    error = max(errors)
    return (figures.Match("largest distance from the goal when due there", error, 0.0, 1e-12, "m"),)


def _draw_runner(axes: Axes, slope: float, length: float, s: float, k: int, color: str) -> None:
    """A runner on a lane of its own, with a spoke that has turned by s / radius."""
    along = np.array([math.cos(slope), -math.sin(slope)])
    up = np.array([math.sin(slope), math.cos(slope)])
    lane = 0.42 * (3 - k) * up
    foot = lane + s * along
    ends = np.array([lane, lane + length * along])
    axes.plot(*ends.T, color="#d5dbe3", lw=1.0, zorder=1)
    axes.plot(*np.array([ends[1], ends[1] + 0.3 * up]).T, color=figures.INK, lw=1.0, ls=":")
    size = 0.16  # drawn larger than it is
    t = np.linspace(0.0, 2.0 * math.pi, 121)
    centre = foot + size * up
    rim = centre + size * np.stack([np.cos(t), np.sin(t)], axis=-1)
    solid = k < 2
    axes.fill(*rim.T, fc=color if solid else "white", ec=color, lw=3.0, alpha=0.9, zorder=3)
    turn = -s / _RADIUS
    spoke = centre + size * np.array([[0.0, 0.0], [math.cos(turn), math.sin(turn)]])
    axes.plot(*spoke.T, color="white" if solid else color, lw=1.6, zorder=4)


# Rolling and slipping: the friction that rolling needs, and sliding that ends in rolling.


@figures.exhibit(
    title="Rolling and slipping",
    caption="Top: a ball pushed off without spin slides, slows down and spins up until its "
    "contact is at rest; from then on a point of its rim draws a cycloid. It keeps 5/7 of its "
    "speed whatever the friction. (The systems of the library roll, so the sliding is drawn by "
    "its closed form.) Left: the friction that rolling down a slope needs.",
    law="v = v0 / (1 + beta) when it rolls;  mu >= tan(slope) beta / (1 + beta)",
    source="Sommerfeld, Mechanics, section 27; Goldstein, sections 1.3 and 2.4",
    size=(7.2, 4.6),
)
def slipping(
    figure: Figure, *, mu: float = 0.3, speed: float = 4.0, beta: float = 0.4
) -> tuple[figures.Match, ...]:
    """Friction that the systems need against closed form; a ball that slides first.

    Args:
        figure: empty.
        mu: coefficient of friction.
        speed: of the ball at first [m/s].
        beta: inertia ratio of the ball.
    """
    ball = {"beta": beta, "radius": _RADIUS, "mu": mu, "g": _G}
    grid = figure.subplot_mosaic([["path", "path"], ["friction", "speeds"]], height_ratios=(1, 1.9))
    error = _draw_friction(grid["friction"], mu)
    end = theory.slip_to_roll([speed, 0.0], np.zeros(3), **ball)
    t = np.linspace(0.0, 1.9 * end.time, 1201)
    place, velocity, omega = theory.slide(t, [speed, 0.0], np.zeros(3), **ball)
    _draw_path(grid["path"], t, place, omega, end)
    axes = grid["speeds"]
    axes.plot(t, velocity[:, 0], color=figures.BLUE, label="v of the centre")
    axes.plot(t, _RADIUS * omega[:, 1], color=figures.SKY, ls="--", label="r omega")
    axes.axvline(end.time, color=figures.MUTED, lw=0.9, ls=":")
    axes.set_title("a ball that starts without spin [m/s]"), axes.set_xlabel("time [s]")
    axes.set_xlim(0.0, t[-1]), axes.set_ylim(0.0, 1.05 * speed)
    axes.legend(loc="lower right")
    axes.annotate(
        "rolls: v = r omega", (end.time, 0.8625 * speed), (6, 0), textcoords="offset points",
        fontsize=8.5, color=figures.MUTED,
    )  # fmt: skip
    figure.legend(*grid["friction"].get_legend_handles_labels(), ncols=5, columnspacing=1.0)
    # the friction has no moment about a line on the ground
    momentum = velocity[:, 0] + beta * _RADIUS * omega[:, 1]
    change = float(np.ptp(momentum) / momentum[0])
    return (
        figures.Match("largest error of the friction that rolling needs", error, 0.0, 1e-12),
        figures.Match("change of the momentum about the ground, relative", change, 0.0, 1e-12),
    )


def _draw_friction(axes: Axes, mu: float) -> float:
    """Needed coefficients of friction on slopes up to 60 degrees; largest error."""
    slopes = np.radians(np.linspace(1.0, 60.0, 60))
    errors = []
    for name, body, color in RUNNERS:
        beta = inertia_ratio(body)
        systems = [Roller(1.0, _RADIUS, beta, _G, slope) for slope in slopes.tolist()]
        needed = np.array([float(system.needed_friction(system.state())) for system in systems])
        exact = [
            theory.descend(1.0, slope=slope, beta=beta, radius=_RADIUS, g=_G).least_friction
            for slope in slopes.tolist()
        ]
        axes.plot(np.degrees(slopes), needed, color=color, label=name)
        axes.plot(
            np.degrees(slopes[4::10]), exact[4::10], "o", ms=3.5, color=figures.BLACK, zorder=4
        )
        errors.append(float(np.max(np.abs(needed - exact))))
    axes.plot([], [], "o", ms=3.5, color=figures.BLACK, label="closed form")
    axes.axhline(mu, color=figures.INK, lw=0.9, ls=":")
    axes.text(2.0, mu + 0.02, f"mu = {mu}: slips above", fontsize=8.5, color=figures.MUTED)
    axes.set_xlim(0, 60), axes.set_ylim(0, 0.9)
    axes.set_xlabel("slope [degrees]"), axes.set_title("friction that rolling needs")
    return max(errors)


def _draw_path(axes: Axes, t: Array, place: Array, omega: Array, end: theory.SlipToRoll) -> None:
    """A point of the rim, which starts at the ground: no cusps until the ball rolls."""
    turn = np.concatenate([[0.0], np.cumsum(0.5 * (omega[1:, 1] + omega[:-1, 1]) * np.diff(t))])
    x = place[:, 0] - _RADIUS * np.sin(turn)
    z = _RADIUS - _RADIUS * np.cos(turn)
    slides = t <= end.time
    axes.set_aspect("equal")
    axes.plot(x[slides], z[slides], color=figures.RED)
    axes.plot(x[~slides], z[~slides], color=figures.BLUE)
    axes.axhline(0.0, color=figures.INK, lw=1.0)
    a = np.linspace(0.0, 2.0 * math.pi, 121)
    for k in (0, int(np.argmin(slides)), len(t) - 1):
        rim = place[k, 0] + _RADIUS * np.cos(a), _RADIUS + _RADIUS * np.sin(a)
        axes.plot(*rim, color=figures.MUTED, lw=1.0)
    axes.text(place[0, 0], 0.23, "slides", color=figures.RED, ha="center", fontsize=9)
    axes.text(end.position[0], 0.23, "begins to roll", color=figures.BLUE, ha="center", fontsize=9)
    axes.axis("off")


# Pumping a wheel out of a valley by its moment of inertia.

_VALLEY = Roller(m=1.0, radius=0.1, beta=0.4, curvature=0.5)
_DT = 0.002  # s


@figures.exhibit(
    title="Pumping a wheel out of a valley",
    caption="No force drives the wheel. It moves masses outwards at the turning points, where "
    "that costs nothing, and inwards at the bottom, where that costs work. Each pass of the "
    "bottom multiplies the height by the same gain, and no other law climbs out in fewer passes.",
    law="h' / h = (1 + beta + beta_change) / (1 + beta)",
    source="Tea & Falk 1968, Pumping on a swing, American Journal of Physics 36:1165",
    size=(7.2, 3.9),
)
def pump(
    figure: Figure,
    *,
    beta_change: float = 0.6,
    start: float = -math.radians(20.0),
    rim: float = math.radians(75.0),
) -> tuple[figures.Match, ...]:
    """Pump until the rim is passed; compare the heights of the turning points with the law.

    Args:
        figure: empty.
        beta_change: what the masses add to the inertia ratio 0.4.
        start: angle from the bottom at first [rad].
        rim: angle of the rim from the bottom [rad].
    """
    law = Pump(_VALLEY, beta_change=beta_change, dt=_DT)
    y0 = _VALLEY.state(arc_length=start / _VALLEY.curvature)
    t, s, change, heights = _run(law, y0, rim)
    left, right = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    _draw_swings(left, t, s, change, rim)
    n = np.arange(len(heights))
    right.plot(
        n, heights, "o", color=figures.BLACK, ms=5, label="simulated turning points", zorder=4
    )
    right.plot(n, heights[0] * law.gain**n, color=figures.BLUE, label="law: h gain$^n$")
    high = 2.0 * math.sin(0.5 * rim) ** 2 / _VALLEY.curvature
    right.axhline(high, color=figures.MUTED, ls=":", lw=1.0)
    right.text(0.0, 1.02 * high, "rim", color=figures.MUTED, fontsize=8.5, va="bottom")
    right.set_yscale("log"), right.set_yticks([0.1, 0.2, 0.5, 1.0], ["0.1", "0.2", "0.5", "1"])
    right.minorticks_off()
    right.set_ylim(0.09, 2.3), right.set_xticks(n)
    right.set_xlabel("passes of the bottom"), right.set_title("height of the turning point [m]")
    figure.legend(ncols=5, columnspacing=1.0)
    gains = np.array(heights[1:]) / heights[:-1]
    worst = float(gains[np.argmax(np.abs(gains - law.gain))])
    passes = int(law.least_passes(y0, rim))
    return (
        figures.Match("gain of height per pass, worst", worst, law.gain, 2e-5),
        figures.Match("passes to the rim", float(_passes(s)), float(passes), 0.0),
    )


def _run(law: Pump, y: Array, rim: float) -> tuple[Array, Array, Array, list[float]]:
    """Times, places, additions to the ratio; heights of the turning points, one beyond the rim."""
    change = 0.0
    places, changes, heights = [float(y[0])], [change], [float(law.height(y, 0.0))]
    while abs(_VALLEY.curvature * y[0]) < rim and len(places) < 20000:
        new = 0.5 * law.beta_change * (1.0 + float(law(y, change)[0]))
        v = y[1] * (1.4 + change) / (1.4 + new)  # a sudden change keeps the momentum
        y, change = _VALLEY.advance([y[0], v], [0.0, new], _DT), new
        if y[1] * v < 0.0:
            heights.append(float(law.height(y, change)))
        places.append(float(y[0]))
        changes.append(change)
    heights.append(float(law.height(y, change)))  # to which it would rise beyond the rim
    t = np.linspace(0.0, _DT * (len(places) - 1), len(places))
    return t, np.array(places), np.array(changes), heights


def _passes(s: Array) -> int:
    return int(np.sum(s[1:] * s[:-1] < 0.0))


def _draw_swings(axes: Axes, t: Array, s: Array, change: Array, rim: float) -> None:
    angle = np.degrees(_VALLEY.curvature * s)
    large = change > 0.0
    axes.plot(t, np.where(large, angle, np.nan), color=figures.RED, label="masses out")
    axes.plot(t, np.where(large, np.nan, angle), color=figures.GREEN, label="masses in")
    for side in (1.0, -1.0):
        axes.axhline(side * math.degrees(rim), color=figures.MUTED, ls=":", lw=1.0)
    axes.text(0.1, math.degrees(rim) + 2.0, "rim", color=figures.MUTED, fontsize=8.5)
    axes.set_xlim(0.0, t[-1]), axes.set_ylim(-88.0, 88.0)
    axes.set_xlabel("time [s]"), axes.set_title("angle from the bottom of the valley [degrees]")
