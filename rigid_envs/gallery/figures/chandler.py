"""The free wobble of the Earth's pole: Euler's period, and Chandler's."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.analytic import free_body as theory
from rigid_envs.bodies import earth
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.style import BLACK, BLUE, MUTED, RED
from rigid_envs.systems import FreeBody

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["CHANDLER"]

_DAY, _SIDEREAL_DAY = 86400.0, 86164.0905  # s
_ARCSECOND = math.pi / 648000.0
_WOBBLE = 0.2 * _ARCSECOND  # angle between omega and the axis, as is observed
_OBSERVED = 433.0  # days, of the elastic Earth


def draw(figure: Figure) -> tuple[Number, ...]:
    """Simulate 500 days of the pole, compare its period with that of the cones."""
    moments = np.diag(earth().inertia)
    moments = moments / moments[2]  # only ratios count for motion without torque
    body = FreeBody(*moments.tolist())
    rate = 2.0 * math.pi / _SIDEREAL_DAY
    omega0 = rate * np.array([math.sin(_WOBBLE), 0.0, math.cos(_WOBBLE)])
    days = np.linspace(0.0, 500.0, 251)
    motion = body.simulate(body.state(omega_body=omega0), days * _DAY)
    pole = motion["omega_body"][:, :2] / rate / _ARCSECOND
    turned = np.unwrap(np.arctan2(pole[:, 1], pole[:, 0]))
    period = 2.0 * math.pi * days[-1] / (turned[-1] - turned[0])
    exact = theory.chandler_period(omega0[2], i_perp=moments[0], i3=moments[2]) / _DAY
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.35))
    left.set_title("pole of rotation [arcsec]")
    left.set_aspect("equal")
    once = days <= exact
    left.plot(*pole[once].T, color=BLUE)
    for day in range(0, 300, 50):
        place = pole[day // 2]
        left.plot(*place, "o", color=BLUE, ms=4.5)
        left.annotate(f"{day} d", 0.72 * place, ha="center", va="center", fontsize=8, color=MUTED)
    left.plot(0, 0, "+", color=BLACK)
    left.annotate("e3", (0, 0), (6, 5), textcoords="offset points", fontsize=8.5)
    left.set_xticks([-0.2, 0.0, 0.2]), left.set_yticks([-0.2, 0.0, 0.2])
    right.set_title("component along e1 [arcsec]")
    right.plot(days, pole[:, 0], color=BLUE, label=f"simulated, rigid: {period:.1f} days")
    cosine = 0.2 * np.cos(2.0 * math.pi * days[::10] / exact)
    right.plot(days[::10], cosine, "o", ms=3, color=BLACK, label="closed form")
    slow = 0.2 * np.cos(2.0 * math.pi * days / _OBSERVED)
    right.plot(days, slow, color=RED, ls="--", lw=1.3, label=f"observed: {_OBSERVED:.0f} days")
    right.set_xlabel("days"), right.set_ylim(-0.23, 0.23), right.set_xlim(0, 500)
    figure.legend(ncols=3)
    return (Number("period of the rigid Earth's pole", float(period), exact, 1e-8, "days"),)


CHANDLER = Entry(
    name="chandler",
    title="The Earth's body cone: Euler's 304 days and Chandler's 433",
    caption="The body cone of the Earth is 0.2 arcseconds wide: the pole of rotation circles the "
    "axis of figure at a distance of 6 m, once in I1 / (I3 - I1) = 304.5 turns. (The space cone is "
    "300 times narrower.) Chandler found 433 days: the Earth yields. The dashed line has the "
    "observed period, no theory.",
    law="period = 2 pi I1 / ((I3 - I1) omega3)",
    source="Goldstein, section 5.6; moments: IERS Conventions (2010), table 1.1",
    draw=draw,
    size=(7.2, 3.6),
)
