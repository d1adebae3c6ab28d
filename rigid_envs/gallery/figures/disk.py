"""The falling disk: it nods between two leans, and its contact draws a rosette."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.analytic import rolling_disk as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.style import BLACK, BLUE, MUTED, RED
from rigid_envs.systems import RollingDisk

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DISK", "SHAPE", "THE_DISK", "rolling"]

Array = npt.NDArray[np.float64]
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


def draw(figure: Figure) -> tuple[Number, ...]:
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
        Number("smallest theta", -_peak(-tilt), nod.theta_min, 1e-8, "rad"),
        Number("largest theta", _peak(tilt), nod.theta_max, 1e-8, "rad"),
        Number(f"theta after 1 .. {periods} periods, from its start", returned, 0.0, 1e-8, "rad"),
    )


def _peak(values: Array) -> float:
    """Largest value, between samples by the parabola through the three next to it."""
    k = int(np.argmax(values[1:-1])) + 1
    before, here, after = values[k - 1 : k + 2]
    return float(here - (after - before) ** 2 / (8.0 * (after - 2.0 * here + before)))


DISK = Entry(
    name="disk",
    title="The falling disk",
    caption="A disk of radius 0.5 m, pushed while it rolls steadily round a circle: it nods "
    "between two leans and never falls flat (theta is 90 degrees upright, 0 flat); contact and "
    "centre draw rosettes on the plane.",
    law="J theta'^2 / 2 + V(theta) = E, V from two Legendre integrals of the spins",
    source="Appell 1900; Korteweg 1900; O'Reilly 1996; Routh, Advanced Part, section 244",
    draw=draw,
    size=(7.2, 4.4),
)
