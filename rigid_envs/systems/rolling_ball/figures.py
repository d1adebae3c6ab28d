"""Figures of the gallery: rolling balls."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.systems.rolling_ball import closed_forms as theory
from rigid_envs.systems.rolling_ball.controllers import three_rolls
from rigid_envs.systems.rolling_ball.shortest_path import ShortestPath, shortest_path
from rigid_envs.systems.rolling_ball.system import RollingBall
from rigid_envs.systems.upright_coin.controllers import TwoRolls
from rigid_envs.systems.upright_coin.system import UprightCoin
from rigid_envs.watch.figures import (
    BLACK,
    BLUE,
    GREEN,
    MUTED,
    ORANGE,
    PURPLE,
    RED,
    Match,
    bare,
    exhibit,
    page_arrow,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Holonomy of a rolling ball: it comes back turned, by the area that it ran round.

_BALL = RollingBall(radius=1.0)


@exhibit(
    title="Holonomy of a ball: area against turn",
    caption="A ball that rolls round a loop comes back turned, for a small loop by A / r^2 about "
    "the vertical, whatever its shape. Left: a ball with a mark from e3 (dot) to e1 rolls round a "
    "circle of radius r / 2, drawn larger; the red mark comes back turned.",
    law="turn = 2 pi (sqrt(1 + rho^2) - 1), rho = radius of the circle / r;  -A / r^2 for small A",
    source="Hammersley 1983; Jurdjevic 1993, doi:10.1007/BF00375605",
    size=(7.2, 4.2),
)
def holonomy(
    figure: Figure, *, largest: float = math.sqrt(3.0), n_circles: int = 18
) -> tuple[Match, ...]:
    """Roll round circles of many sizes; compare the turn that is left with the closed form.

    Args:
        figure: empty.
        largest: radius of the largest circle, over that of the ball; the smallest has 1/10.
        n_circles: number of circles.
    """
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    circles = np.linspace(0.1, largest, n_circles)
    turns = _roll_round(circles, 4000)["q"][-1]
    error = float(np.max(rotations.distance(turns, theory.circle_holonomy(circles, 1.0))))
    angles = rotations.angle(turns)
    _draw_turns(right, circles, angles)
    _squares(right)
    _draw_loop(left)
    figure.legend(ncols=4, columnspacing=1.2)
    small = float(angles[0]) / (math.pi * float(circles[0]) ** 2)
    return (
        Match("largest error of the turn against the closed form", error, 0.0, 1e-5, "rad"),
        Match("turn over A / r^2, circle of radius r / 10", small, 1.0, 3e-3),
    )


def _roll_round(sizes: Array, n: int) -> Trajectory:
    """Roll counter-clockwise round polygons of n sides in circles of these radii, all at once."""
    a = 2.0 * math.pi * (np.arange(n) + 0.5) / n
    sides = 2.0 * n * math.sin(math.pi / n) * np.stack([-np.sin(a), np.cos(a), 0.0 * a], axis=-1)
    y = _BALL.state(position=sizes[:, None] * [1.0, 0.0])
    return _BALL.simulate(y, np.linspace(0.0, 1.0, n + 1), sides[:, None] * sizes[:, None])


def _draw_turns(axes: Axes, circles: Array, angles: Array) -> None:
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
    axes.plot(math.pi * circles**2, np.degrees(grown[2:]), "o", label="simulated, circle", **dots)
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


# Parking by brackets: small loops of the controls move where no control points.

_COIN = UprightCoin(radius=1.0)
_LEGS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))  # f, g, -f, -g


@exhibit(
    title="Parking by brackets",
    caption="Two controls f and g, one after the other and then both back, leave a motion along "
    "their bracket [f, g]: a ball turns about the vertical, a coin moves sideways, by e^2 for "
    "loops of the size e. Right: two straight rolls, and turns before, between and after, "
    "park a coin in place, heading and phase (strokes: the coin from above).",
    law="-g . -f . g . f = e^2 [f, g] + O(e^3);  growth vectors (2, 3, 5) and (2, 3, 4)",
    source="Murray, Li & Sastry, chapter 7; Hammersley 1983",
    size=(7.2, 4.3),
)
def brackets(
    figure: Figure, *, smallest: float = 0.02, largest: float = 1.0, beside: float = 1.5
) -> tuple[Match, ...]:
    """Loops of both bodies against their brackets; a coin that is parked.

    Args:
        figure: empty.
        smallest: size of the smallest loop.
        largest: of the largest one.
        beside: place of the coin, sideways from its goal [r].
    """
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.1))
    loops = np.geomspace(smallest, largest, 12)
    ball = [_ball_loop(size) for size in loops]
    coin = [_coin_loop(size) for size in loops]
    spin = _first_bracket(*theory.ball_fields(1.0), np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    slide = _first_bracket(*theory.coin_fields(1.0), np.zeros(4))
    left.loglog(loops, 2.0 * spin * loops**2, color=RED, label="bracket: e^2 |[f, g]|")
    left.loglog(loops, ball, "o", ms=4.5, color=BLACK, label="ball: turn [rad]")
    left.loglog(loops, coin, "s", ms=8, mfc="none", color=BLUE, label="coin: shift sideways [r]")
    left.set_title("what a loop f, g, -f, -g leaves"), left.set_xlabel("size e of the loop")
    left.set_xticks([0.02, 0.1, 1.0], ["0.02", "0.1", "1"])
    left.minorticks_off()
    missed = _park(right, beside)
    figure.legend(ncols=3, columnspacing=1.0)
    return (
        Match("ball: turn over e^2, smallest loop", ball[0] / loops[0] ** 2, 2.0 * spin, 1e-3),
        Match("coin: shift over e^2, smallest loop", coin[0] / loops[0] ** 2, slide, 1e-3),
        Match("coin parked by two rolls, error of its pose", missed, 0.0, 1e-8),
    )


def _first_bracket(first: theory.Field, second: theory.Field, state: Array) -> float:
    return float(theory.bracket_norms((first, second), state, 2)[1][0])


def _ball_loop(size: float) -> float:
    """Turn [rad] of a ball that rolls round a square."""
    inputs = size * np.array([(*sides, 0.0) for sides in _LEGS])
    end = _BALL.simulate(_BALL.state(), np.arange(5.0), inputs)["q"][-1]
    return float(rotations.angle(end))


def _coin_loop(size: float) -> float:
    """Shift sideways of a coin that rolls, steers, rolls back, steers back."""
    y = _COIN.state()
    for roll, steer in _LEGS:
        y[_COIN.components["roll_rate"]] = size * roll
        y[_COIN.components["steer_rate"]] = size * steer
        y = _COIN.simulate(y, [0.0, 1.0]).y[-1]
    return abs(float(_COIN.contact(y)[1]))


def _park(axes: Axes, beside: float) -> float:
    """Follow a plan of two straight rolls with the simulated coin; how far it ends from home."""
    y = _COIN.state(contact=[0.0, beside])
    plan = TwoRolls(_COIN, 0.3, 0.5)(y)
    places, headings = [_COIN.contact(y)], [float(_COIN.heading(y))]
    for k, leg in enumerate(plan.legs):
        y[_COIN.components["steer_rate"]] = leg if k % 2 == 0 else 0.0
        y[_COIN.components["roll_rate"]] = leg if k % 2 == 1 else 0.0
        motion = _COIN.simulate(y, np.linspace(0.0, 1.0, 9))
        y = motion.y[-1]
        if k % 2 == 1:
            places += list(motion["contact"][1:])
            headings += motion["heading"][1:].tolist()
    home = _COIN.attitude(0.0, 0.0)
    headings[-1] = float(_COIN.heading(y))  # after the last turn
    _draw_parking(axes, np.array(places), np.array(headings))
    axes.set_title(
        f"a coin is parked sideways: turn, roll,\nturn, roll back, turn: {plan.length:.2f} r"
    )
    return max(float(np.max(np.abs(places[-1]))), float(rotations.distance(y[:4], home)))


def _draw_parking(axes: Axes, places: Array, heading: Array) -> None:
    axes.plot(*places.T, color=GREEN)
    for k in (4, 12):  # in the middle of either roll
        page_arrow(axes, places[k], places[k + 1], GREEN)
    along = 0.2 * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    for k, text, lift in ((0, "start", -15), (-1, "goal", 8)):
        ends = np.stack([places[k] - along[k], places[k] + along[k]])
        axes.plot(*ends.T, color=BLACK, lw=3.2, zorder=4)
        axes.annotate(text, (places[k, 0], places[k, 1]), (12, lift), textcoords="offset points")
    axes.set_aspect("equal", adjustable="datalim")


# Shortest paths of a rolling ball from one pose to another.


@exhibit(
    title="Shortest paths of a rolling ball",
    caption="The centre of a ball that rolls from one pose to another on the shortest path runs "
    "along one of Euler's elasticae. Left: how to turn it about the vertical without going away; "
    "right: to another place as well.",
    law="heading a(s): a'' = pull_y cos a - pull_x sin a",
    source="Arthurs & Walsh 1986, doi:10.1017/S0305004100064501; Jurdjevic 1993",
    size=(7.2, 4.4),
)
def shortest(
    figure: Figure,
    *,
    turns: tuple[float, float, float, float] = (45.0, 90.0, 135.0, 180.0),
    place: tuple[float, float] = (4.0, 1.0),
    turn: float = 150.0,
) -> tuple[Match, ...]:
    """Find paths, roll them with the simulated ball, and see where it ends.

    Args:
        figure: empty.
        turns: about the vertical, in place [degrees].
        place: of the other goal [r].
        turn: of the other goal [degrees].
    """
    left, right = figure.subplots(1, 2)
    missed, steering = [], []
    for angle, color in zip(turns, (BLUE, GREEN, ORANGE, RED), strict=True):
        goal = _pose(math.radians(angle), (0.0, 0.0))
        path = shortest_path(_pose(0.0, (0.0, 0.0)), goal)
        missed.append(_roll(left, path, color, f"{angle:.0f} degrees"))
        steering.append(_hamiltonian(path))
    left.set_title("to turn about the vertical, in place [r]")
    start, goal = _pose(0.0, (0.0, 0.0)), _pose(math.radians(turn), place)
    path = shortest_path(start, goal)
    missed.append(_roll(right, path, PURPLE, ""))
    steering.append(_hamiltonian(path))
    corners = np.vstack([[0.0, 0.0], np.cumsum(three_rolls(start, goal), axis=0)])
    longer = float(np.sum(np.hypot(*np.diff(corners, axis=0).T)))
    right.plot(*corners.T, color=MUTED, ls="--", lw=1.2)
    right.plot([0.0, place[0]], [0.0, place[1]], "o", color=BLACK, ms=5, zorder=5)
    right.set_title(f"to ({place[0]:g}, {place[1]:g}) and a turn of {turn:g} degrees: "
                    f"{path.length:.2f} r\n"
                    f"dashed: three straight rolls, {longer:.2f} r")  # fmt: skip
    for axes in (left, right):
        axes.set_aspect("equal", adjustable="datalim")
    left.plot(0.0, 0.0, "o", color=BLACK, ms=5, zorder=5, label="start, goal")
    figure.legend(ncols=3, columnspacing=1.2)
    return (
        Match("largest error of the simulated end, distance and angle", max(missed), 0.0, 1e-9),
        Match("departure from the maximum principle along the path", max(steering), 0.0, 1e-8),
    )


def _pose(turn: float, place: tuple[float, float]) -> Array:
    q = rotations.exp([0.0, 0.0, turn])
    return np.concatenate([q, place])


def _roll(axes: Axes, path: ShortestPath, color: str, name: str) -> float:
    """Draw the path with an arrow; simulate its rolls and see by how much they miss the goal."""
    places = path.states(240)[:, 4:6]
    label = f"{name}: {path.length:.2f} r" if name else None
    axes.plot(*places.T, color=color, label=label)
    page_arrow(axes, places[118], places[126], color)
    rolls = path.rolls(60)
    inputs = np.concatenate([rolls, np.zeros((60, 1))], axis=-1)
    end = _BALL.simulate(path.start, np.arange(61.0), inputs).y[-1]
    place = math.dist(end[4:], path.goal[4:])
    return max(place, float(rotations.distance(end[:4], path.goal[:4])))


def _hamiltonian(path: ShortestPath) -> float:
    """Departure of the switching vector from the direction of travel."""
    a = path.headings(240)
    return float(np.max(np.abs(path.steering(240) - np.stack([np.cos(a), np.sin(a)], axis=-1))))
