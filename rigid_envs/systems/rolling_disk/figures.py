"""Figures of the gallery: rolling disks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.systems.rolling_disk import closed_forms as theory
from rigid_envs.systems.rolling_disk.system import EulerDisk, RollingDisk
from rigid_envs.watch.figures import BLACK, BLUE, GREEN, MUTED, RED, Match, exhibit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# The falling disk: it nods between two leans, and its contact draws a rosette.

THE_DISK = RollingDisk.uniform(m=1.0, radius=0.5)
_SAMPLES = 80  # of each period


def shape(wheel: RollingDisk) -> dict[str, float]:
    """Parameters of the closed forms."""
    names = {"m": wheel.m, "radius": wheel.radius, "i_perp": wheel.I1, "i3": wheel.I3}
    return names | {"g": wheel.g}


@exhibit(
    title="The falling disk",
    caption="A disk of radius 0.5 m, pushed while it rolls steadily round a circle: it nods "
    "between two leans and never falls flat (theta is 90 degrees upright, 0 flat); contact and "
    "centre draw rosettes on the plane.",
    law="J theta'^2 / 2 + V(theta) = E, V from two Legendre integrals of the spins",
    source="Appell 1900; Korteweg 1900; O'Reilly 1996; Routh, Advanced Part, section 244",
    size=(7.2, 4.4),
)
def disk(
    figure: Figure,
    *,
    wheel: RollingDisk = THE_DISK,
    tilt: float = math.radians(65.0),
    nutation: float = 1.3,
    circle: float = 1.5,
    periods: int = 9,
) -> tuple[Match, ...]:
    """Simulate a disk that is let go beside a steady circle; compare leans and period.

    Args:
        figure: empty.
        wheel: the disk.
        tilt: of its axis at first, upright at pi / 2 [rad].
        nutation: rate theta' with which it is pushed [rad/s].
        circle: radius of the steady circle of the contact [m].
        periods: of the nodding that are simulated, at least 4.
    """
    steady = theory.steady_circle(tilt, circle, **shape(wheel))
    nod = theory.fall(tilt, nutation, steady.precession, steady.omega3, **shape(wheel))
    t = np.linspace(0.0, periods * nod.period, _SAMPLES * periods + 1)
    rates = {"precession": steady.precession, "nutation": nutation, "spin": steady.omega3}
    motion = wheel.simulate(wheel.state(tilt=tilt, **rates), t)
    theta, contact, centre = motion["tilt"], motion["contact"], motion["centre"]
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    left.plot(*contact.T, color=BLUE, lw=1.4, label="point of contact")
    left.plot(*centre[:, :2].T, color=RED, lw=1.2, label="centre, from above")
    left.set_aspect("equal"), left.set_anchor("N")
    left.set_title("paths on the plane [m]")
    shown = 4 * _SAMPLES + 1
    right.plot(t[:shown], np.degrees(theta[:shown]), color=BLUE, label="simulated")
    for angle in (nod.theta_min, nod.theta_max):
        right.axhline(math.degrees(angle), color=MUTED, ls=":", lw=1.0)
    middle = np.degrees(theta[0])
    times = nod.period * np.arange(5)
    right.plot(times, [middle] * 5, "o", color=BLACK, ms=5, label="after whole periods")
    right.plot([], [], color=MUTED, ls=":", label="turning points, closed form")
    right.set_title("angle theta of the axis [degrees]"), right.set_xlabel("time [s]")
    right.set_xlim(0.0, times[-1])
    figure.legend(ncols=3, columnspacing=1.2)
    returned = float(np.max(np.abs(theta[::_SAMPLES] - theta[0])))
    return (
        Match("smallest theta", -_peak(-theta), nod.theta_min, 1e-8, "rad"),
        Match("largest theta", _peak(theta), nod.theta_max, 1e-8, "rad"),
        Match(f"theta after 1 .. {periods} periods, from its start", returned, 0.0, 1e-8, "rad"),
    )


def _peak(values: Array) -> float:
    """Largest value, between samples by the parabola through the three next to it."""
    k = int(np.argmax(values[1:-1])) + 1
    before, here, after = values[k - 1 : k + 2]
    return float(here - (after - before) ** 2 / (8.0 * (after - 2.0 * here + before)))


# Steady circles of the rolling disk: rates, and where they are stable.

_LEANS = np.linspace(8.0, 86.0, 157)  # degrees of the axis from the vertical
_COLORS = (BLUE, GREEN, RED)


@exhibit(
    title="Steady circles of the rolling disk",
    caption="For each lean and each circle of the contact there is one rate at which a disk of "
    "radius 0.5 m rolls on steadily. Dashed: the circle is unstable, a small push grows. The "
    "nearer to flat, the faster it must turn.",
    law="phi'^2 sin(theta) (A cos(theta) + B (R / r - cos(theta))) = m g r cos(theta)",
    source="Routh, Advanced Part, section 244; O'Reilly 1996",
    size=(7.2, 4.2),
)
def steady_circles(
    figure: Figure,
    *,
    wheel: RollingDisk = THE_DISK,
    radii: tuple[float, float, float] = (0.6, 1.0, 2.0),
) -> tuple[Match, ...]:
    """Rates of steady circles in closed form; simulate some of them for 5 s.

    Args:
        figure: empty.
        wheel: the disk.
        radii: of the circles of the contact [m].
    """
    left, right = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    for size, color in zip(radii, _COLORS, strict=True):
        _draw_rates(left, wheel, size, color)
    t = np.linspace(0.0, 5.0, 151)
    cases = [(size, lean) for size in radii for lean in (30.0, 50.0, 70.0)]
    exact = [theory.steady_circle(math.radians(x), size, **shape(wheel)) for size, x in cases]
    starts = wheel.state(
        tilt=[math.radians(lean) for _, lean in cases],
        precession=[circle.precession for circle in exact],
        spin=[circle.omega3 for circle in exact],
    )
    contact = wheel.simulate(starts, t)["contact"]
    errors = []
    for k, (_, lean) in enumerate(cases):
        along = wheel.velocity(starts[k])[:2]
        around, error = _compare(t, contact[:, k], along, exact[k])
        turned = np.unwrap(np.arctan2(around[:, 1], around[:, 0]))
        left.plot(lean, (turned[-1] - turned[0]) / 5.0, "o", color=BLACK, ms=4.5, zorder=4)
        errors.append(error)
        if lean == 50.0:
            right.plot(*around.T, color=_COLORS[k // 3], lw=1.5)
            right.plot(*around[0], "o", color=_COLORS[k // 3], ms=5)
    left.plot([], [], "o", color=BLACK, ms=4.5, label="simulated")
    left.plot([], [], color=MUTED, ls="--", lw=1.3, label="unstable")
    left.set_xlim(0.0, 90.0), left.set_ylim(0.0, 9.0)
    left.set_xlabel("theta [degrees], 90 upright"), left.set_title("precession rate phi' [rad/s]")
    right.set_aspect("equal"), right.set_anchor("N")
    right.set_title("contact at 50 degrees, 5 s [m]")
    figure.legend(ncols=3, columnspacing=1.2)
    return (Match("largest error of the contact's circle in 5 s", max(errors), 0.0, 1e-7, "m"),)


def _draw_rates(axes: Axes, wheel: RollingDisk, size: float, color: str) -> None:
    leans = np.radians(_LEANS).tolist()
    found = [theory.steady_circle(lean, size, **shape(wheel)) for lean in leans]
    rate = np.array([circle.precession for circle in found])
    stable = np.array([circle.frequency_squared > 0.0 for circle in found])
    text = f"circle of {size:g} m"
    axes.plot(_LEANS, np.where(stable, rate, np.nan), color=color, label=text)
    axes.plot(_LEANS, np.where(~stable, rate, np.nan), color=color, ls="--", lw=1.3)


def _compare(
    t: Array, contact: Array, along: Array, exact: theory.SteadyCircle
) -> tuple[Array, float]:
    """Contact from the centre of its circle, and its largest departure from uniform motion."""
    inwards = np.array([-along[1], along[0]]) / np.hypot(*along)  # it turns to the left
    around = contact - (contact[0] + exact.contact_radius * inwards)
    uniform = exact.contact_radius * np.exp(1j * exact.precession * t) * complex(*-inwards)
    closed = np.stack([uniform.real, uniform.imag], axis=-1)
    return around, float(np.max(np.abs(around - closed)))


# Euler's disk: a coin that spins to rest, against the slow settling of its still centre.


@exhibit(
    title="Euler's disk: a coin spins to rest",
    caption="A disk of radius 37.5 mm and 0.4 kg spins on a table: the flatter it lies, the faster "
    "its contact runs round, until both end at once. As powers of the time left, the angle falls "
    "with 2/3 and the frequency grows with -1/3 under dry friction along the rim, with 1/3 and "
    "-1/6 under a drag like that of Moffatt's film of air, here of a viscosity of 0.3 mPa s. "
    "Simulated disks nod about the closed forms.",
    law="sin(theta)^n falls linearly, n = 3/2 (dry friction), 3 (film of air); "
    "phi'^2 = 4 g / (r sin(theta))",
    source="Moffatt 2000, doi:10.1038/35009017; Leine 2009, doi:10.1007/s00419-008-0278-6",
    size=(7.2, 4.0),
)
def euler_disk(
    figure: Figure,
    *,
    contour: float = 2e-5,
    viscosity: float = 3e-4,
    radius: float = 0.0375,
    starts: tuple[float, float] = (0.03, 0.06),
) -> tuple[Match, ...]:
    """Simulate a disk with dry friction and one with drag, from still centres; fit exponents.

    Args:
        figure: empty.
        contour: torque of dry friction of the first [N m].
        viscosity: of the air below the second [Pa s].
        radius: of both [m].
        starts: angles from the floor at first, of each [rad].
    """
    dry = EulerDisk.uniform(0.4, radius, contour=contour)
    air = EulerDisk.uniform(0.4, radius, drag=theory.air_drag(viscosity, radius=radius, g=dry.g))
    left, right = figure.subplots(1, 2)
    numbers = []
    cases = ("dry friction", dry, contour, 1.0, BLUE), ("drag", air, air.drag, 4.0, RED)
    for (name, coin, loss, power, color), start in zip(cases, starts, strict=True):
        t, angle, frequency, slow = _spun(coin, start, loss, power)
        rest, exponents = _end(t, angle, frequency, slow)
        left.plot(rest - t, np.degrees(angle), color=color, label=name)
        left.plot(slow.duration - t, np.degrees(slow.theta), color=BLACK, ls=":", lw=1.2)
        right.plot(rest - t, frequency, color=color)
        right.plot(slow.duration - t, slow.precession / (2.0 * np.pi), color=BLACK, ls=":", lw=1.2)
        expected = slow.theta_exponent, slow.precession_exponent
        for what, value, slope in zip(("angle", "frequency"), exponents, expected, strict=True):
            numbers.append(Match(f"exponent of the {what}, {name}", value, slope, 0.01))
    left.plot([], [], color=BLACK, ls=":", lw=1.2, label="closed form")
    left.set_title("angle from the floor [degrees]"), right.set_title("frequency phi' / 2 pi [Hz]")
    for axes in (left, right):
        axes.set_xlabel("time left [s]")
        axes.set_xscale("log", base=2), axes.set_yscale("log", base=2), axes.invert_xaxis()
        axes.xaxis.set_major_formatter("{x:g}"), axes.yaxis.set_major_formatter("{x:g}")
    figure.legend(ncols=3, columnspacing=1.2)
    return tuple(numbers)


def _spun(
    coin: EulerDisk, start: float, loss: float, power: float
) -> tuple[Array, Array, Array, theory.Settling]:
    """Times, angle and frequency of a disk from a still centre, and its closed form."""
    body = {key: value for key, value in shape(coin).items() if key != "i3"}
    end = theory.settle(0.0, start, loss, power, **body).duration
    t = end * (1.0 - np.append(1.0, np.geomspace(1.0, 0.05, 150)[1:]))
    slow = theory.settle(t, start, loss, power, **body)
    motion = coin.simulate(coin.state(tilt=start, precession=float(slow.precession[0])), t)
    turning = np.sum(motion["omega_world"] * coin.radius_up(motion.y), axis=-1)
    frequency = turning / np.sin(motion["tilt"]) / (2.0 * np.pi)
    return t, motion["tilt"], frequency, slow


def _end(
    t: Array, angle: Array, frequency: Array, slow: theory.Settling
) -> tuple[float, tuple[float, float]]:
    """Time at which powers of the time left fit best to angle and frequency, and the powers."""
    from scipy.optimize import least_squares  # slow to import

    logs = np.log(angle), np.log(frequency)

    def misfit(x: Array) -> Array:
        left = np.log(x[0] - t)
        return np.concatenate([x[k] + x[k + 1] * left - logs[k // 2] for k in (1, 3)])

    guess = 1.02 * slow.duration, logs[0][0], slow.theta_exponent
    found = least_squares(misfit, (*guess, logs[1][0], slow.precession_exponent)).x.tolist()
    return found[0], (found[2], found[4])
