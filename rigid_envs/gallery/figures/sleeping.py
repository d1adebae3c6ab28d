"""The sleeping top and its threshold."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.analytic import heavy_top as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.figures.tops import PARAMETERS, TOP, start
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, MUTED, ORANGE, RED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SLEEPING"]

_PUSH = 0.01  # rad, first tilt
_SHOWN = ((0.5, RED), (0.9, ORANGE), (1.1, GREEN))  # spins over the threshold


def draw(figure: Figure) -> tuple[Number, ...]:
    """Simulate tops with a first tilt of 0.01 rad; compare how far they fall."""
    threshold = theory.sleeping_threshold(**PARAMETERS)
    left, right = figure.subplots(1, 2)
    t = np.linspace(0.0, 30.0, 1501)
    for part, color in _SHOWN:
        tilt = TOP.simulate(start(_PUSH, 0.0, part * threshold), t)["tilt"]
        left.plot(t, np.degrees(tilt), color=color, label=f"{part:g} x threshold")
    left.set_xlim(0.0, 30.0), left.set_xlabel("time [s]"), left.set_title("tilt [degrees]")
    fine = np.linspace(0.0, 0.99999, 400)
    falls = [float(theory.homoclinic_tilt(0.0, c * threshold, **PARAMETERS)) for c in fine]
    right.plot(fine, np.degrees(falls), color=BLUE, label="closed form, upright start")
    right.plot([1.0, 1.5], [0.0, 0.0], color=BLUE)
    errors = [0.0]
    for part in np.arange(0.1, 1.51, 0.1):
        y = start(_PUSH, 0.0, float(part) * threshold)
        nod = theory.nutation(y[TOP.components["omega_body"]], y[TOP.components["q"]], **PARAMETERS)
        times = np.linspace(0.0, nod.period, 201)  # the largest tilt is in the middle
        found = float(np.max(TOP.simulate(y, times)["tilt"]))
        errors.append(abs(found - nod.theta_max))
        right.plot(part, math.degrees(found), "o", color=BLACK, ms=4.5, zorder=4)
    right.plot([], [], "o", color=BLACK, ms=4.5, label="simulated")
    right.axvline(1.0, color=MUTED, lw=0.9, ls=":")
    right.set_xlabel("spin over the threshold"), right.set_title("largest tilt [degrees]")
    right.set_xlim(0.0, 1.53)
    figure.legend(ncols=3, columnspacing=1.2)
    error = max(errors)
    return (
        Number("largest error of the largest tilt, pushed by 0.01 rad", error, 0.0, 1e-8, "rad"),
        _growth(0.5 * threshold),
    )


def _growth(omega3: float) -> Number:
    """Rate at which a tilt of 1e-9 rad grows, once the part that dies out has done so."""
    exact = theory.sleeping_exponents(omega3, **PARAMETERS)[0].real
    times = np.array([0.0, 9.0, 12.0]) / exact
    _, first, last = TOP.simulate(start(1e-9, 0.0, omega3), times)["tilt"]
    rate = math.log(last / first) / float(times[2] - times[1])
    return Number("growth rate of a tiny tilt, half the threshold", rate, exact, 1e-6, "1/s")


SLEEPING = Entry(
    name="sleeping",
    title="The sleeping top and its threshold",
    caption="A top that stands upright and is pushed by 0.01 rad: above the threshold it stays "
    "up, below it falls, rises again and so on. Right: how far it falls. The curve is that of "
    "the orbit which leaves the vertical itself.",
    law="sleeps where (I3 omega3)^2 > 4 I m g ell",
    source="Goldstein, section 5.7; Whittaker, Analytical Dynamics, chapter VI",
    draw=draw,
    size=(7.2, 3.9),
)
