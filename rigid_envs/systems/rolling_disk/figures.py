"""Figures of the gallery: rolling disks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_disk import closed_forms as theory
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.watch.figures import BLACK, BLUE, GREEN, MUTED, RED, Match, exhibit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# The falling disk: it nods between two leans, and its contact draws a rosette.

THE_DISK = RollingDisk.uniform(m=1.0, radius=0.5)
SHAPE: dict[str, Any] = {"m": 1.0, "radius": 0.5, "i_perp": THE_DISK.I1, "i3": THE_DISK.I3}
_SAMPLES = 80  # of each period


def rolling(theta: float, theta_rate: float, phi_rate: float, omega3: float) -> Array:
    """State of the disk, from angle and rates of its axis.

    Args:
        theta: angle of the axis from the vertical [rad].
        theta_rate: theta' [rad/s].
        phi_rate: rate of precession phi' [rad/s].
        omega3: axial angular velocity [rad/s].
    """
    euler = [0.0, theta, 0.0]
    rates = [phi_rate, theta_rate, omega3 - phi_rate * math.cos(theta)]
    q = rotations.quaternion_from_euler(euler)
    return THE_DISK.state(q=q, omega_body=rotations.omega_body_from_euler_rates(euler, rates))


@exhibit(
    title="The falling disk",
    caption="A disk of radius 0.5 m, pushed while it rolls steadily round a circle: it nods "
    "between two leans and never falls flat (theta is 90 degrees upright, 0 flat); contact and "
    "centre draw rosettes on the plane.",
    law="J theta'^2 / 2 + V(theta) = E, V from two Legendre integrals of the spins",
    source="Appell 1900; Korteweg 1900; O'Reilly 1996; Routh, Advanced Part, section 244",
    size=(7.2, 4.4),
)
def disk(figure: Figure) -> tuple[Match, ...]:
    """Simulate a disk that is let go beside a steady circle; compare leans and period."""
    steady = theory.steady_circle(math.radians(65.0), 1.5, **SHAPE, g=THE_DISK.g)
    start = (math.radians(65.0), 1.3, steady.precession, steady.omega3)
    nod = theory.fall(*start, **SHAPE, g=THE_DISK.g)
    periods = 9
    t = np.linspace(0.0, periods * nod.period, _SAMPLES * periods + 1)
    motion = THE_DISK.simulate(rolling(*start), t)
    tilt, contact, centre = motion["tilt"], motion["contact"], motion["centre"]
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    left.plot(*contact.T, color=BLUE, lw=1.4, label="point of contact")
    left.plot(*centre[:, :2].T, color=RED, lw=1.2, label="centre, from above")
    left.set_aspect("equal"), left.set_anchor("N")
    left.set_title("paths on the plane [m]")
    shown = 4 * _SAMPLES + 1
    right.plot(t[:shown], np.degrees(tilt[:shown]), color=BLUE, label="simulated")
    for angle in (nod.theta_min, nod.theta_max):
        right.axhline(math.degrees(angle), color=MUTED, ls=":", lw=1.0)
    middle = np.degrees(tilt[0])
    times = nod.period * np.arange(5)
    right.plot(times, [middle] * 5, "o", color=BLACK, ms=5, label="after whole periods")
    right.plot([], [], color=MUTED, ls=":", label="turning points, closed form")
    right.set_title("angle theta of the axis [degrees]"), right.set_xlabel("time [s]")
    right.set_xlim(0.0, times[-1])
    figure.legend(ncols=3, columnspacing=1.2)
    returned = float(np.max(np.abs(tilt[::_SAMPLES] - tilt[0])))
    return (
        Match("smallest theta", -_peak(-tilt), nod.theta_min, 1e-8, "rad"),
        Match("largest theta", _peak(tilt), nod.theta_max, 1e-8, "rad"),
        Match(f"theta after 1 .. {periods} periods, from its start", returned, 0.0, 1e-8, "rad"),
    )


def _peak(values: Array) -> float:
    """Largest value, between samples by the parabola through the three next to it."""
    k = int(np.argmax(values[1:-1])) + 1
    before, here, after = values[k - 1 : k + 2]
    return float(here - (after - before) ** 2 / (8.0 * (after - 2.0 * here + before)))


# Steady circles of the rolling disk: rates, and where they are stable.

_LEANS = np.linspace(8.0, 86.0, 157)  # degrees of the axis from the vertical
_RADII = ((0.6, BLUE), (1.0, GREEN), (2.0, RED))


@exhibit(
    title="Steady circles of the rolling disk",
    caption="For each lean and each circle of the contact there is one rate at which a disk of "
    "radius 0.5 m rolls on steadily. Dashed: the circle is unstable, a small push grows. The "
    "nearer to flat, the faster it must turn.",
    law="phi'^2 sin(theta) (A cos(theta) + B (R / r - cos(theta))) = m g r cos(theta)",
    source="Routh, Advanced Part, section 244; O'Reilly 1996",
    size=(7.2, 4.2),
)
def steady_circles(figure: Figure) -> tuple[Match, ...]:
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
    return (Match("largest error of the contact's circle in 5 s", max(errors), 0.0, 1e-7, "m"),)


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
