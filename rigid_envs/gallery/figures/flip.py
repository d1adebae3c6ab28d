"""The Dzhanibekov flip: sixty seconds beside the intermediate axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.analytic import free_body as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, MUTED, RED
from rigid_envs.systems import FreeBody

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FLIP"]

_BODY, _OMEGA = FreeBody(1.0, 2.0, 3.0), (0.01, 1.0, 0.01)


def draw(figure: Figure) -> tuple[Number, ...]:
    """Simulate 60 s, compare with Jacobi's functions; spreads of both integrals."""
    t = np.linspace(0.0, 60.0, 1201)
    motion = _BODY.simulate(_BODY.state(omega_body=_OMEGA), t)
    omega, exact = motion["omega_body"], theory.omega(t, _BODY.moments, _OMEGA)
    squares = np.sum(motion["L_body"] ** 2, axis=-1)
    twice = 2.0 * motion["kinetic_energy"]
    top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(2.6, 1.0, 1.0))
    for k, color in enumerate((BLUE, RED, GREEN)):
        top.plot(t, omega[:, k], color=color, label=f"omega{k + 1}", zorder=3)
        top.plot(t[::24], exact[::24, k], ".", ms=3.5, color=BLACK, zorder=5)
    top.plot([], [], ".", ms=5, color=BLACK, label="closed form")
    path = theory.polhode(_BODY.moments, _OMEGA)
    first = -path.start / path.rate % path.flip_interval
    for time in np.arange(first, 60.0, path.flip_interval):
        top.axvline(time, color=MUTED, lw=0.9, ls=":")
    top.set_title("angular velocity in the body [rad/s]; dotted: flips, by the closed form")
    top.set_xlim(0.0, 60.0)
    figure.legend(ncols=4)
    for axes, values, unit, name in (
        (middle, squares, 1e-15, "L$^2$"),
        (bottom, twice, 1e-12, "2 T"),
    ):
        axes.plot(t, (values / values[0] - 1.0) / unit, color=MUTED, lw=1.0)
        axes.set_title(f"relative change of {name}, in units of {unit:.0e}")
    bottom.set_xlabel("time [s]")
    error = float(np.max(np.abs(omega - exact)))
    return (
        Number("largest error of omega against Jacobi's functions", error, 0.0, 1e-9, "rad/s"),
        Number("relative spread of L^2", float(np.ptp(squares) / squares[0]), 0.0, 1e-13),
        Number("relative spread of 2 T", float(np.ptp(twice) / twice[0]), 0.0, 1e-9),
    )


FLIP = Entry(
    name="flip",
    title="The Dzhanibekov flip",
    caption="Spun about its intermediate axis with a push of 0.01 rad/s on the other two, a body "
    "of the moments 1, 2, 3 turns over again and again, at equal intervals. L^2 is kept to "
    "rounding; the energy error of the integrator stays bounded.",
    law="I omega' = I omega x omega;  flip interval 2 K(m) / p",
    source="Landau & Lifshitz, Mechanics, section 37",
    draw=draw,
    size=(7.2, 5.0),
)
