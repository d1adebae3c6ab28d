"""Figures of the gallery: a satellite with a rotor."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.systems.gyrostat import closed_forms as theory
from rigid_envs.systems.gyrostat.system import Gyrostat
from rigid_envs.watch.figures import (
    BLACK,
    BLUE,
    GREEN,
    INK,
    ORANGE,
    RED,
    Eye,
    Match,
    arrow,
    bare,
    curve,
    exhibit,
    solid,
    surface_grid,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# The dual-spin turn: where L can go in a satellite, and how a rotor leads it there.
#
# All at |L| = 1 N m s, with L in body axes, the share p of the rotor and the moments A of the
# carrier: its energy is E = (L1 - p)^2 / (2 A1) + L2^2 / (2 A2) + L3^2 / (2 A3).

THE_SATELLITE = Gyrostat(1.2, 2.0, 3.0, J1=0.2)
_EYE = Eye(38.0, 24.0)
_LEVELS = (0.02, 0.1, 0.25, 0.5, 0.8)  # of the energies from an extremum to the separatrix
_START = (0.05, 0.1)  # of L along e1 and e2 before the spin-ups


@exhibit(
    title="The dual-spin turn",
    caption="Where the angular momentum L can go in a satellite whose rotor, along e1, has a share "
    "of it: curves of equal energy of the carrier. The separatrix parts flat spin about e3 from "
    "spin about e1. It shrinks as the rotor is spun up, and dies. Dots and lower panel: a rotor is "
    "spun up in flat spin, and the satellite turns over until L lies along the rotor; the nutation "
    "that is left is small if the torque is weak, and large if it is strong.",
    law="|L| = constant,  (L1 - l)^2 / (2 A1) + L2^2 / (2 A2) + L3^2 / (2 A3) = constant;  "
    "no separatrix beyond l = |L| (1 - A1 / A3)",
    source="Hall 1995, doi:10.2514/3.56679; Volterra 1899, doi:10.1007/BF02417877",
    size=(7.2, 5.6),
)
def dual_spin(
    figure: Figure,
    *,
    satellite: Gyrostat = THE_SATELLITE,
    shares: tuple[float, float, float, float] = (0.0, 0.3, 0.58, 0.75),
    torques: tuple[float, float] = (0.001, 0.02),
) -> tuple[Match, ...]:
    """Simulate free motions on four spheres, steady rotations, and two spin-ups.

    Args:
        figure: empty.
        satellite: with one rotor, along e1, and I1 - J1 < I2 < I3.
        shares: momenta of the rotor on the spheres, over |L|.
        torques: of the motor in the spin-ups, at |L| = 1 N m s [N m].
    """
    colors = BLACK, ORANGE
    turns = [_spin_up(satellite, torque) for torque in torques]
    panels = figure.add_gridspec(2, 4, height_ratios=(1.0, 1.1))
    errors, drifts = [], []
    for k, share in enumerate(shares):
        axes = figure.add_subplot(panels[0, k])
        bare(axes)
        axes.set_title(f"l = {share:g} |L|", loc="center")
        errors.append(_portrait(axes, satellite, share))
        drifts.append(_drift(satellite, share))
        for (L, spun), color in zip(turns, colors, strict=True):
            page = _EYE.project(L[np.argmin(np.abs(spun - share))])
            axes.plot(*page, "o", color=color, ms=4.5, mec="white", mew=0.7, zorder=5)
    axes = figure.add_subplot(panels[1, :])
    _draw_steady(axes, satellite)
    for (L, spun), torque, color in zip(turns, torques, colors, strict=True):
        axes.plot(spun, L[:, 0], color=color, lw=1.1, label=f"spin-up by {torque:g} N m")
    axes.set_title("cosine of the angle between L and the rotor")
    axes.set_xlabel("momentum of the rotor, l / |L|")
    axes.set_xlim(0.0, 1.0), axes.set_ylim(-0.12, 1.08)
    figure.legend(ncols=4, columnspacing=1.2)
    sizes = [np.linalg.norm(L, axis=-1) for L, _ in turns]
    return (
        Match(
            "largest error of omega against Volterra's solution", max(errors), 0.0, 1e-9, "rad/s"
        ),
        Match("largest change of steady rotations in 10 s", max(drifts), 0.0, 1e-9, "rad/s"),
        Match(
            "largest change of |L| in the spin-ups, relative",
            float(np.max(np.abs(np.array(sizes) - 1.0))),
            0.0,
            1e-10,
        ),
    )


def _portrait(axes: Axes, satellite: Gyrostat, share: float) -> float:
    """Curves on the sphere for one share of the rotor; the largest error of simulated ones."""
    solid(axes, _EYE)
    surface_grid(axes, _EYE)
    steady = theory.steady_rotations(satellite.moments, satellite.wheel_moments, 1.0, share)
    places = [each.omega * satellite.carrier_moments + [share, 0.0, 0.0] for each in steady]
    energies = [_energy(satellite, share, place) for place in places]
    parting = [E for E, each in zip(energies, steady, strict=True) if each.growth > 0.0]
    errors = []
    for place, energy, each in zip(places, energies, steady, strict=True):
        if each.growth > 0.0:
            continue
        # without a separatrix the curves about one end are those about the other
        border = parting[0] if parting else max(energies)
        for level in _LEVELS if border != energy else ():
            first = _beginning(satellite, share, energy + level * (border - energy), place)
            color = GREEN if place[2] != 0.0 else BLUE
            errors.append(_free(axes, satellite, share, first, color))
    if parting:
        _separatrix(axes, satellite, share, parting[0])
    for k, end in enumerate(np.eye(3)):
        arrow(axes, _EYE, end, 1.25 * end, f"e{k + 1}", color=INK)
    axes.set_ylim(-1.1, 1.6)  # the title is above e3
    return max(errors)


def _energy(satellite: Gyrostat, share: float, L: Array) -> float:
    return 0.5 * float(np.sum((L - [share, 0.0, 0.0]) ** 2 / satellite.carrier_moments))


def _ends(satellite: Gyrostat, share: float, energy: float) -> Array:
    """Both L1 at which L2 = 0 on a curve of this energy; L1 is between them."""
    first, _, third = 1.0 / satellite.carrier_moments
    a, b, c = first - third, first * share, first * share**2 + third - 2.0 * energy
    root = math.sqrt(max(b * b - a * c, 0.0))
    return np.asarray(np.array([b - root, b + root]) / a)


def _beginning(satellite: Gyrostat, share: float, energy: float, centre: Array) -> Array:
    """L with L2 = 0 on the curve of this energy about a steady rotation."""
    ends = _ends(satellite, share, energy)
    L1 = float(ends[np.argmin(np.abs(ends - centre[0]))])
    return np.array([L1, 0.0, math.copysign(math.sqrt(1.0 - L1 * L1), centre[2])])


def _free(axes: Axes, satellite: Gyrostat, share: float, L: Array, color: str) -> float:
    """A free motion, once round; its largest error against Volterra's solution [rad/s]."""
    omega0 = (L - [share, 0.0, 0.0]) / satellite.carrier_moments
    rate = share / satellite.J1 - float(omega0[0])
    known = satellite.moments, satellite.wheel_moments, omega0, rate
    t = np.linspace(0.0, theory.volterra(*known).period, 181)
    start = satellite.state(omega_body=omega0, wheel_rates=[rate, 0.0, 0.0])
    motion = satellite.simulate(start, t)
    _on_sphere(axes, motion["L_body"], color, 1.1)
    return float(np.max(np.abs(motion["omega_body"] - theory.omega(t, *known))))


