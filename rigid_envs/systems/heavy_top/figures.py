"""Figures of the gallery: tops."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.heavy_top import closed_forms as theory
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.watch.figures import (
    BLACK,
    BLUE,
    GREEN,
    MUTED,
    ORANGE,
    RED,
    Eye,
    Match,
    arrow,
    bare,
    circle,
    curve,
    exhibit,
    page_arrow,
    solid,
    surface_grid,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# The top of all figures of the heavy top, and its closed forms by name.

TOP = HeavyTop()  # I1 = I2 = 1, I3 = 0.5, m g ell = 1: sleeps from a spin of 4 rad/s on
PARAMETERS: dict[str, Any] = {"i_perp": TOP.I1, "i3": TOP.I3, "mgl": TOP.m * TOP.g * TOP.ell}


def start(theta: float, precession: float, omega3: float) -> Array:
    """State of the top without nutation at the first moment, phi = psi = 0.

    Args:
        theta: tilt [rad].
        precession: phi' [rad/s].
        omega3: axial angular velocity [rad/s].
    """
    euler = [0.0, theta, 0.0]
    rates = [precession, 0.0, omega3 - precession * np.cos(theta)]
    q = rotations.quaternion_from_euler(euler)
    return TOP.state(q=q, omega_body=rotations.omega_body_from_euler_rates(euler, rates))


def axis_of(q: Array) -> Array:
    """The axis e3 in the world, shape (..., 3), of attitudes, shape (..., 4)."""
    return rotations.rotate(q, np.array([0.0, 0.0, 1.0]))


def closed_attitude(t: Array, y: Array) -> Array:
    """Attitude of the top in closed form, shape (n, 4), from the state y at t = 0."""
    omega, q = y[TOP.components["omega_body"]], y[TOP.components["q"]]
    return theory.attitude(t, omega, q, **PARAMETERS)


# Smooth, cusped and looping nutation, drawn by the axis of the top on the sphere.

_EYE = Eye(-90.0, 50.0)
_SPIN, _NUTATION_TILT = 6.0, math.radians(35.0)
_KINDS = (("smooth", 0.22, BLUE), ("cusped: let go at rest", 0.0, RED), ("looping", -0.45, GREEN))


@exhibit(
    title="Nutation: smooth, cusped and looping",
    caption="Path of the axis of a top on the unit sphere, from a tilt of 35 degrees with a spin "
    "of 6 rad/s (the sleeping threshold is 4). Let go at rest it has cusps; pushed along it runs "
    "smoothly, pushed back it makes loops.",
    law="cos theta = u1 cn^2 u + u2 sn^2 u;  phi' = (p_phi - p_psi cos theta) / (I sin^2 theta)",
    source="Goldstein, section 5.7; Whittaker, Analytical Dynamics, chapter VI",
    size=(7.2, 4.1),
)
def nutation(figure: Figure) -> tuple[Match, ...]:
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
    return (Match("largest error of the axis against the closed form", max(errors), 0.0, 1e-8),)


def _trace(axes: Axes, precession: float, color: str) -> float:
    bare(axes)
    y = start(_NUTATION_TILT, precession, _SPIN)
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


# Effective potential of the heavy top, and the turning points of its nutation.

_START = start(math.radians(30.0), 0.0, 4.2)
_OMEGA, _Q = _START[TOP.components["omega_body"]], _START[TOP.components["q"]]


@exhibit(
    title="Effective potential and turning points of the heavy top",
    caption="With its two momenta constant, the tilt moves like a particle in the potential V: "
    "let go at rest at 30 degrees with a spin of 4.2 rad/s, it nods between the two angles where V "
    "is the energy. At the minimum of V the top would precess without nodding.",
    law="I theta'^2 / 2 + V(theta) = E - p_psi^2 / (2 I3),  "
    "V = (p_phi - p_psi cos theta)^2 / (2 I sin^2 theta) + m g ell cos theta",
    source="Goldstein, section 5.7",
    size=(7.2, 4.0),
)
def potential(figure: Figure) -> tuple[Match, ...]:
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
        Match("largest tilt", float(theta.max()), nod.theta_max, 1e-9, "rad"),
        Match("smallest tilt", float(theta.min()), nod.theta_min, 1e-9, "rad"),
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


# Fast and slow precession of the heavy top.

_PRECESSION_TILT = math.radians(50.0)


@exhibit(
    title="Fast and slow precession",
    caption="At a tilt of 50 degrees a top can precess without nodding at two rates, from a least "
    "spin on. The slow one is near m g ell / (I3 omega3) for a fast top. Right: the two axes at a "
    "spin of 5 rad/s, a dot every 0.2 s; the circle of the fast one is drawn smaller.",
    law="I cos(theta) phi'^2 - I3 omega3 phi' + m g ell = 0",
    source="Goldstein, section 5.7",
    size=(7.2, 4.0),
)
def precession(figure: Figure) -> tuple[Match, ...]:
    """Start on both steady precessions; measure the rate and that the tilt stays."""
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    threshold = float(theory.steady_threshold(_PRECESSION_TILT, **PARAMETERS))
    spin = threshold + np.linspace(0.0, math.sqrt(9.0 - threshold), 300) ** 2
    slow, fast = theory.steady_precession(_PRECESSION_TILT, spin, **PARAMETERS)
    left.plot(spin, fast, color=RED, label="fast precession")
    left.plot(spin, slow, color=BLUE, label="slow precession")
    top = theory.fast_top(_PRECESSION_TILT, spin, **PARAMETERS)
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
        Match("largest error of a simulated rate, relative", max(errors), 0.0, 1e-8),
        Match("largest change of the tilt in 20 s", nodding, 0.0, 1e-7, "rad"),
    )


def _measure(axes: Axes, omega3: float) -> list[float]:
    """Relative errors of the two rates of precession, over 10 s."""
    errors = []
    for exact in theory.steady_precession(_PRECESSION_TILT, omega3, **PARAMETERS):
        t = np.linspace(0.0, 10.0, 401)
        axis = axis_of(TOP.simulate(start(_PRECESSION_TILT, float(exact), omega3), t)["q"])
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
        theory.steady_precession(_PRECESSION_TILT, 5.0, **PARAMETERS),
        (BLUE, RED),
        (1.0, 0.86),
        strict=True,
    ):
        motion = TOP.simulate(start(_PRECESSION_TILT, float(exact), 5.0), t)
        axis = size * axis_of(motion["q"])[:201]  # one inside the other, to be told apart
        axes.plot(*axis[:, :2].T, color=color)
        axes.plot(*axis[::20, :2].T, "o", color=color, ms=4)
        page_arrow(axes, axis[197, :2], axis[200, :2], color)
        change = max(change, float(np.ptp(motion["tilt"])))
    axes.set_xlim(-0.85, 0.85), axes.set_ylim(-0.85, 0.85)
    axes.plot(0, 0, "+", color=MUTED)
    return change


# The sleeping top and its threshold.

_PUSH = 0.01  # rad, first tilt
_SHOWN = ((0.5, RED), (0.9, ORANGE), (1.1, GREEN))  # spins over the threshold


@exhibit(
    title="The sleeping top and its threshold",
    caption="A top that stands upright and is pushed by 0.01 rad: above the threshold it stays "
    "up, below it falls, rises again and so on. Right: how far it falls. The curve is that of "
    "the orbit which leaves the vertical itself.",
    law="sleeps where (I3 omega3)^2 > 4 I m g ell",
    source="Goldstein, section 5.7; Whittaker, Analytical Dynamics, chapter VI",
    size=(7.2, 3.9),
)
def sleeping(figure: Figure) -> tuple[Match, ...]:
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
        Match("largest error of the largest tilt, pushed by 0.01 rad", error, 0.0, 1e-8, "rad"),
        _growth(0.5 * threshold),
    )


def _growth(omega3: float) -> Match:
    """Rate at which a tilt of 1e-9 rad grows, once the part that dies out has done so."""
    exact = theory.sleeping_exponents(omega3, **PARAMETERS)[0].real
    times = np.array([0.0, 9.0, 12.0]) / exact
    _, first, last = TOP.simulate(start(1e-9, 0.0, omega3), times)["tilt"]
    rate = math.log(last / first) / float(times[2] - times[1])
    return Match("growth rate of a tiny tilt, half the threshold", rate, exact, 1e-6, "1/s")
