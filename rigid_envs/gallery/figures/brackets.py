"""Parking by brackets: small loops of the controls move where no control points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.analytic import brackets as theory
from rigid_envs.control import TwoRolls
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.space import page_arrow
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, RED
from rigid_envs.systems import RollingBall, UprightCoin

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["BRACKETS"]

Array = npt.NDArray[np.float64]
_COIN = UprightCoin(radius=1.0)
_BALL = RollingBall(radius=1.0)
_SIZES = np.geomspace(0.02, 1.0, 12)
_LOOP = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))  # f, g, -f, -g


def draw(figure: Figure) -> tuple[Number, ...]:
    """Loops of both bodies against their brackets; a coin that is parked."""
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.1))
    ball = [_ball_loop(size) for size in _SIZES]
    coin = [_coin_loop(size) for size in _SIZES]
    spin = _first_bracket(*theory.ball_fields(1.0), np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    slide = _first_bracket(*theory.coin_fields(1.0), np.zeros(4))
    left.loglog(_SIZES, 2.0 * spin * _SIZES**2, color=RED, label="bracket: e^2 |[f, g]|")
    left.loglog(_SIZES, ball, "o", ms=4.5, color=BLACK, label="ball: turn [rad]")
    left.loglog(_SIZES, coin, "s", ms=8, mfc="none", color=BLUE, label="coin: shift sideways [r]")
    left.set_title("what a loop f, g, -f, -g leaves"), left.set_xlabel("size e of the loop")
    left.set_xticks([0.02, 0.1, 1.0], ["0.02", "0.1", "1"])
    left.minorticks_off()
    missed = _park(right)
    figure.legend(ncols=3, columnspacing=1.0)
    return (
        Number("ball: turn over e^2, smallest loop", ball[0] / _SIZES[0] ** 2, 2.0 * spin, 1e-3),
        Number("coin: shift over e^2, smallest loop", coin[0] / _SIZES[0] ** 2, slide, 1e-3),
        Number("coin parked by two rolls, error of its pose", missed, 0.0, 1e-8),
    )


def _first_bracket(first: theory.Field, second: theory.Field, state: Array) -> float:
    return float(theory.bracket_norms((first, second), state, 2)[1][0])


def _ball_loop(size: float) -> float:
    """Turn [rad] of a ball that rolls round a square."""
    inputs = size * np.array([(*sides, 0.0) for sides in _LOOP])
    end = _BALL.simulate(_BALL.state(), np.arange(5.0), inputs)["q"][-1]
    return float(rotations.angle(end))


def _coin_loop(size: float) -> float:
    """Shift sideways of a coin that rolls, steers, rolls back, steers back."""
    y = _COIN.state(q=_COIN.attitude(0.0, 0.0))
    for roll, steer in _LOOP:
        y[_COIN.components["roll_rate"]] = size * roll
        y[_COIN.components["steer_rate"]] = size * steer
        y = _COIN.simulate(y, [0.0, 1.0]).y[-1]
    return abs(float(_COIN.contact(y)[1]))


def _park(axes: Axes) -> float:
    """Follow a plan of two straight rolls with the simulated coin; how far it ends from home."""
    y = _COIN.state(q=_COIN.attitude(0.0, 0.0), contact=[0.0, 1.5])
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


BRACKETS = Entry(
    name="brackets",
    title="Parking by brackets",
    caption="Two controls f and g, one after the other and then both back, leave a motion along "
    "their bracket [f, g]: a ball turns about the vertical, a coin moves sideways, by e^2 for "
    "loops of the size e. Right: two straight rolls, and turns before, between and after, "
    "park a coin in place, heading and phase (strokes: the coin from above).",
    law="-g . -f . g . f = e^2 [f, g] + O(e^3);  growth vectors (2, 3, 5) and (2, 3, 4)",
    source="Murray, Li & Sastry, chapter 7; Hammersley 1983",
    draw=draw,
    size=(7.2, 4.3),
)
