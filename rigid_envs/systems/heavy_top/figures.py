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


# The top of all figures of the heavy top, if no other is given, and what closed forms ask of one.

TOP = HeavyTop()  # I1 = I2 = 1, I3 = 0.5, m g ell = 1: sleeps from a spin of 4 rad/s on


def parameters(top: HeavyTop) -> dict[str, Any]:
    """Of the closed forms of a symmetric top."""
    return {"i_perp": top.I1, "i3": top.I3, "mgl": top.m * top.g * top.ell}


def turning(top: HeavyTop, y: Array) -> tuple[Array, Array]:
    """Angular velocity and attitude of a state, as closed forms take them."""
    return top.omega_body(y), top.accessors["q"](y)


def axis_of(q: Array) -> Array:
    """The axis e3 in the world, shape (..., 3), of attitudes, shape (..., 4)."""
    return rotations.rotate(q, np.array([0.0, 0.0, 1.0]))


# Smooth, cusped and looping nutation, drawn by the axis of the top on the sphere.

_EYE = Eye(-90.0, 50.0)
_KINDS = (("smooth", BLUE), ("cusped: let go at rest", RED), ("looping", GREEN))


@exhibit(
    title="Nutation: smooth, cusped and looping",
    caption="Path of the axis of a top on the unit sphere, from a tilt of 35 degrees with a spin "
    "of 6 rad/s (the sleeping threshold is 4). Let go at rest it has cusps; pushed along it runs "
    "smoothly, pushed back it makes loops.",
    law="cos theta = u1 cn^2 u + u2 sn^2 u;  phi' = (p_phi - p_psi cos theta) / (I sin^2 theta)",
    source="Goldstein, section 5.7; Whittaker, Analytical Dynamics, chapter VI",
    size=(7.2, 4.1),
)
def nutation(
    figure: Figure,
    *,
    top: HeavyTop = TOP,
    tilt: float = math.radians(35.0),
    spin: float = 6.0,
    precessions: tuple[float, float, float] = (0.22, 0.0, -0.45),
) -> tuple[Match, ...]:
    """Simulate three starts that differ in the first rate of precession alone.

    Args:
        figure: empty.
        top: symmetric.
        tilt: at first [rad].
        spin: omega . e3 [rad/s].
        precessions: rates phi' at first [rad/s].
    """
    panels = figure.subplots(1, 3)
    errors = []
    for axes, precession, (name, color) in zip(panels, precessions, _KINDS, strict=True):
        y = top.state(tilt=tilt, precession=precession, spin=spin)
        errors.append(_trace(axes, top, y, color))
        axes.set_title(f"{name}\nphi' = {precession:g} rad/s at the top", loc="center")
    panels[0].plot([], [], color=MUTED, label="axis, simulated")
    panels[0].plot([], [], ".", color=BLACK, label="closed form")
    panels[0].plot([], [], color=MUTED, lw=1.0, ls=":", label="turning points of the tilt")
    figure.legend(ncols=3)
    return (Match("largest error of the axis against the closed form", max(errors), 0.0, 1e-8),)


def _trace(axes: Axes, top: HeavyTop, y: Array, color: str) -> float:
    bare(axes)
    nod = theory.nutation(*turning(top, y), **parameters(top))
    t = np.linspace(0.0, 25.0 * nod.period, 5001)
    axis = axis_of(top.simulate(y, t)["q"])
    turned = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
    once = int(np.argmax(turned - turned[0] > 1.97 * math.pi))
    t, axis = t[:once], axis[:once]
    exact = axis_of(theory.attitude(t, *turning(top, y), **parameters(top)))
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
def potential(
    figure: Figure, *, top: HeavyTop = TOP, tilt: float = math.radians(30.0), spin: float = 4.2
) -> tuple[Match, ...]:
    """Draw the potential and the simulated tilt; compare its turning points.

    Args:
        figure: empty.
        top: symmetric.
        tilt: where it is let go at rest [rad].
        spin: omega . e3 [rad/s].
    """
    y, values = top.state(tilt=tilt, precession=0.0, spin=spin), parameters(top)
    kept = theory.invariants(*turning(top, y), **values)
    nod = theory.nutation(*turning(top, y), **values)
    t = np.linspace(0.0, 3.0 * nod.period, 1201)
    theta = top.simulate(y, t)["tilt"]
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.5))
    _draw_potential(left, kept, nod, values)
    right.plot(t, np.degrees(theta), color=BLUE, label="simulated")
    exact = theory.tilt(t[::40], *turning(top, y), **values)
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


