"""The falling disk: turning points and period of its lean.

The lean is taken as u = log tan(theta / 2), in which the potential is smooth on a strip of constant
width, however flat the disk lies. Differences of potential are integrals of its slope: near a
steady motion, where the difference itself is a matter of rounding, the slope keeps its digits.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev, chebyshev
from scipy.special import roots_legendre

from rigid_envs.analytic.rolling_disk._disk import Disk, disk_of
from rigid_envs.analytic.rolling_disk._integrals import legendre_constants, potential, solution
from rigid_envs.analytic.rolling_disk._steady_disk import lean_frequency_squared
from rigid_envs.checks import Array, number, positive

__all__ = ["Fall", "fall"]

Slope = Callable[[Array], Array]

# Distances in u at which the search for a turning point looks: each panel is short beside its
# distance from the start and beside pi / 2, the width of the strip. u = 36 is a lean of 5e-16, and
# 72 the way to it from the other face.
_DISTANCES = np.concatenate([[0.0], np.geomspace(1e-14, 1.0, 150), np.arange(1.2, 72.1, 0.2)])
_NODES, _WEIGHTS = roots_legendre(12)

# Half the swing in u below which it is harmonic to 1e-10, which the roundings of the slope are not.
_HARMONIC = 1e-5


@dataclass(frozen=True)
class Fall:
    """The nodding of a disk that rolls without slip.

    Attributes:
        c1: first Legendre integral, see `legendre_constants` [rad/s].
        c2: second Legendre integral [rad/s].
        energy: kinetic and potential, that of the centre on the ground being 0 [J].
        theta_min: smallest angle of the axis from the vertical [rad]; 0 where the disk falls flat.
        theta_max: largest such angle [rad]; pi where it falls flat on its other face.
        period: time from one smallest angle to the next [s]; infinite where there is none.
    """

    c1: float
    c2: float
    energy: float
    theta_min: float
    theta_max: float
    period: float


def fall(
    theta: float,
    theta_rate: float,
    phi_rate: float,
    omega3: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
    g: float,
) -> Fall:
    """Find integrals, turning points and period of the lean of a disk from any initial state.

    theta'^2 = 2 (E - V(theta)) / J with the effective potential V; period = 2 int dtheta / theta'.
    All are good to rounding, but for the period of a disk that starts within d of an unstable
    steady motion: the time that it lingers there is known to eps / d only. The period of one that
    turns back within 1e-9 of both faces is good to 1e-6.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi [rad].
        theta_rate: theta' [rad/s].
        phi_rate: phi' [rad/s].
        omega3: axial angular velocity psi' + phi' cos(theta) [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range, or a number that is not finite.

    Source: O'Reilly (1996); Borisov, Mamaev & Kilin (2003), Reg. Chaotic Dyn. 8:201,
        doi:10.1070/RD2003v008n02ABEH000237.
    """
    positive(g, "g")
    body = {"m": m, "radius": radius, "i_perp": i_perp, "i3": i3}
    c1, c2 = legendre_constants(theta, phi_rate, omega3, **body)
    disk = disk_of(**body)
    kinetic = 0.5 * disk.tipping * number(theta_rate, "theta_rate") ** 2
    start, slope = math.log(math.tan(0.5 * theta)), _slope(c1, c2, disk, g)
    low, high = (_turning_point(start, way, kinetic, slope) for way in (-1.0, 1.0))
    if 0.5 * (high - low) > _HARMONIC:
        period = _period(low, high, slope, disk.tipping)
    else:
        square = lean_frequency_squared(theta, phi_rate, omega3, g=g, **body)
        period = 2.0 * math.pi / math.sqrt(square) if square > 0.0 else math.inf
    resting = potential(theta, phi_rate * math.sin(theta), omega3, disk, g)
    energy = float(disk.joules(kinetic + float(resting)))
    return Fall(c1, c2, energy, _lean(low), _lean(high), period)


def _slope(c1: float, c2: float, disk: Disk, g: float) -> Slope:
    """Derivative of the potential by u, (B p omega3 - A p^2 cot + m g radius cos) sin.

    As a multiple of m radius^2 [1/s^2].
    """

    def slope(u: Array) -> Array:
        sine, cosine = 1.0 / np.cosh(u), -np.tanh(u)
        p, omega3 = solution(2.0 * np.arctan(np.exp(u)), c1, c2, disk)
        turning = disk.axial * p * omega3 * sine - disk.i_perp * p * p * cosine
        return np.asarray(turning + g / disk.radius * cosine * sine)

    return slope


def _turning_point(start: float, way: float, kinetic: float, slope: Slope) -> float:
    """First turning point u from the start in one direction."""
    edges = start + way * _DISTANCES
    left = kinetic - np.cumsum(_rise(edges[:-1], edges[1:], slope))
    spent = np.flatnonzero(left < 0.0)
    if spent.size == 0:
        return way * math.inf
    k = int(spent[0])
    before, first = kinetic if k == 0 else left[k - 1], edges[k]

    from scipy.optimize import brentq  # slow to import, as is `quad` below

    def rest(u: float) -> float:
        return float(before - _rise(np.array([first]), np.array([u]), slope)[0])

    return float(brentq(rest, first, edges[k + 1], xtol=1e-16, rtol=4.0 * np.finfo(float).eps))


def _rise(first: Array, last: Array, slope: Slope) -> Array:
    """Differences of potential over panels, by Gauss's rule, of the shape of first and last."""
    half = 0.5 * (last - first)[:, np.newaxis]
    return np.asarray(
        np.sum(_WEIGHTS * half * slope(first[:, np.newaxis] + half * (1.0 + _NODES)), -1)
    )


def _period(low: float, high: float, slope: Slope, tipping: float) -> float:
    """Time for a whole nod, 2 int dtheta / theta' [s].

    With u = middle + half x and x = cos(chi) the kinetic energy is 2 (1 - x^2) S(x), and what is
    left under the integral over chi is smooth.
    """
    if math.isinf(high - low):
        return math.inf
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    depth = _depth(low, high, slope)
    # Beside an unstable motion S falls below the rounding of its terms.
    floor = np.finfo(np.float64).eps * float(np.sum(np.abs(depth)))

    from scipy.integrate import quad

    def integrand(chi: float) -> float:
        x = math.cos(chi)
        rest = max(float(chebyshev.chebval(x, depth)), floor)
        return 1.0 / (math.cosh(middle + half * x) * math.sqrt(rest))

    # With full_output it does not warn that there, as documented, not all digits can be had.
    total = quad(integrand, 0.0, math.pi, epsabs=0.0, epsrel=1e-13, limit=200, full_output=1)[0]
    return float(half * math.sqrt(tipping) * total)


def _depth(low: float, high: float, slope: Slope) -> Array:
    """Chebyshev series of S = (E - V) / (2 (1 - x^2)) between two turning points.

    That of V = sum c_k T_k comes from its slope. T_k - T_(k-2) = 2 (x^2 - 1) U_(k-2) takes out what
    vanishes at the ends, and leaves S = sum b_k U_(k-2) with b_k = c_k + c_(k+2) + ...
    """
    order = 64 + 32 * math.ceil(high - low)
    series = np.asarray(Chebyshev.interpolate(slope, order, (low, high)).integ().coef, np.float64)
    sums = series.copy()
    for k in range(series.size - 3, 1, -1):
        sums[k] += sums[k + 2]
    # U_(k-2) is the derivative of T_(k-1) / (k - 1).
    return np.asarray(chebyshev.chebder(np.append(0.0, sums[2:] / np.arange(1, series.size - 1))))


def _lean(u: float) -> float:
    """Angle of the axis from the vertical [rad]."""
    return 2.0 * math.atan(math.exp(u)) if u < 700.0 else math.pi
