"""Smooth, cusped and looping nutation, drawn by the axis of the top on the sphere."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.analytic import heavy_top as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.figures.tops import PARAMETERS, TOP, axis_of, closed_attitude, start
from rigid_envs.gallery.space import Camera, arrow, bare, circle, curve, solid, surface_grid
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, MUTED, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["NUTATION"]

_EYE = Camera(-90.0, 50.0)
_SPIN, _TILT = 6.0, math.radians(35.0)
_KINDS = (("smooth", 0.22, BLUE), ("cusped: let go at rest", 0.0, RED), ("looping", -0.45, GREEN))


def draw(figure: Figure) -> tuple[Number, ...]:
    """Simulate three starts that differ in the first rate of precession alone."""
    panels = figure.subplots(1, 3)
    errors = []
    for axes, (name, precession, color) in zip(panels, _KINDS, strict=True):
        errors.append(_trace(axes, precession, color))
        axes.set_title(f"{name}\nphi' = {precession:g} rad/s at the top", loc="center")
    panels[0].plot([], [], color=MUTED, label="axis, simulated")
    panels[0].plot([], [], ".", color=BLACK, label="closed form")
    panels[0].plot([], [], color=MUTED, lw=1.0, ls=":", label="turning points of the tilt")
    figure.legend(ncols=3)
    return (Number("largest error of the axis against the closed form", max(errors), 0.0, 1e-8),)


def _trace(axes: Axes, precession: float, color: str) -> float:
    bare(axes)
    y = start(_TILT, precession, _SPIN)
    omega, q = y[TOP.components["omega_body"]], y[TOP.components["q"]]
    nod = theory.nutation(omega, q, **PARAMETERS)
    t = np.linspace(0.0, 25.0 * nod.period, 5001)
    axis = axis_of(TOP.simulate(y, t)["q"])
    turned = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
    once = int(np.argmax(turned - turned[0] > 1.97 * math.pi))
    t, axis = t[:once], axis[:once]
    exact = axis_of(closed_attitude(t, y))
    solid(axes, _EYE)
    surface_grid(axes, _EYE)
    ball = np.eye(3)
    curve(axes, _EYE, axis, _EYE.faces(axis, ball), color=color, lw=1.7)
    dots = exact[::35][_EYE.faces(exact[::35], ball)]
    axes.plot(*_EYE.project(dots).T, ".", ms=3.0, color=BLACK, zorder=5)
    for angle in (nod.theta_min, nod.theta_max):
        ring = circle([0.0, 0.0, 1.0], math.sin(angle), [0.0, 0.0, math.cos(angle)])
        seen = _EYE.faces(ring, ball)
        curve(axes, _EYE, ring, seen, color=MUTED, lw=1.0, ls=":", zorder=2.5)
    arrow(axes, _EYE, [0.0, 0.0, 1.0], [0.0, 0.0, 1.24], "", MUTED, lw=1.2)
    axes.set_xlim(-1.02, 1.02), axes.set_ylim(-1.02, 1.12)
    return float(np.max(np.abs(axis - exact)))


NUTATION = Entry(
    name="nutation",
    title="Nutation: smooth, cusped and looping",
    caption="Path of the axis of a top on the unit sphere, from a tilt of 35 degrees with a spin "
    "of 6 rad/s (the sleeping threshold is 4). Let go at rest it has cusps; pushed along it runs "
    "smoothly, pushed back it makes loops.",
    law="cos theta = u1 cn^2 u + u2 sn^2 u;  phi' = (p_phi - p_psi cos theta) / (I sin^2 theta)",
    source="Goldstein, section 5.7; Whittaker, Analytical Dynamics, chapter VI",
    draw=draw,
    size=(7.2, 4.1),
)