def _draw_potential(
    axes: Axes, kept: theory.Invariants, nod: theory.Nutation, values: dict[str, Any]
) -> None:
    theta = np.radians(np.linspace(16.0, 88.0, 400))
    momenta = (kept.p_phi, kept.p_psi)
    shape = {"i_perp": values["i_perp"], "mgl": values["mgl"]}
    V = theory.effective_potential(theta, *momenta, **shape)
    energy = kept.energy - 0.5 * kept.p_psi**2 / values["i3"]
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


@exhibit(
    title="Fast and slow precession",
    caption="At a tilt of 50 degrees a top can precess without nodding at two rates, from a least "
    "spin on. The slow one is near m g ell / (I3 omega3) for a fast top. Right: the two axes at a "
    "spin of 5 rad/s, a dot every 0.2 s; the circle of the fast one is drawn smaller.",
    law="I cos(theta) phi'^2 - I3 omega3 phi' + m g ell = 0",
    source="Goldstein, section 5.7",
    size=(7.2, 4.0),
)
def precession(
    figure: Figure, *, top: HeavyTop = TOP, tilt: float = math.radians(50.0), spin: float = 5.0
) -> tuple[Match, ...]:
    """Start on both steady precessions; measure the rate and that the tilt stays.

    Args:
        figure: empty.
        top: symmetric.
        tilt: that stays [rad].
        spin: omega . e3 of the axes that are seen from above [rad/s].
    """
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    values = parameters(top)
    threshold = float(theory.steady_threshold(tilt, **values))
    spins = threshold + np.linspace(0.0, math.sqrt(9.0 - threshold), 300) ** 2
    slow, fast = theory.steady_precession(tilt, spins, **values)
    left.plot(spins, fast, color=RED, label="fast precession")
    left.plot(spins, slow, color=BLUE, label="slow precession")
    quick = theory.fast_top(tilt, spins, **values)
    left.plot(spins, quick.precession, color=MUTED, lw=1.2, ls="--", label="m g ell / (I3 omega3)")
    left.axvline(threshold, color=MUTED, lw=0.9, ls=":")
    left.text(threshold - 0.08, 4.2, "none\nbelow", ha="right", color=MUTED, fontsize=8.5)
    errors = [0.0]
    for omega3 in (3.3, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0):
        errors += _measure(left, top, tilt, omega3)
    left.plot([], [], "o", color=BLACK, ms=4.5, label="simulated")
    left.set_xlim(2.3, 9.2), left.set_ylim(0.0, 7.4)
    left.set_xlabel("spin omega3 [rad/s]"), left.set_title("precession rate phi' [rad/s]")
    nodding = _axes_seen_from_above(right, top, tilt, spin)
    figure.legend(ncols=4, columnspacing=1.2)
    return (
        Match("largest error of a simulated rate, relative", max(errors), 0.0, 1e-8),
        Match("largest change of the tilt in 20 s", nodding, 0.0, 1e-7, "rad"),
    )


def _measure(axes: Axes, top: HeavyTop, tilt: float, omega3: float) -> list[float]:
    """Relative errors of the two rates of precession, over 10 s."""
    errors = []
    for exact in theory.steady_precession(tilt, omega3, **parameters(top)):
        t = np.linspace(0.0, 10.0, 401)
        y = top.state(tilt=tilt, precession=exact, spin=omega3)
        axis = axis_of(top.simulate(y, t)["q"])
        phi = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
        rate = (phi[-1] - phi[0]) / 10.0
        axes.plot(omega3, rate, "o", color=BLACK, ms=4.5, zorder=5)
        errors.append(abs(float(rate / exact - 1.0)))
    return errors


