"""Shortest paths of a rolling ball from one pose to another."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.control import ShortestPath, shortest_path, three_rolls
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.space import page_arrow
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, MUTED, ORANGE, PURPLE, RED
from rigid_envs.systems import RollingBall

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["SHORTEST"]

Array = npt.NDArray[np.float64]
_BALL = RollingBall(radius=1.0)
_TURNS = ((45.0, BLUE), (90.0, GREEN), (135.0, ORANGE), (180.0, RED))


def draw(figure: Figure) -> tuple[Number, ...]:
    """Find paths, roll them with the simulated ball, and see where it ends."""
    left, right = figure.subplots(1, 2)
    missed, steering = [], []
    for angle, color in _TURNS:
        goal = _pose(math.radians(angle), (0.0, 0.0))
        path = shortest_path(_pose(0.0, (0.0, 0.0)), goal)
        missed.append(_roll(left, path, color, f"{angle:.0f} degrees"))
        steering.append(_hamiltonian(path))
    left.set_title("to turn about the vertical, in place [r]")
    start, goal = _pose(0.0, (0.0, 0.0)), _pose(math.radians(150.0), (4.0, 1.0))
    path = shortest_path(start, goal)
    missed.append(_roll(right, path, PURPLE, ""))
    steering.append(_hamiltonian(path))
    corners = np.vstack([[0.0, 0.0], np.cumsum(three_rolls(start, goal), axis=0)])
    longer = float(np.sum(np.hypot(*np.diff(corners, axis=0).T)))
    right.plot(*corners.T, color=MUTED, ls="--", lw=1.2)
    right.plot([0.0, 4.0], [0.0, 1.0], "o", color=BLACK, ms=5, zorder=5)
    right.set_title(f"to (4, 1) and a turn of 150 degrees: {path.length:.2f} r\n"
                    f"dashed: three straight rolls, {longer:.2f} r")  # fmt: skip
    for axes in (left, right):
        axes.set_aspect("equal", adjustable="datalim")
    left.plot(0.0, 0.0, "o", color=BLACK, ms=5, zorder=5, label="start, goal")
    figure.legend(ncols=3, columnspacing=1.2)
    return (
        Number("largest error of the simulated end, distance and angle", max(missed), 0.0, 1e-9),
        Number("departure from the maximum principle along the path", max(steering), 0.0, 1e-8),
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


SHORTEST = Entry(
    name="shortest",
    title="Shortest paths of a rolling ball",
    caption="The centre of a ball that rolls from one pose to another on the shortest path runs "
    "along one of Euler's elasticae. Left: how to turn it about the vertical without going away; "
    "right: to another place as well.",
    law="heading a(s): a'' = pull_y cos a - pull_x sin a",
    source="Arthurs & Walsh 1986, doi:10.1017/S0305004100064501; Jurdjevic 1993",
    draw=draw,
    size=(7.2, 4.4),
)