def _separatrix(axes: Axes, satellite: Gyrostat, share: float, energy: float) -> None:
    """L2 and L3 from L1, on the sphere and on the ellipsoid of the energy."""
    first, second, third = 1.0 / satellite.carrier_moments
    low, high = _ends(satellite, share, energy)
    L1 = 0.5 * (low + high - (high - low) * np.cos(np.linspace(0.0, np.pi, 181)))
    rest, left = 1.0 - L1**2, 2.0 * energy - first * (L1 - share) ** 2
    L2 = np.sqrt(np.maximum((left - third * rest) / (second - third), 0.0))
    L3 = np.sqrt(np.maximum(rest - L2**2, 0.0))
    for one in (1.0, -1.0):
        for other in (1.0, -1.0):
            _on_sphere(axes, np.stack([L1, one * L2, other * L3], axis=-1), RED, 1.7)


def _on_sphere(axes: Axes, L: Array, color: str, width: float) -> None:
    curve(axes, _EYE, L, _EYE.faces(L, np.eye(3)), color=color, lw=width, faint=0.13)


def _drift(satellite: Gyrostat, share: float) -> float:
    """Largest change of omega in 10 s, of all steady rotations for a share [rad/s]."""
    steady = theory.steady_rotations(satellite.moments, satellite.wheel_moments, 1.0, share)
    omega = np.array([each.omega for each in steady])
    wheel = np.zeros_like(omega)
    wheel[:, 0] = share / satellite.J1 - omega[:, 0]
    start = satellite.state(omega_body=omega, wheel_rates=wheel)
    motion = satellite.simulate(start, np.linspace(0.0, 10.0, 11))
    return float(np.max(np.abs(motion["omega_body"] - omega)))


def flat_spin(satellite: Gyrostat) -> Array:
    """State near spin about e3 with |L| = 1 N m s, the rotor at rest in space, shape (10,)."""
    L1, L2 = _START
    L = np.array([L1, L2, math.sqrt(1.0 - L1**2 - L2**2)])
    omega = L / satellite.carrier_moments
    return satellite.state(omega_body=omega, wheel_rates=[-omega[0], 0.0, 0.0])


def _spin_up(satellite: Gyrostat, torque: float) -> tuple[Array, Array]:
    """L and the momentum of the rotor in flat spin, as the motor brings the latter from 0 to 1."""
    t = np.linspace(0.0, 1.0 / torque, 1501)
    push = [torque, 0.0, 0.0, 0.0, 0.0, 0.0]
    motion = satellite.simulate(flat_spin(satellite), t, push)
    return motion["L_body"], motion["spin_momenta"][:, 0]


def _draw_steady(axes: Axes, satellite: Gyrostat) -> None:
    """L1 of steady rotations by the share of the rotor."""
    low, high = theory.separatrix_limits(satellite.moments, satellite.wheel_moments, 1.0)
    axes.plot([0.0, high, 1.0], [0.0, 1.0, 1.0], color=GREEN, label="steady rotations")
    axes.plot([0.0, low], [1.0, 1.0], color=GREEN)
    axes.plot([0.0, low, high], [0.0, 1.0, 1.0], color=RED, ls="--", label="unstable ones")