def _axes_seen_from_above(axes: Axes, top: HeavyTop, tilt: float, spin: float) -> float:
    """Directions of both axes after each 0.2 s; largest change of tilt."""
    bare(axes)
    axes.set_title("axis from above, 0 to 2 s")
    t, change = np.linspace(0.0, 20.0, 2001), 0.0
    for exact, color, size in zip(
        theory.steady_precession(tilt, spin, **parameters(top)),
        (BLUE, RED),
        (1.0, 0.86),
        strict=True,
    ):
        motion = top.simulate(top.state(tilt=tilt, precession=exact, spin=spin), t)
        axis = size * axis_of(motion["q"])[:201]  # one inside the other, to be told apart
        axes.plot(*axis[:, :2].T, color=color)
        axes.plot(*axis[::20, :2].T, "o", color=color, ms=4)
        page_arrow(axes, axis[197, :2], axis[200, :2], color)
        change = max(change, float(np.ptp(motion["tilt"])))
    axes.set_xlim(-0.85, 0.85), axes.set_ylim(-0.85, 0.85)
    axes.plot(0, 0, "+", color=MUTED)
    return change


# The sleeping top and its threshold.


@exhibit(
    title="The sleeping top and its threshold",
    caption="A top that stands upright and is pushed by 0.01 rad: above the threshold it stays "
    "up, below it falls, rises again and so on. Right: how far it falls. The curve is that of "
    "the orbit which leaves the vertical itself.",
    law="sleeps where (I3 omega3)^2 > 4 I m g ell",
    source="Goldstein, section 5.7; Whittaker, Analytical Dynamics, chapter VI",
    size=(7.2, 3.9),
)
def sleeping(
    figure: Figure,
    *,
    top: HeavyTop = TOP,
    push: float = 0.01,
    spins: tuple[float, float, float] = (0.5, 0.9, 1.1),
) -> tuple[Match, ...]:
    """Simulate tops with a small first tilt; compare how far they fall.

    Args:
        figure: empty.
        top: symmetric.
        push: first tilt [rad].
        spins: of the motions on the left, over the threshold.
    """
    values = parameters(top)
    threshold = theory.sleeping_threshold(**values)
    left, right = figure.subplots(1, 2)
    t = np.linspace(0.0, 30.0, 1501)
    for part, color in zip(spins, (RED, ORANGE, GREEN), strict=True):
        y = top.state(tilt=push, precession=0.0, spin=part * threshold)
        tilt = top.simulate(y, t)["tilt"]
        left.plot(t, np.degrees(tilt), color=color, label=f"{part:g} x threshold")
    left.set_xlim(0.0, 30.0), left.set_xlabel("time [s]"), left.set_title("tilt [degrees]")
    fine = np.linspace(0.0, 0.99999, 400)
    falls = [float(theory.homoclinic_tilt(0.0, c * threshold, **values)) for c in fine]
    right.plot(fine, np.degrees(falls), color=BLUE, label="closed form, upright start")
    right.plot([1.0, 1.5], [0.0, 0.0], color=BLUE)
    errors = [0.0]
    for part in np.arange(0.1, 1.51, 0.1):
        y = top.state(tilt=push, precession=0.0, spin=part * threshold)
        nod = theory.nutation(*turning(top, y), **values)
        times = np.linspace(0.0, nod.period, 201)  # the largest tilt is in the middle
        found = float(np.max(top.simulate(y, times)["tilt"]))
        errors.append(abs(found - nod.theta_max))
        right.plot(part, math.degrees(found), "o", color=BLACK, ms=4.5, zorder=4)
    right.plot([], [], "o", color=BLACK, ms=4.5, label="simulated")
    right.axvline(1.0, color=MUTED, lw=0.9, ls=":")
    right.set_xlabel("spin over the threshold"), right.set_title("largest tilt [degrees]")
    right.set_xlim(0.0, 1.53)
    figure.legend(ncols=3, columnspacing=1.2)
    error = max(errors)
    return (
        Match(
            f"largest error of the largest tilt, pushed by {push:g} rad", error, 0.0, 1e-8, "rad"
        ),
        _growth(top, 0.5 * threshold),
    )


def _growth(top: HeavyTop, omega3: float) -> Match:
    """Rate at which a tilt of 1e-9 rad grows, once the part that dies out has done so."""
    exact = theory.sleeping_exponents(omega3, **parameters(top))[0].real
    times = np.array([0.0, 9.0, 12.0]) / exact
    y = top.state(tilt=1e-9, precession=0.0, spin=omega3)
    _, first, last = top.simulate(y, times)["tilt"]
    rate = math.log(last / first) / float(times[2] - times[1])
    return Match("growth rate of a tiny tilt, half the threshold", rate, exact, 1e-6, "1/s")
