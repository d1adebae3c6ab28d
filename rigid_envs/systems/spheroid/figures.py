"""Figures of the gallery: the tippe top."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.systems.spheroid import closed_forms as theory
from rigid_envs.systems.spheroid.system import Spheroid
from rigid_envs.watch.figures import BLACK, BLUE, GREEN, MUTED, RED, Match, exhibit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# The motions in which a tippe top ends: friction takes energy, but leaves Jellett's integral J.

THE_TOP = Spheroid()  # I1 = 0.38, I3 = 0.4, centre of mass 0.3 radii below the centre
_DEGREES = [0, 45, 90, 135, 180]


def _steady(top: Spheroid, J: float) -> tuple[float, float, float]:
    """Tilt [rad] of the motion of least energy with J, its J / D [rad/(m s)], and its energy [J].

    The top turns about the line from the contact to its centre of mass: at phi' = r J / D and
    omega3 = (r cos(theta) - a) J / D.
    """
    r, known = top.radius, {"m": top.m, "radius": top.radius, "offset": top.offset, "g": top.g}
    known |= {"i_perp": top.I1, "i3": top.I3}
    leaning = theory.tumbling(J / r, **known)
    upright = J / r <= theory.jellett_thresholds(**known)[0]
    tilt = leaning[0].theta if leaning else 0.0 if upright else math.pi
    energy = float(theory.no_slip_potential(tilt, J / r, **known))
    turning = energy + top.m * top.g * top.offset * math.cos(tilt)  # J^2 / (2 D)
    return tilt, 2.0 * turning / J, energy + top.m * top.g * r


@exhibit(
    title="The tippe top turns over",
    caption="A sphere of radius 1 m with its centre of mass 0.3 m below its centre, spun about an "
    "axis that leans by 0.1 rad. Friction takes energy, but leaves Jellett's integral J: below a "
    "first threshold the top stays upright, above a second one it turns over, between the two it "
    "stays leaning. In the body the spin changes its sense. Dotted: the least energy with this J.",
    law="least energy J^2 / (2 D) + m g (r - a cos(theta)),  "
    "D = I1 r^2 sin^2(theta) + I3 (r cos(theta) - a)^2",
    source="Cohen 1977; Rauch-Wojciechowski, Skoldstam & Glad 2005",
    size=(7.2, 5.6),
)
def tippe_top(
    figure: Figure,
    *,
    top: Spheroid = THE_TOP,
    lean: float = 0.1,
    shares: tuple[float, float, float] = (0.3, 0.7, 1.1),
    duration: float = 40.0,
) -> tuple[Match, ...]:
    """Simulate three spins, and steady motions at all tilts.

    Args:
        figure: empty.
        top: a sphere that turns over.
        lean: of the axis of the three at first [rad].
        shares: their J over the second threshold.
        duration: of the three motions [s].
    """
    (tilts, spins), (energies, ends) = figure.subplots(2, 2)
    tilts.set_title("tilt theta [degrees]"), tilts.set_yticks(_DEGREES)
    spins.set_title("spin in the body omega3 [rad/s]"), energies.set_title("energy [J]")
    second = top.standing_jellett
    J = second * np.array(shares)
    spin = J / (top.I3 * (top.radius * math.cos(lean) - top.offset))
    t = np.linspace(0.0, duration, 801)
    motion = top.simulate(top.state(tilt=lean, spin=spin), t, max_step=0.05 / top.slowest_rate)
    seen = np.degrees(motion["tilt"]), motion["omega_body"][..., 2], motion["energy"]
    for k, color in enumerate((GREEN, RED, BLUE)):
        tilt, rate, energy = _steady(top, J[k])
        limits = math.degrees(tilt), (top.radius * math.cos(tilt) - top.offset) * rate, energy
        for axes, values, end in zip((tilts, spins, energies), seen, limits, strict=True):
            (line,) = axes.plot(t, values[:, k], color=color, lw=1.4)
            axes.axhline(end, color=color, ls=":", lw=1.2)
        line.set_label(f"J = {shares[k]:g} of the second threshold")
    for axes in (tilts, spins, energies):
        axes.set_xlim(0.0, duration), axes.set_xlabel("time [s]")
    error = _draw_steady(ends, top, second)
    figure.legend(ncols=3, columnspacing=1.2)
    kept = top.invariants(motion.y)["jellett"] / J - 1.0
    return (
        Match("largest change of the tilt of steady motions in 10 s", error, 0.0, 1e-8, "rad"),
        Match("largest change of J, relative", float(np.max(np.abs(kept))), 0.0, 1e-10),
    )


def _draw_steady(axes: Axes, top: Spheroid, second: float) -> float:
    """Tilt of the least energy by J; how much it changes in simulations of 10 s."""
    share = np.linspace(0.01, 1.2, 400)
    tilts = np.degrees([_steady(top, J)[0] for J in second * share])
    axes.plot(share, tilts, color=MUTED, label="tilt of least energy")
    first = top.I3 * top.rising_spin * (top.radius - top.offset) / second
    J = np.linspace(first, 1.0, 13)[1:-1]
    tilt, rate, _ = np.transpose([_steady(top, each) for each in second * J])
    spin = (top.radius * np.cos(tilt) - top.offset) * rate
    y = top.state(tilt=tilt, precession=top.radius * rate, spin=spin)
    found = top.simulate(y, [0.0, 5.0, 10.0], max_step=0.05 / top.slowest_rate)["tilt"]
    axes.plot(J, np.degrees(found[-1]), "o", color=BLACK, ms=4.5, label="simulated for 10 s")
    for place, text in ((first, "rises above"), (1.0, "stands above")):
        axes.axvline(place, color=MUTED, lw=0.9, ls=":")
        axes.text(place - 0.02, 20.0, text, ha="right", color=MUTED, fontsize=8.5)
    axes.set_title("steady tilt theta [degrees]"), axes.set_yticks(_DEGREES)
    axes.set_xlabel("J over the second threshold"), axes.set_xlim(0.0, 1.2)
    return float(np.max(np.abs(found - tilt)))
