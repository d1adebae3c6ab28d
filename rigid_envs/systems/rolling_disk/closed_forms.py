"""Rolling disk: steady motions, their stability, falling, integrals; Euler's disk settling."""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev, chebyshev
from numpy.typing import ArrayLike
from scipy.special import roots_legendre

from rigid_envs.base import checks
from rigid_envs.base.checks import Array
from rigid_envs.mechanics import special

# The mass properties of a disk, checked, in units of its own.


@dataclass(frozen=True)
class _Disk:
    """A disk with a thin rim, its moments as multiples of m radius^2.

    So the motion has the same digits in all units of mass and length, also where m radius^2 or a
    product of moments is beyond the range of double precision.

    Attributes:
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A / (m radius^2), A the moment about a diameter.
        i3: C / (m radius^2), C the axial moment.
    """

    m: float
    radius: float
    i_perp: float
    i3: float

    @property
    def axial(self) -> float:
        """B / (m radius^2), B = C + m radius^2 about the parallel to the axis at the contact."""
        return self.i3 + 1.0

    @property
    def tipping(self) -> float:
        """J / (m radius^2), J = A + m radius^2 about the tangent of the rim at the contact."""
        return self.i_perp + 1.0

    def joules(self, energy: float | Array) -> Array:
        """An energy that is given as a multiple of m radius^2 [1/s^2]."""
        return np.asarray(energy * self.radius * self.m * self.radius)


def _disk_of(*, m: float, radius: float, i_perp: float, i3: float) -> _Disk:
    """The disk with these mass properties.

    Args:
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].

    Raises:
        ValueError: one of them is not positive, or a moment is far from m radius^2.
    """
    checks.all_positive(m=m, radius=radius, i_perp=i_perp, i3=i3)
    moments = {"i_perp": i_perp, "i3": i3}
    ratios = {name: moment / m / radius / radius for name, moment in moments.items()}
    for name, ratio in ratios.items():
        near = 1e-100 < ratio < 1e100
        checks.require(near, moments[name], name, "1e-100 to 1e100 times m radius^2")
    return _Disk(m, radius, **ratios)


# Steady circles of a rolling disk: theta, phi' and omega3 constant.


@dataclass(frozen=True)
class SteadyCircle:
    """A disk that rolls round a circle at constant lean.

    Attributes:
        precession: phi' [rad/s].
        omega3: axial angular velocity psi' + phi' cos(theta) [rad/s].
        spin: psi' [rad/s].
        contact_radius: of the circle of the contact, -radius psi' / phi' [m]; negative where the
            contact lies on the other side of the circle's centre.
        centre_radius: of the circle of the disk's centre, contact_radius - radius cos(theta) [m].
        frequency_squared: of small oscillations of the lean [1/s^2]; unstable where negative.
    """

    precession: float
    omega3: float
    spin: float
    contact_radius: float
    centre_radius: float
    frequency_squared: float


def steady_circle(
    theta: float,
    contact_radius: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
    g: float,
) -> SteadyCircle:
    """Find the steady motion with a given lean on a given circle, with phi' > 0.

    Rolling is psi' = -phi' contact_radius / radius, and with B = C + m radius^2

        phi'^2 sin(theta) (A cos(theta) + B (contact_radius / radius - cos(theta)))
            = m g radius cos(theta).

    The mirror image, all rates negative, is the other one.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi [rad].
        contact_radius: of the circle that the contact runs on [m].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range, or no rate balances the lean on this circle.

    Source: O'Reilly (1996); Routh, Advanced Part, par. 244.
    """
    disk = _checked(theta, m, radius, i_perp, i3, g)
    sine, cosine = math.sin(theta), math.cos(theta)
    apart = checks.number(contact_radius, "contact_radius") / radius - cosine
    grip = disk.i_perp * cosine + disk.axial * apart
    expected = (
        f"one further outside at theta = {theta}: there the disk's inertia turns it down as its "
        "weight does"
    )
    checks.require(cosine * grip > 0.0, contact_radius, "contact_radius", expected)
    precession = math.sqrt(g / radius * cosine / (sine * grip))
    return _circle(theta, precession, -precession * apart, disk, g)


