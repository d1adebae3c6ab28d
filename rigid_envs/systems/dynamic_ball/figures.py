"""A ball on a turntable runs round circles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.systems.dynamic_ball import closed_forms as theory
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.watch import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_Start = tuple[tuple[float, float], tuple[float, float], str]
_STARTS: tuple[_Start, ...] = (
    ((0.5, 0.0), (0.0, 0.45), figures.BLUE),
    ((0.0, -0.55), (0.1, 0.05), figures.GREEN),
    ((-0.35, 0.45), (0.12, -0.1), figures.RED),
)


@figures.exhibit(
    title="A ball on a turntable runs round circles",
    caption="A ball that rolls on a turntable does not fly off: whatever its start, a solid "
    "sphere runs round a circle (its centre: +) two times while the table turns seven times. "
    "On a tilted turntable it does not roll downhill for good but drifts across the slope.",
    law="rate = beta / (1 + beta) Omega = 2/7 Omega;  drift = g sin(tilt) / (beta Omega)",
    source="Weltner 1979, doi:10.1119/1.11602; Neimark & Fufaev, chapter III",
    size=(7.2, 4.2),
)
def turntable(
    figure: Figure,
    *,
    rate: float = 2.0 * math.pi / 3.0,
    beta: float = 0.4,
    tilt: float = math.radians(1.0),
) -> tuple[figures.Match, ...]:
    """Simulate three balls, compare them with their circles; one on a tilted turntable.

    Args:
        figure: empty.
        rate: of the turntable [rad/s].
        beta: inertia ratio of the balls: 2/5 solid, 2/3 hollow.
        tilt: of the tilted one [rad].
    """
    ball = DynamicBall(m=1.0, radius=0.05, beta=beta, turntable_rate=rate)
    period = 2.0 * math.pi / (beta / (1.0 + beta) * rate)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.3))
    figures.bare(left)
    left.set_title("level turntable, seen from above")
    a = np.linspace(0.0, 2.0 * math.pi, 181)
    left.fill(np.cos(a), np.sin(a), fc="#f1f4f8", ec=figures.MUTED, lw=1.0, zorder=1)
    t = np.linspace(0.0, period, 181)
    errors, rounds = zip(*(_circle(left, ball, start, t) for start in _STARTS), strict=True)
    tip, tail = (0.93 * np.array([math.cos(at), math.sin(at)]) for at in (-0.5, -0.9))
    figures.page_arrow(left, tail, tip, figures.MUTED, connectionstyle="arc3,rad=0.15")
    drift = _tilted(right, ball, tilt, np.linspace(0.0, 2.0 * period, 361))
    left.plot([], [], color=figures.MUTED, label="simulated")
    left.plot([], [], "o", ms=3.5, color=figures.BLACK, label="closed form")
    figure.legend(ncols=2)
    return (
        figures.Match(
            "rounds of the ball per round of the table", rounds[0], beta / (1.0 + beta), 1e-9
        ),
        figures.Match(
            "largest error of the paths against the closed form",
            max(*errors, drift),
            0.0,
            1e-9,
            "m",
        ),
    )


def _circle(axes: Axes, ball: DynamicBall, start: _Start, t: Array) -> tuple[float, float]:
    """A ball on the level turntable: error of its path, and its rounds per round of the table."""
    place, velocity, color = start
    y = ball.state(position=place, velocity=velocity)
    position = ball.simulate(y, t)["position"]
    rate = ball.turntable_rate
    circle = theory.turntable_circle(
        place, ball.omega_world(y), beta=ball.beta, radius=ball.radius, turntable_rate=rate
    )
    arm = complex(*(np.array(place) - circle.centre))
    exact = complex(*circle.centre) + arm * np.exp(1j * circle.rate * t)
    around = np.unwrap(np.angle(position @ [1.0, 1j] - complex(*circle.centre)))
    axes.plot(*position.T, color=color)
    axes.plot(exact.real[::12], exact.imag[::12], "o", ms=3, color=figures.BLACK, zorder=4)
    axes.plot(*circle.centre, "+", color=color, ms=8)
    axes.plot(*place, "o", color=color, ms=8, zorder=3)
    error = float(np.max(np.abs(position @ [1.0, 1j] - exact)))
    return error, float(around[-1] - around[0]) / (rate * t[-1])


def _tilted(axes: Axes, ball: DynamicBall, tilt: float, t: Array) -> float:
    """A ball that is pushed off against the drift."""
    axes.set_title(f"turntable tilted by {math.degrees(tilt):.3g} degree: drift [m]")
    y = ball.state(tilt=[tilt, 0.0], velocity=[-0.35, 0.0])
    motion, table = ball.simulate(y, t), {"beta": ball.beta, "turntable_rate": ball.turntable_rate}
    position, centre = motion["position"], motion["centre"]
    exact = theory.roll_on_plate(
        t, [0.0, 0.0], ball.omega_world(y), **table, radius=0.05, tilt=tilt, g=9.81
    )
    axes.plot(*position.T, color=figures.PURPLE)
    axes.plot(*position[::12].T, "o", ms=3, color=figures.BLACK, zorder=4)
    drift = theory.drift_across_slope(**table, tilt=tilt, g=9.81)
    figures.page_arrow(axes, [0.0, 1.2], [drift * t[-1], 1.2], figures.MUTED)
    axes.text(0.5 * drift * t[-1], 1.3, "mean drift, closed form", ha="center", color=figures.MUTED)
    axes.set_aspect("equal")
    axes.set_anchor("N")
    axes.set_ylim(None, 1.8)
    axes.set_xlabel("across the slope"), axes.set_ylabel("uphill")
    return float(np.max(np.abs(centre - exact.centre)))
