"""Pumping a wheel out of a valley by its moment of inertia."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs.control import Pump
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, MUTED, RED
from rigid_envs.systems import Roller

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["PUMP"]

Array = npt.NDArray[np.float64]
_VALLEY = Roller(m=1.0, radius=0.1, beta=0.4, curvature=0.5)
_DT, _RIM, _START = 0.002, math.radians(75.0), -math.radians(20.0) / 0.5
_PUMP = Pump(_VALLEY, beta_change=0.6, dt=_DT)


def draw(figure: Figure) -> tuple[Number, ...]:
    """Pump until the rim is passed; compare the heights of the turning points with the law."""
    t, s, change, heights = _run()
    left, right = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    _draw_swings(left, t, s, change)
    n = np.arange(len(heights))
    right.plot(n, heights, "o", color=BLACK, ms=5, label="simulated turning points", zorder=4)
    right.plot(n, heights[0] * _PUMP.gain**n, color=BLUE, label="law: h gain$^n$")
    rim = 2.0 * math.sin(0.5 * _RIM) ** 2 / _VALLEY.curvature
    right.axhline(rim, color=MUTED, ls=":", lw=1.0)
    right.text(0.0, 1.02 * rim, "rim", color=MUTED, fontsize=8.5, va="bottom")
    right.set_yscale("log"), right.set_yticks([0.1, 0.2, 0.5, 1.0], ["0.1", "0.2", "0.5", "1"])
    right.minorticks_off()
    right.set_ylim(0.09, 2.3), right.set_xticks(n)
    right.set_xlabel("passes of the bottom"), right.set_title("height of the turning point [m]")
    figure.legend(ncols=5, columnspacing=1.0)
    gains = np.array(heights[1:]) / heights[:-1]
    worst = float(gains[np.argmax(np.abs(gains - _PUMP.gain))])
    passes = int(_PUMP.least_passes([_START, 0.0], _RIM))
    return (
        Number("gain of height per pass, worst", worst, _PUMP.gain, 2e-5),
        Number("passes to the rim", float(_passes(s)), float(passes), 0.0),
    )


def _run() -> tuple[Array, Array, Array, list[float]]:
    """Times, places, additions to the ratio; heights of the turning points, one beyond the rim."""
    y, change = np.array([_START, 0.0]), 0.0
    places, changes, heights = [float(y[0])], [change], [float(_PUMP.height(y, 0.0))]
    while abs(_VALLEY.curvature * y[0]) < _RIM and len(places) < 20000:
        new = 0.3 * (1.0 + float(_PUMP(y, change)[0]))
        v = y[1] * (1.4 + change) / (1.4 + new)  # a sudden change keeps the momentum
        y, change = _VALLEY.advance([y[0], v], [0.0, new], _DT), new
        if y[1] * v < 0.0:
            heights.append(float(_PUMP.height(y, change)))
        places.append(float(y[0]))
        changes.append(change)
    heights.append(float(_PUMP.height(y, change)))  # to which it would rise beyond the rim
    t = np.linspace(0.0, _DT * (len(places) - 1), len(places))
    return t, np.array(places), np.array(changes), heights


def _passes(s: Array) -> int:
    return int(np.sum(s[1:] * s[:-1] < 0.0))


def _draw_swings(axes: Axes, t: Array, s: Array, change: Array) -> None:
    angle = np.degrees(_VALLEY.curvature * s)
    large = change > 0.0
    axes.plot(t, np.where(large, angle, np.nan), color=RED, label="masses out")
    axes.plot(t, np.where(large, np.nan, angle), color=GREEN, label="masses in")
    for side in (1.0, -1.0):
        axes.axhline(side * math.degrees(_RIM), color=MUTED, ls=":", lw=1.0)
    axes.text(0.1, math.degrees(_RIM) + 2.0, "rim", color=MUTED, fontsize=8.5)
    axes.set_xlim(0.0, t[-1]), axes.set_ylim(-88.0, 88.0)
    axes.set_xlabel("time [s]"), axes.set_title("angle from the bottom of the valley [degrees]")


PUMP = Entry(
    name="pump",
    title="Pumping a wheel out of a valley",
    caption="No force drives the wheel. It moves masses outwards at the turning points, where "
    "that costs nothing, and inwards at the bottom, where that costs work. Each pass of the "
    "bottom multiplies the height by the same gain, and no other law climbs out in fewer passes.",
    law="h' / h = (1 + beta + beta_change) / (1 + beta)",
    source="Tea & Falk 1968, Pumping on a swing, American Journal of Physics 36:1165",
    draw=draw,
    size=(7.2, 3.9),
)
