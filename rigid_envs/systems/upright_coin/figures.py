"""Paths of an upright coin: circles, a spiral of Cornu, and a drift across a slope."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.systems.upright_coin import closed_forms as theory
from rigid_envs.systems.upright_coin.system import UprightCoin
from rigid_envs.watch.figures import BLACK, BLUE, GREEN, MUTED, RED, Match, exhibit, page_arrow

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COIN = UprightCoin(m=1.0, radius=0.5, I1=0.0625, I3=0.125)
_SHAPE = {"m": 1.0, "radius": 0.5, "i_perp": 0.0625, "i3": 0.125}


@exhibit(
    title="The path of an upright coin",
    caption="A coin that is held upright goes where it points. At constant rates it runs round "
    "a circle; steered by a constant torque it draws a clothoid (spiral of Cornu); let go on a "
    "slope while it turns steadily it never runs away downhill but drifts across.",
    law="X' = -r psi' cos(phi),  Y' = -r psi' sin(phi);  drift = g sin(slope) / (2 w (1 + beta))",
    source="Bloch, Nonholonomic Mechanics and Control, sections 1.4 and 1.6",
    size=(7.2, 5.6),
)
def coin(
    figure: Figure, *, torque: float = 0.02, slope: float = math.radians(15.0), speed: float = 1.1
) -> tuple[Match, ...]:
    """Simulate three motions, compare the paths of the contact with their closed forms.

    Args:
        figure: empty.
        torque: that steers along the spiral [N m].
        slope: that it drifts across [rad].
        speed: there, at first [m/s].
    """
    grid = figure.subplot_mosaic([["circles", "spiral"], ["slope", "slope"]])
    left = grid["circles"]
    errors = [_circles(left), _spiral(grid["spiral"], torque), _slope(grid["slope"], slope, speed)]
    left.plot([], [], "o", ms=3.5, color=BLACK, label="closed form")
    left.plot([], [], color=MUTED, lw=3.4, label="coin, seen from above")
    figure.legend(ncols=2)
    return (Match("largest error of the paths", max(errors), 0.0, 1e-9, "m"),)


def _plot(axes: Axes, path: Array, exact: Array, heading: Array, color: str) -> float:
    """Path, closed form, and the coin as a stroke along its heading."""
    axes.plot(*path.T, color=color, lw=1.5)
    step, size = (len(path) - 1) // 24, 0.04 * float(np.max(np.ptp(path, axis=0)))
    axes.plot(*exact[::step].T, "o", ms=2.8, color=BLACK, zorder=4)
    along = size * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    for k in range(step // 2, len(path), 2 * step):
        ends = np.stack([path[k] - along[k], path[k] + along[k]])
        axes.plot(*ends.T, color=MUTED, lw=3.4, zorder=3, solid_capstyle="butt")
    axes.set_aspect("equal")
    axes.set_anchor("N")
    return float(np.max(np.abs(path - exact)))


def _circles(axes: Axes) -> float:
    axes.set_title("constant rates: circles [m]")
    errors = []
    for steer, roll, color in ((1.0, 2.0, BLUE), (-1.0, 1.2, RED)):
        t = np.linspace(0.0, 2.0 * math.pi, 361)
        y = _COIN.state(heading=math.pi, steer_rate=steer, roll_rate=roll)
        motion = _COIN.simulate(y, t)
        exact = theory.roll_coin(t, radius=0.5, phi_rate=steer, psi_rate=roll, phi=math.pi)
        errors.append(_plot(axes, motion["contact"], exact.place, exact.phi, color))
    return max(errors)


def _spiral(axes: Axes, torque: float) -> float:
    axes.set_title("constant torque: spiral [m]")
    roll = 3.0
    t = np.linspace(-7.0, 7.0, 241)
    parts = []
    for way in (1.0, -1.0):  # from the middle forwards and backwards
        times = way * np.linspace(0.0, 7.0, 121)
        y = _COIN.state(heading=math.pi, roll_rate=roll)
        parts.append(_COIN.simulate(y, times, [torque, 0.0])["contact"])
    path = np.concatenate([parts[1][:0:-1], parts[0]])
    exact = theory.drive_coin(t, **_SHAPE, torques=(torque, 0.0), psi_rate=roll, phi=math.pi)
    return _plot(axes, path, exact.place, exact.phi, GREEN)


def _slope(axes: Axes, slope: float, speed: float) -> float:
    degrees = math.degrees(slope)
    axes.set_title(f"turning steadily on a slope of {degrees:.3g} degrees, downhill is down [m]")
    rate = 2.0
    coin = UprightCoin(1.0, 0.5, 0.0625, 0.125, slope=slope)
    t = np.linspace(0.0, 4.0 * math.pi, 361)
    y = coin.state(heading=math.pi, steer_rate=rate, roll_rate=speed / 0.5)
    motion = coin.simulate(y, t)
    exact = theory.steer_on_incline(
        t, slope=slope, beta=0.5, g=9.81, steering_rate=rate, speed=speed
    )
    across, down = motion["contact"][:, 1], -motion["contact"][:, 0]
    heading = exact.heading - 0.5 * math.pi  # downhill is down
    closed = np.stack([exact.place[:, 1], -exact.place[:, 0]], axis=-1)
    error = _plot(axes, np.stack([across, down], axis=-1), closed, heading, BLUE)
    drift = theory.drift_across_slope(slope=slope, beta=0.5, g=9.81, steering_rate=rate)
    page_arrow(axes, [0.0, 1.0], [drift * t[-1], 1.0], MUTED)
    axes.text(0.5 * drift * t[-1], 1.08, "mean drift, closed form", ha="center", color=MUTED)
    axes.set_ylim(None, 1.35)
    return error