def steady_precession(
    theta: float, omega3: float, *, m: float, radius: float, i_perp: float, i3: float, g: float
) -> tuple[SteadyCircle, SteadyCircle]:
    """Find both steady motions with a given lean and axial angular velocity.

    The roots of A sin(theta) cos(theta) phi'^2 - B omega3 sin(theta) phi' = m g radius cos(theta),
    of opposite signs: the slow one, near -m g radius cot(theta) / (B omega3) for fast rolling, and
    the fast one, near B omega3 / (A cos(theta)).

    Args:
        theta: angle of the axis from the vertical, above 0, below pi, not upright [rad].
        omega3: axial angular velocity [rad/s]; at 0 the centre stands still, turning either way.
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Returns:
        The slow motion and the fast one.

    Raises:
        ValueError: a parameter outside its range.

    Source: O'Reilly (1996); Routh, Advanced Part, par. 244.
    """
    disk = _checked(theta, m, radius, i_perp, i3, g)
    sine, cosine = math.sin(theta), math.cos(theta)
    weight, square = g / radius * cosine, disk.i_perp * sine * cosine
    push = disk.axial * checks.number(omega3, "omega3") * sine
    # Both roots from the one sum that does not cancel.
    total = push + math.copysign(math.sqrt(push * push + 4.0 * square * weight), push)
    rates = -2.0 * weight / total, total / (2.0 * square)
    slow, fast = (_circle(theta, rate, omega3, disk, g) for rate in rates)
    return slow, fast


def stationary_centre_precession(
    theta: float, *, m: float, radius: float, i_perp: float, g: float
) -> float:
    """Precession rate phi' of a disk whose centre is at rest [rad/s].

    A phi'^2 sin(theta) = m g radius with omega3 = 0: 4 g / (radius sin(theta)) for a disk, Euler's
    disk, which quickens as it settles. The contact runs round a circle of radius
    radius cos(theta), and the face turns only with phi' (1 - cos(theta)).

    Args:
        theta: angle of the axis from the vertical, which is that of the disk from the floor [rad].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range.

    Source: Moffatt (2000), Nature 404:833, doi:10.1038/35009017.
    """
    checks.all_positive(m=m, radius=radius, i_perp=i_perp, g=g)
    checks.between(checks.number(theta, "theta"), "theta", 0.0, math.pi)
    return math.sqrt(m * g * radius / (i_perp * math.sin(theta)))


def lean_frequency_squared(
    theta: float,
    precession: float,
    omega3: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
    g: float,
) -> float:
    """Square of the frequency of small oscillations of the lean about a steady motion [1/s^2].

    J frequency^2 = B C / A omega3^2 - (B + 2 C) p omega3 cot(theta)
        + (m radius^2 + A + 3 A cot^2(theta)) p^2 - m g radius sin(theta),  p = phi' sin(theta).

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi [rad].
        precession: phi' [rad/s].
        omega3: axial angular velocity [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range.

    Source: O'Reilly (1996).
    """
    disk = _checked(theta, m, radius, i_perp, i3, g)
    rate, axial = checks.number(precession, "precession"), checks.number(omega3, "omega3")
    return _frequency_squared(theta, rate, axial, disk, g)


def _checked(theta: float, m: float, radius: float, i_perp: float, i3: float, g: float) -> _Disk:
    """The disk, after lean and gravity are checked, too."""
    checks.positive(g, "g")
    checks.between(checks.number(theta, "theta"), "theta", 0.0, math.pi)
    return _disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)


def _circle(theta: float, precession: float, omega3: float, disk: _Disk, g: float) -> SteadyCircle:
    """All numbers of the steady motion with these three."""
    spin = omega3 - precession * math.cos(theta)
    return SteadyCircle(
        precession=precession,
        omega3=omega3,
        spin=spin,
        contact_radius=-disk.radius * spin / precession,
        centre_radius=-disk.radius * omega3 / precession,
        frequency_squared=_frequency_squared(theta, precession, omega3, disk, g),
    )


def _frequency_squared(
    theta: float, precession: float, omega3: float, disk: _Disk, g: float
) -> float:
    """The curvature of the effective potential over J, at given rates."""
    sine, cotangent = math.sin(theta), math.cos(theta) / math.sin(theta)
    p = precession * sine
    turning = (
        disk.axial * disk.i3 / disk.i_perp * omega3 * omega3
        - (disk.axial + 2.0 * disk.i3) * p * omega3 * cotangent
        + (disk.tipping + 3.0 * disk.i_perp * cotangent * cotangent) * p * p
    )
    return (turning - g / disk.radius * sine) / disk.tipping


# The two linear integrals of the falling disk, and the potential that they leave to the lean.


