"""Effective potential of the heavy top, and the turning points of its nutation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.analytic import heavy_top as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.figures.tops import PARAMETERS, TOP, start
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, MUTED, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["POTENTIAL"]

_START = start(math.radians(30.0), 0.0, 4.2)
_OMEGA, _Q = _START[TOP.components["omega_body"]], _START[TOP.components["q"]]


def draw(figure: Figure) -> tuple[Number, ...]:
    """Draw the potential and the simulated tilt; compare its turning points."""
    kept = theory.invariants(_OMEGA, _Q, **PARAMETERS)
    nod = theory.nutation(_OMEGA, _Q, **PARAMETERS)
    t = np.linspace(0.0, 3.0 * nod.period, 1201)
    motion = TOP.simulate(_START, t)
    theta = motion["tilt"]
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.5))
    _draw_potential(left, kept, nod)
    right.plot(t, np.degrees(theta), color=BLUE, label="simulated")
    exact = theory.tilt(t[::40], _OMEGA, _Q, **PARAMETERS)
    right.plot(t[::40], np.degrees(exact), ".", color=BLACK, ms=5, label="closed form")
    for angle in (nod.theta_min, nod.theta_max):
        right.axhline(math.degrees(angle), color=RED, lw=0.9, ls=":")
    right.set_xlabel("time [s]"), right.set_xlim(0.0, t[-1])
    right.set_title("tilt theta(t) of the axis")
    figure.legend(ncols=5, columnspacing=1.2)
    return (
        Number("largest tilt", float(theta.max()), nod.theta_max, 1e-9, "rad"),
        Number("smallest tilt", float(theta.min()), nod.theta_min, 1e-9, "rad"),
    )


def _draw_potential(axes: Axes, kept: theory.Invariants, nod: theory.Nutation) -> None:
    theta = np.radians(np.linspace(16.0, 88.0, 400))
    momenta = (kept.p_phi, kept.p_psi)
    shape = {"i_perp": PARAMETERS["i_perp"], "mgl": PARAMETERS["mgl"]}
    V = theory.effective_potential(theta, *momenta, **shape)
    energy = kept.energy - 0.5 * kept.p_psi**2 / PARAMETERS["i3"]
    axes.plot(V, np.degrees(theta), color=GREEN, label="V(theta)")
    axes.axvline(energy, color=MUTED, lw=1.2, ls="--", label="energy")
    ends = np.array([nod.theta_min, nod.theta_max])
    axes.plot([energy] * 2, np.degrees(ends), "o", color=RED, ms=6, label="turning points")
    low = int(np.argmin(V))
    axes.plot(V[low], math.degrees(theta[low]), "s", color=GREEN, ms=5)
    axes.annotate(
        "steady\nprecession", (V[low], math.degrees(theta[low])), (energy + 0.04, 43.0),
        fontsize=8.5, va="center", color=MUTED, arrowprops={"arrowstyle": "-", "color": MUTED},
    )  # fmt: skip
    axes.set_xlim(V[low] - 0.05, energy + 0.4), axes.set_ylim(16.0, 88.0)
    axes.set_xlabel("V [J]"), axes.set_ylabel("theta [degrees]")
    axes.set_title("effective potential")


POTENTIAL = Entry(
    name="potential",
    title="Effective potential and turning points of the heavy top",
    caption="With its two momenta constant, the tilt moves like a particle in the potential V: "
    "let go at rest at 30 degrees with a spin of 4.2 rad/s, it nods between the two angles where V "
    "is the energy. At the minimum of V the top would precess without nodding.",
    law="I theta'^2 / 2 + V(theta) = E - p_psi^2 / (2 I3),  "
    "V = (p_phi - p_psi cos theta)^2 / (2 I sin^2 theta) + m g ell cos theta",
    source="Goldstein, section 5.7",
    draw=draw,
    size=(7.2, 4.0),
)
