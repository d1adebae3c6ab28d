"""Fast and slow precession of the heavy top."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.analytic import heavy_top as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.figures.tops import PARAMETERS, TOP, axis_of, start
from rigid_envs.gallery.space import bare, page_arrow
from rigid_envs.gallery.style import BLACK, BLUE, MUTED, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["PRECESSION"]

_TILT = math.radians(50.0)


def draw(figure: Figure) -> tuple[Number, ...]:
    """Start on both steady precessions; measure the rate and that the tilt stays."""
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    threshold = float(theory.steady_threshold(_TILT, **PARAMETERS))
    spin = threshold + np.linspace(0.0, math.sqrt(9.0 - threshold), 300) ** 2
    slow, fast = theory.steady_precession(_TILT, spin, **PARAMETERS)
    left.plot(spin, fast, color=RED, label="fast precession")
    left.plot(spin, slow, color=BLUE, label="slow precession")
    top = theory.fast_top(_TILT, spin, **PARAMETERS)
    left.plot(spin, top.precession, color=MUTED, lw=1.2, ls="--", label="m g ell / (I3 omega3)")
    left.axvline(threshold, color=MUTED, lw=0.9, ls=":")
    left.text(threshold - 0.08, 4.2, "none\nbelow", ha="right", color=MUTED, fontsize=8.5)
    errors = [0.0]
    for omega3 in (3.3, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0):
        errors += _measure(left, omega3)
    left.plot([], [], "o", color=BLACK, ms=4.5, label="simulated")
    left.set_xlim(2.3, 9.2), left.set_ylim(0.0, 7.4)
    left.set_xlabel("spin omega3 [rad/s]"), left.set_title("precession rate phi' [rad/s]")
    nodding = _axes_seen_from_above(right)
    figure.legend(ncols=4, columnspacing=1.2)
    return (
        Number("largest error of a simulated rate, relative", max(errors), 0.0, 1e-8),
        Number("largest change of the tilt in 20 s", nodding, 0.0, 1e-7, "rad"),
    )


def _measure(axes: Axes, omega3: float) -> list[float]:
    """Relative errors of the two rates of precession, over 10 s."""
    errors = []
    for exact in theory.steady_precession(_TILT, omega3, **PARAMETERS):
        t = np.linspace(0.0, 10.0, 401)
        axis = axis_of(TOP.simulate(start(_TILT, float(exact), omega3), t)["q"])
        phi = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
        rate = (phi[-1] - phi[0]) / 10.0
        axes.plot(omega3, rate, "o", color=BLACK, ms=4.5, zorder=5)
        errors.append(abs(float(rate / exact - 1.0)))
    return errors


def _axes_seen_from_above(axes: Axes) -> float:
    """Directions of both axes after each 0.2 s, at a spin of 5 rad/s; largest change of tilt."""
    bare(axes)
    axes.set_title("axis from above, 0 to 2 s")
    t, change = np.linspace(0.0, 20.0, 2001), 0.0
    for exact, color, size in zip(
        theory.steady_precession(_TILT, 5.0, **PARAMETERS), (BLUE, RED), (1.0, 0.86), strict=True
    ):
        motion = TOP.simulate(start(_TILT, float(exact), 5.0), t)
        axis = size * axis_of(motion["q"])[:201]  # one inside the other, to be told apart
        axes.plot(*axis[:, :2].T, color=color)
        axes.plot(*axis[::20, :2].T, "o", color=color, ms=4)
        page_arrow(axes, axis[197, :2], axis[200, :2], color)
        change = max(change, float(np.ptp(motion["tilt"])))
    axes.set_xlim(-0.85, 0.85), axes.set_ylim(-0.85, 0.85)
    axes.plot(0, 0, "+", color=MUTED)
    return change


PRECESSION = Entry(
    name="precession",
    title="Fast and slow precession",
    caption="At a tilt of 50 degrees a top can precess without nodding at two rates, from a least "
    "spin on. The slow one is near m g ell / (I3 omega3) for a fast top. Right: the two axes at a "
    "spin of 5 rad/s, a dot every 0.2 s; the circle of the fast one is drawn smaller.",
    law="I cos(theta) phi'^2 - I3 omega3 phi' + m g ell = 0",
    source="Goldstein, section 5.7",
    draw=draw,
    size=(7.2, 4.0),
)