def legendre_constants(
    theta: float,
    phi_rate: float,
    omega3: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
) -> tuple[float, float]:
    """Integrals c1 and c2 of the rolling disk: its spins depend on the lean alone.

    omega3 = c1 F(x) + c2 F(1 - x) with x = (1 - cos(theta)) / 2 and F = F(xi, 1 - xi; 1; x), the
    solution of Legendre's equation that is 1 at x = 0 and infinite at x = 1, with
    xi (1 - xi) = m radius^2 C / (A B); p = phi' sin(theta) follows as B / (m radius^2) times the
    derivative of omega3 by theta. Without c2 the disk can fall flat.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi [rad].
        phi_rate: phi' [rad/s].
        omega3: axial angular velocity [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].

    Returns:
        c1 and c2 [rad/s].

    Raises:
        ValueError: a parameter outside its range.

    Source: Appell (1900); Korteweg (1900); Borisov, Mamaev & Kilin (2003), Reg. Chaotic Dyn. 8:201,
        doi:10.1070/RD2003v008n02ABEH000237.
    """
    disk = _disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)
    checks.between(checks.number(theta, "theta"), "theta", 0.0, math.pi)
    spin = checks.number(phi_rate, "phi_rate") * math.sin(theta)
    axial, across = _basis(np.asarray(theta), disk)
    c1, c2 = np.linalg.solve(np.stack([axial, across]), [checks.number(omega3, "omega3"), spin])
    return float(c1), float(c2)


def spins(
    theta: ArrayLike, c1: float, c2: float, *, m: float, radius: float, i_perp: float, i3: float
) -> tuple[Array, Array]:
    """Precession and axial spin at any lean, from the two integrals of the motion.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi, any shape [rad].
        c1: first of `legendre_constants` [rad/s].
        c2: second of `legendre_constants` [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].

    Returns:
        phi' and omega3, of the shape of theta [rad/s].

    Raises:
        ValueError: a parameter outside its range.

    Source: as `legendre_constants`.
    """
    checks.all_finite(c1=c1, c2=c2)
    angle = checks.between(theta, "theta", 0.0, math.pi)
    p, axial = _solution(angle, c1, c2, _disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3))
    return p / np.sin(angle), axial


def effective_potential(
    theta: ArrayLike,
    c1: float,
    c2: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
    g: float,
) -> Array:
    """Potential in which the lean moves, J theta'^2 / 2 + V(theta) = E.

    V = (A p^2 + B omega3^2) / 2 + m g radius sin(theta), p and omega3 from `spins`.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi, any shape [rad].
        c1: first of `legendre_constants` [rad/s].
        c2: second of `legendre_constants` [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Returns:
        V, of the shape of theta [J].

    Raises:
        ValueError: a parameter outside its range.

    Source: O'Reilly (1996).
    """
    checks.positive(g, "g")
    checks.all_finite(c1=c1, c2=c2)
    angle = checks.between(theta, "theta", 0.0, math.pi)
    disk = _disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)
    return disk.joules(_potential(angle, *_solution(angle, c1, c2, disk), disk, g))


def _potential(theta: ArrayLike, p: ArrayLike, omega3: ArrayLike, disk: _Disk, g: float) -> Array:
    """(A p^2 + B omega3^2) / 2 + m g radius sin(theta), as a multiple of m radius^2 [1/s^2]."""
    spinning = disk.i_perp * np.square(p) + disk.axial * np.square(omega3)
    return np.asarray(0.5 * spinning + g / disk.radius * np.sin(theta))


def _solution(theta: Array, c1: float, c2: float, disk: _Disk) -> tuple[Array, Array]:
    """The spins p = phi' sin(theta) and omega3 at any lean [rad/s]."""
    axial, across = _basis(theta, disk)
    return c1 * across[..., 0] + c2 * across[..., 1], c1 * axial[..., 0] + c2 * axial[..., 1]


def _basis(theta: Array, disk: _Disk) -> tuple[Array, Array]:
    """omega3 and p of the two solutions (1, 0) and (0, 1), each of shape (..., 2)."""
    low, high = np.sin(0.5 * theta) ** 2, np.cos(0.5 * theta) ** 2
    mu = disk.i3 / (disk.i_perp * disk.axial)
    first, first_slope = special.conical(low, high, mu)
    second, second_slope = special.conical(high, low, mu)
    lever = 0.5 * disk.axial * np.sin(theta)
    across = np.stack([lever * first_slope, -lever * second_slope], axis=-1)
    return np.stack([first, second], axis=-1), across


