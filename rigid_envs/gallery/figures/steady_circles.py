"""Steady circles of the rolling disk: rates, and where they are stable."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs.analytic import rolling_disk as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.figures.disk import SHAPE, THE_DISK, rolling
from rigid_envs.gallery.style import BLACK, BLUE, GREEN, MUTED, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["STEADY_CIRCLES"]

Array = npt.NDArray[np.float64]
_LEANS = np.linspace(8.0, 86.0, 157)  # degrees of the axis from the vertical
_RADII = ((0.6, BLUE), (1.0, GREEN), (2.0, RED))


def draw(figure: Figure) -> tuple[Number, ...]:
    """Rates of steady circles in closed form; simulate some of them for 5 s."""
    left, right = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    for size, color in _RADII:
        _draw_rates(left, size, color)
    t = np.linspace(0.0, 5.0, 151)
    cases = [(size, lean) for size, _ in _RADII for lean in (30.0, 50.0, 70.0)]
    starts = [_start(_steady(*case), math.radians(case[1])) for case in cases]
    contact = THE_DISK.simulate(np.array(starts), t)["contact"]
    errors = []
    for k, (size, lean) in enumerate(cases):
        around, error = _compare(t, contact[:, k], starts[k], _steady(size, lean))
        turned = np.unwrap(np.arctan2(around[:, 1], around[:, 0]))
        left.plot(lean, (turned[-1] - turned[0]) / 5.0, "o", color=BLACK, ms=4.5, zorder=4)
        errors.append(error)
        if lean == 50.0:
            right.plot(*around.T, color=_RADII[k // 3][1], lw=1.5)
            right.plot(*around[0], "o", color=_RADII[k // 3][1], ms=5)
    left.plot([], [], "o", color=BLACK, ms=4.5, label="simulated")
    left.plot([], [], color=MUTED, ls="--", lw=1.3, label="unstable")
    left.set_xlim(0.0, 90.0), left.set_ylim(0.0, 9.0)
    left.set_xlabel("theta [degrees], 90 upright"), left.set_title("precession rate phi' [rad/s]")
    right.set_aspect("equal"), right.set_anchor("N")
    right.set_title("contact at 50 degrees, 5 s [m]")
    figure.legend(ncols=3, columnspacing=1.2)
    return (Number("largest error of the contact's circle in 5 s", max(errors), 0.0, 1e-7, "m"),)


def _steady(size: float, lean: float) -> theory.SteadyCircle:
    return theory.steady_circle(math.radians(lean), size, **SHAPE, g=THE_DISK.g)


def _draw_rates(axes: Axes, size: float, color: str) -> None:
    found = [_steady(size, float(lean)) for lean in _LEANS]
    rate = np.array([circle.precession for circle in found])
    stable = np.array([circle.frequency_squared > 0.0 for circle in found])
    text = f"circle of {size:g} m"
    axes.plot(_LEANS, np.where(stable, rate, np.nan), color=color, label=text)
    axes.plot(_LEANS, np.where(~stable, rate, np.nan), color=color, ls="--", lw=1.3)


def _start(exact: theory.SteadyCircle, theta: float) -> Array:
    return rolling(theta, 0.0, exact.precession, exact.omega3)


def _compare(
    t: Array, contact: Array, start: Array, exact: theory.SteadyCircle
) -> tuple[Array, float]:
    """Contact from the centre of its circle, and its largest departure from uniform motion."""
    along = THE_DISK.velocity(start)[:2]
    inwards = np.array([-along[1], along[0]]) / np.hypot(*along)  # it turns to the left
    around = contact - (contact[0] + exact.contact_radius * inwards)
    uniform = exact.contact_radius * np.exp(1j * exact.precession * t) * complex(*-inwards)
    closed = np.stack([uniform.real, uniform.imag], axis=-1)
    return around, float(np.max(np.abs(around - closed)))


STEADY_CIRCLES = Entry(
    name="steady_circles",
    title="Steady circles of the rolling disk",
    caption="For each lean and each circle of the contact there is one rate at which a disk of "
    "radius 0.5 m rolls on steadily. Dashed: the circle is unstable, a small push grows. The "
    "nearer to flat, the faster it must turn.",
    law="phi'^2 sin(theta) (A cos(theta) + B (R / r - cos(theta))) = m g r cos(theta)",
    source="Routh, Advanced Part, section 244; O'Reilly 1996",
    draw=draw,
    size=(7.2, 4.2),
)