# The falling disk: turning points and period of its lean.
#
# The lean is taken as u = log tan(theta / 2), in which the potential is smooth on a strip of
# constant width, however flat the disk lies. Differences of potential are integrals of its slope:
# near a steady motion, where the difference itself is a matter of rounding, the slope keeps its
# digits.

_Slope = Callable[[Array], Array]

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
    All are good to rounding, but for the period of a disk that lingers near an unstable steady
    motion: it is known to eps / d if the disk starts within d of it, and to eps / n^2 if it passes
    it at the rate n sqrt(g / radius). The period of one that turns back within 1e-9 of both faces
    is good to 1e-6, and that of the smallest nods to 1e-10.

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
    checks.positive(g, "g")
    body = {"m": m, "radius": radius, "i_perp": i_perp, "i3": i3}
    c1, c2 = legendre_constants(theta, phi_rate, omega3, **body)
    disk = _disk_of(**body)
    kinetic = 0.5 * disk.tipping * checks.number(theta_rate, "theta_rate") ** 2
    start, slope = math.log(math.tan(0.5 * theta)), _slope(c1, c2, disk, g)
    low, high = (_turning_point(start, way, kinetic, slope) for way in (-1.0, 1.0))
    if 0.5 * (high - low) > _HARMONIC:
        period = _period(low, high, slope, disk.tipping)
    else:
        square = lean_frequency_squared(theta, phi_rate, omega3, g=g, **body)
        period = 2.0 * math.pi / math.sqrt(square) if square > 0.0 else math.inf
    resting = _potential(theta, phi_rate * math.sin(theta), omega3, disk, g)
    energy = float(disk.joules(kinetic + float(resting)))
    return Fall(c1, c2, energy, _lean(low), _lean(high), period)


def _slope(c1: float, c2: float, disk: _Disk, g: float) -> _Slope:
    """Derivative of the potential by u, (B p omega3 - A p^2 cot + m g radius cos) sin.

    As a multiple of m radius^2 [1/s^2].
    """

    def slope(u: Array) -> Array:
        sine, cosine = 1.0 / np.cosh(u), -np.tanh(u)
        p, omega3 = _solution(2.0 * np.arctan(np.exp(u)), c1, c2, disk)
        turning = disk.axial * p * omega3 * sine - disk.i_perp * p * p * cosine
        return np.asarray(turning + g / disk.radius * cosine * sine)

    return slope


def _turning_point(start: float, way: float, kinetic: float, slope: _Slope) -> float:
    """First turning point u from the start in one direction."""
    from scipy.optimize import brentq  # slow to import, as is `quad` below

    edges = start + way * _DISTANCES
    climb = way * slope(edges)
    peaks = np.flatnonzero((climb[:-1] > 0.0) & (climb[1:] < 0.0))  # they may be all that is high
    tops = [brentq(slope, edges[k], edges[k + 1]) for k in peaks]
    edges = way * np.sort(way * np.append(edges, tops))
    left = kinetic - np.cumsum(_rise(edges[:-1], edges[1:], slope))
    spent = np.flatnonzero(left < 0.0)
    if spent.size == 0:
        return way * math.inf
    k = int(spent[0])
    before, first = kinetic if k == 0 else left[k - 1], edges[k]

    def rest(u: float) -> float:
        return float(before - _rise(np.array([first]), np.array([u]), slope)[0])

    return float(brentq(rest, first, edges[k + 1], xtol=1e-16, rtol=4.0 * np.finfo(float).eps))


def _rise(first: Array, last: Array, slope: _Slope) -> Array:
    """Differences of potential over panels, by Gauss's rule, of the shape of first and last."""
    half = 0.5 * (last - first)[:, np.newaxis]
    return np.asarray(
        np.sum(_WEIGHTS * half * slope(first[:, np.newaxis] + half * (1.0 + _NODES)), -1)
    )


def _period(low: float, high: float, slope: _Slope, tipping: float) -> float:
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


def _depth(low: float, high: float, slope: _Slope) -> Array:
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


# Stability thresholds of an upright rolling disk and of a spinning coin.


def rolling_threshold(*, m: float, radius: float, i_perp: float, i3: float, g: float) -> float:
    """Least rate at which an upright disk rolls straight on without falling [rad/s].

    omega3^2 = A m g radius / (C (C + m radius^2)); the speed radius omega3 is then
    sqrt(g radius / 3) for a disk and sqrt(g radius / 4) for a hoop.

    Args:
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive.

    Source: Routh, Advanced Part, par. 244; Bloch, Nonholonomic Mechanics and Control, sec. 1.5.
    """
    checks.positive(g, "g")
    disk = _disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)
    return math.sqrt(disk.i_perp / (disk.i3 * disk.axial)) * math.sqrt(g / radius)


def spinning_threshold(*, m: float, radius: float, i_perp: float, g: float) -> float:
    """Least rate at which a coin spins about a vertical diameter without falling [rad/s].

    phi'^2 = m g radius / (A + m radius^2).

    Args:
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive.

    Source: Routh, Advanced Part, par. 244.
    """
    checks.all_positive(m=m, radius=radius, i_perp=i_perp, g=g)
    return math.sqrt(m * g * radius / (i_perp + m * radius * radius))


def rolling_exponent(
    omega3: float, *, m: float, radius: float, i_perp: float, i3: float, g: float
) -> complex:
    """Exponent lambda of a small lean of a disk that rolls upright [1/s].

    lambda^2 = B C / (A J) (threshold^2 - omega3^2): real below the threshold, where the lean grows
    as exp(lambda t), and imaginary above, where the disk wobbles at the frequency abs(lambda).

    Args:
        omega3: rate of rolling [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive, or omega3 not finite.

    Source: Routh, Advanced Part, par. 244.
    """
    least = rolling_threshold(m=m, radius=radius, i_perp=i_perp, i3=i3, g=g)
    disk = _disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)
    factor = disk.i3 * disk.axial / (disk.i_perp * disk.tipping)
    return _exponent(factor, least, checks.number(omega3, "omega3"))


def spinning_exponent(
    phi_rate: float, *, m: float, radius: float, i_perp: float, g: float
) -> complex:
    """Exponent lambda of a small lean of a coin that spins about a vertical diameter [1/s].

    lambda^2 = threshold^2 - phi'^2.

    Args:
        phi_rate: rate of spinning [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive, or phi_rate not finite.

    Source: Routh, Advanced Part, par. 244.
    """
    least = spinning_threshold(m=m, radius=radius, i_perp=i_perp, g=g)
    return _exponent(1.0, least, checks.number(phi_rate, "phi_rate"))


def _exponent(factor: float, threshold: float, rate: float) -> complex:
    """Root of factor (threshold^2 - rate^2), the difference taken without cancellation."""
    return cmath.sqrt(factor * (threshold - rate) * (threshold + rate))


# Euler's disk: the motion with still centre, as it loses energy slowly.


@dataclass(frozen=True)
class Settling:
    """A disk with still centre that sinks, through steady motions, as it loses energy.

    Attributes:
        duration: time until it lies flat [s].
        theta: angle of the axis from the vertical, that of the disk from the floor [rad].
        precession: phi' [rad/s].
        theta_exponent: power of the time left, to which the angle is proportional at the end.
        precession_exponent: the same of phi'.
    """

    duration: float
    theta: Array
    precession: Array
    theta_exponent: float
    precession_exponent: float


def stationary_centre_energy(theta: float, *, m: float, radius: float, g: float) -> float:
    """Energy of a disk whose centre is at rest, that of the centre on the ground being 0 [J].

    3/2 m g radius sin(theta), whatever its moments are: a third of it is kinetic.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi [rad].
        m: mass [kg].
        radius: of the rim [m].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range.

    Source: Moffatt (2000), Nature 404:833, doi:10.1038/35009017.
    """
    checks.all_positive(m=m, radius=radius, g=g)
    checks.between(checks.number(theta, "theta"), "theta", 0.0, math.pi)
    return 1.5 * m * g * radius * math.sin(theta)


def settle(
    t: ArrayLike,
    theta: float,
    loss: float,
    power: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    g: float,
) -> Settling:
    """Motion of a disk with still centre that loses energy as a power of its rate of precession.

    E' = -loss phi'^power with E and phi' of the motion with still centre: with n = 1 + power / 2,
    sin(theta)^n falls linearly in time. It holds where a nod is short beside the time left; at the
    very end none is. Dry friction at the contact, of torque loss, has the power 1 and the exponents
    2/3 and -1/3; viscous friction 2, and 1/2 and -1/4; a drag with the cube of the rate 4, and 1/3
    and -1/6, each as cos(theta) tends to 1.

    Args:
        t: times, from 0 on and before the disk lies flat, any shape [s].
        theta: angle at t = 0, above 0 and below pi / 2 [rad].
        loss: energy lost per time at phi' = 1 rad/s, as a torque where the power is 1 [W s^power].
        power: of the rate, at least 0.
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        g: gravity [m/s^2].

    Returns:
        Angle and precession of the shape of t.

    Raises:
        ValueError: a parameter outside its range, or times at which it lies flat.

    Source: after Moffatt (2000); Leine (2009), doi:10.1007/s00419-008-0278-6.
    """
    checks.all_positive(loss=loss, m=m, radius=radius, i_perp=i_perp, g=g)
    n = 1.0 + 0.5 * checks.non_negative(power, "power")
    start = math.sin(_angle_of_fall(theta))
    fastest = math.sqrt(m * g * radius / i_perp)  # of a disk that stands upright
    duration = start**n / n * (1.5 * m * g * radius / loss) / fastest**power
    sine = start * _time_left(t, duration) ** (1.0 / n)
    return Settling(duration, np.arcsin(sine), fastest / np.sqrt(sine), 1.0 / n, -0.5 / n)


def settle_in_air(
    t: ArrayLike, theta: float, viscosity: float, *, m: float, radius: float, g: float
) -> Settling:
    """Motion of a uniform disk with still centre over a film of air, for small angles.

    Moffatt's law E' = -pi viscosity g radius^2 / theta^2 with E = 3/2 m g radius theta, so that
    theta^3 = 2 pi (duration - t) / t1 with t1 = m / (viscosity radius), and phi'^2 =
    4 g / (radius theta). Experiments since then found other exponents, and point to friction of
    rolling: van den Engh, Nelson & Roach (2000), Easwar, Rouyer & Menon (2002), Ma & others (2014).

    Args:
        t: times, from 0 on and before the disk lies flat, any shape [s].
        theta: angle at t = 0, above 0 and below pi / 2 [rad].
        viscosity: of the air [Pa s].
        m: mass [kg].
        radius: of the rim [m].
        g: gravity [m/s^2].

    Returns:
        Angle and precession of the shape of t.

    Raises:
        ValueError: a parameter outside its range, or times at which it lies flat.

    Source: Moffatt (2000), Nature 404:833, doi:10.1038/35009017; van den Engh & others (2000),
        doi:10.1038/35046209; Easwar & others (2002), doi:10.1103/PhysRevE.66.045102; Ma & others
        (2014), doi:10.1098/rspa.2014.0191.
    """
    checks.all_positive(viscosity=viscosity, m=m, radius=radius, g=g)
    start = _angle_of_fall(theta)
    duration = start**3 * m / (2.0 * math.pi * viscosity * radius)
    angle = start * np.cbrt(_time_left(t, duration))
    return Settling(duration, angle, np.sqrt(4.0 * g / (radius * angle)), 1.0 / 3.0, -1.0 / 6.0)


def air_cutoff(viscosity: float, *, m: float, radius: float, g: float) -> float:
    """Time left at which a disk over a film of air would sink faster than it can fall [s].

    Of `settle_in_air`, where the size of theta'' is g / radius: Moffatt's law ends before.

    Args:
        viscosity: of the air [Pa s].
        m: mass [kg].
        radius: of the rim [m].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive.

    Source: Moffatt (2000), Nature 404:833, doi:10.1038/35009017.
    """
    checks.all_positive(viscosity=viscosity, m=m, radius=radius, g=g)
    rate = 2.0 * math.pi * viscosity * radius / m
    fall = math.sqrt(2.0 * radius / (9.0 * g))
    return float(fall * (fall * rate) ** 0.2)


def air_drag(viscosity: float, *, radius: float, g: float) -> float:
    """Drag of a uniform disk that settles as it would over a film of air [N m s^3].

    With still centre and theta small psi'^4 is phi'^4 = (4 g / (radius theta))^2: the power
    drag psi'^4 is that of `settle_in_air` for drag = pi viscosity radius^4 / (16 g). In other
    motions the film has another resistance.

    Args:
        viscosity: of the air [Pa s].
        radius: of the rim [m].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive.
    """
    checks.all_positive(viscosity=viscosity, radius=radius, g=g)
    return math.pi / 16.0 * (viscosity * radius) * (radius / g) * radius * radius


def _angle_of_fall(theta: float) -> float:
    checks.between(checks.number(theta, "theta"), "theta", 0.0, 0.5 * math.pi)
    return float(theta)


def _time_left(t: ArrayLike, duration: float) -> Array:
    """Part of the duration that is left at some times."""
    times = checks.array(t, "t")
    expected = f"from 0 on and before the disk lies flat, at {duration:.9g} s"
    checks.require((times >= 0.0) & (times < duration), times, "t", expected)
    return np.asarray(1.0 - times / duration)
