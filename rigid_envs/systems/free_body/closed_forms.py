"""Free motion of a rigid body in closed form."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.base import checks
from rigid_envs.base.checks import Array
from rigid_envs.mechanics import special

# Angular velocity of a free body by Jacobi elliptic functions.
#
# The trick that makes one formula serve all cases is a *normal frame*: a proper rotation of the
# principal axes that puts the axis that omega circulates about third, the intermediate axis second,
# and makes the first and third components of omega0 non-negative. There, with moments J1, J2, J3,
#
#     omega = (a1 cn u, a2 sn u, a3 dn u),    u = u0 + p t,    0 <= m <= 1.
#
# No digit of the input is lost near the separatrix: amplitudes and m are sums of terms of one sign
# and products, and the one difference, which is 1 - m, is taken exactly.
#
# Source: Landau & Lifshitz, Mechanics, par. 37; Goldstein, Classical Mechanics, ch. 5.


@dataclass(frozen=True)
class Polhode:
    """The closed curve that omega runs through in the body, in the normal frame.

    Attributes:
        m: parameter of the elliptic functions, in [0, 1]; 1 on the separatrix.
        m1: 1 - m, computed without cancellation.
        rate: signed p of u = u0 + p t [rad/s]; 0 where omega does not change at any amplitude.
        start: u0, infinite on the intermediate axis itself.
        momentum: magnitude L of the angular momentum [kg m^2/s].
        amplitudes: a1, a2, a3 [rad/s], shape (3,).
        moments: J1, J2, J3 [kg m^2]: the intermediate one second, the circulated axis third.
        axes: body axis (0, 1, 2) that is each axis of the normal frame.
        signs: its direction, +1 or -1.
    """

    m: float
    m1: float
    rate: float
    start: float
    momentum: float
    amplitudes: tuple[float, float, float]
    moments: tuple[float, float, float]
    axes: tuple[int, int, int]
    signs: tuple[float, float, float]

    @property
    def flip_interval(self) -> float:
        """Time between sign changes of omega about the intermediate axis, 2 K / p [s].

        Infinite on the separatrix and where omega is constant; about a stable axis the limit of
        small departures, half an oscillation.
        """
        return 2.0 * special.quarter_period(self.m1) / abs(self.rate) if self.rate else math.inf

    @property
    def period(self) -> float:
        """Time in which omega returns in the body, 4 K / p = 2 flip intervals [s]."""
        return 2.0 * self.flip_interval

    @property
    def flip_asymptote(self) -> float:
        """Flip interval beside the separatrix, (2 / p) ln(4 / sqrt(1 - m)) [s].

        What is left out is of the relative order of 1 - m. A perturbation eps of the spin gives
        1 - m ~ eps^2: the interval grows by (2 / p) ln 10 for each decimal by which eps falls, and
        a relative error x of eps moves it by 2 x / p.
        """
        if self.rate == 0.0 or self.m1 == 0.0:
            return math.inf
        return 2.0 / abs(self.rate) * (math.log(4.0) - 0.5 * math.log(self.m1))

    def argument(self, t: ArrayLike) -> Array:
        """Argument u of the elliptic functions at the times t [s], of the shape of t."""
        times = checks.array(t, "t")
        with np.errstate(over="ignore"):
            turned = self.rate * times
        expected = f"times with a finite phase at {self.rate:.9g} rad/s [s]"
        checks.require(np.isfinite(turned), times, "t", expected)
        return self.start + turned

    def to_body(self, normal: Array) -> Array:
        """Components in the principal body axes of vectors in the normal frame, shape (..., 3)."""
        body = np.empty_like(normal)
        body[..., list(self.axes)] = np.array(self.signs) * normal
        return body


def polhode(moments: ArrayLike, omega0: ArrayLike) -> Polhode:
    """Find the normal frame and the elliptic constants of a free motion.

    With D = 2 T J2 - L^2 = J1 (J2 - J1) w1^2 - J3 (J3 - J2) w3^2 deciding the axis,

        p^2 = (J3 - J2)(J3 - J1) a3^2 / (J1 J2),
        m = J1 (J2 - J1) a1^2 / (J3 (J3 - J2) a3^2),    1 - m = abs(D) / abs(J3 (J3 - J2) a3^2).

    Args:
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.

    Raises:
        ValueError: a wrong shape, a moment that is not positive, a number that is not finite, or
            an angular momentum that double precision has not.

    Source: Landau & Lifshitz, par. 37.
    """
    inertia = checks.positive_array(moments, "moments", "kg m^2", 3)
    rates = checks.exact_array(omega0, "omega0", 3)
    heft, size = _power_of_two(inertia), _power_of_two(rates)
    momentum = _momentum(inertia, rates, heft, size)
    axes, signs, gap = _normal_frame(inertia / heft, rates / size)
    j1, j2, j3 = (float(x) for x in inertia[axes] / heft)
    w1, w2, w3 = (float(x) for x in signs * rates[axes] / size)
    a1, a2, a3 = _amplitudes((j1, j2, j3), (w1, w2, w3))
    scale = abs(j3 * (j3 - j2)) * a3 * a3
    m1 = gap / scale if scale else 1.0
    sn, cn, dn = w2 / a2 if a2 else 0.0, w1 / a1 if a1 else 1.0, w3 / a3 if a3 else 1.0
    return Polhode(
        m=min(j1 * abs(j2 - j1) * a1 * a1 / scale, 1.0) if scale else 0.0,
        m1=min(m1, 1.0) if m1 > special.SMALLEST else 0.0,
        rate=math.copysign(size * a3 * math.sqrt((j3 - j2) * (j3 - j1) / (j1 * j2)), j3 - j2),
        start=float(special.argument(sn, cn, dn)),
        momentum=momentum,
        amplitudes=(size * a1, size * a2, size * a3),
        moments=(heft * j1, heft * j2, heft * j3),
        axes=(axes[0], axes[1], axes[2]),
        signs=(float(signs[0]), float(signs[1]), float(signs[2])),
    )


def omega(t: ArrayLike, moments: ArrayLike, omega0: ArrayLike) -> Array:
    """Angular velocity of a free body, (a1 cn u, a2 sn u, a3 dn u) in the normal frame.

    Args:
        t: times, any shape [s].
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.

    Returns:
        Angular velocity, shape t.shape + (3,) [rad/s], principal body axes.

    Raises:
        ValueError: a wrong shape, a moment that is not positive, or a number that is not finite.

    Source: Landau & Lifshitz, par. 37.
    """
    path = polhode(moments, omega0)
    sn, cn, dn = special.jacobi(path.argument(t), path.m1)
    return path.to_body(np.stack([cn, sn, dn], axis=-1) * np.array(path.amplitudes))


def _power_of_two(values: Array) -> float:
    """The size of the largest: divided by it squares stay in range, and no digit changes."""
    return 2.0 ** (math.frexp(float(np.max(np.abs(values))))[1] - 1)


def _momentum(inertia: Array, rates: Array, heft: float, size: float) -> float:
    """Magnitude of the angular momentum [kg m^2/s], refused where it is no normal number."""
    momentum = heft * (size * float(np.linalg.norm((inertia / heft) * (rates / size))))
    normal = not np.any(rates) or np.finfo(np.float64).tiny <= momentum < math.inf
    expected = "an angular momentum within double precision: choose other units"
    checks.require(bool(normal), rates, "omega0", expected)
    return momentum


def _normal_frame(inertia: Array, rates: Array) -> tuple[list[int], Array, float]:
    """Axes and signs of the normal frame, and abs(D) to full relative accuracy.

    D is taken in exact rational arithmetic: near the separatrix it is the small difference of two
    large terms, and on it whether the body ever returns hangs on D being 0.
    """
    order = [int(k) for k in np.argsort(inertia, kind="stable")]
    low, middle, high = (Fraction(float(x)) for x in inertia[order])
    below = low * (middle - low) * Fraction(float(rates[order[0]])) ** 2
    above = high * (high - middle) * Fraction(float(rates[order[2]])) ** 2
    # On a tie a symmetric body must circulate about its own axis, the lone moment.
    largest = above > below or (above == below and high - middle >= middle - low)
    axes = order if largest else order[::-1]
    parity = 1.0 if (axes[1] - axes[0]) % 3 == 1 else -1.0
    first, _, third = np.copysign(1.0, rates[axes])
    return axes, np.array([first, parity * first * third, third]), float(abs(above - below))


def _amplitudes(
    moments: tuple[float, float, float], start: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Largest values a1, a2, a3 that the three components reach, in the normal frame."""
    (j1, j2, j3), (w1, w2, w3) = moments, start
    if j1 == j3:  # a sphere keeps every omega; the ratios below are 0/0
        across = math.hypot(w1, w2)
        return across, across, w3
    aspect = math.sqrt(j2 * (j3 - j2) / (j1 * (j3 - j1)))
    a1 = math.hypot(w1, aspect * w2)
    return a1, a1 / aspect, math.hypot(w3, math.sqrt(j2 * (j2 - j1) / (j3 * (j3 - j1))) * w2)


# Rates of a free body near its steady rotations.


def growth_rate(moments: ArrayLike, spin: float) -> float:
    """Rate at which departures from spin about the intermediate axis grow [1/s].

    spin sqrt((B - A)(C - B) / (A C)) for moments A <= B <= C: the tennis-racket instability.

    Args:
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        spin: rate of the steady rotation [rad/s].

    Raises:
        ValueError: a wrong shape, a moment that is not positive, or a number that is not finite.

    Source: Goldstein, sec. 5.6; Landau & Lifshitz, par. 37, problem 1.
    """
    a, b, c = _ascending(moments)
    return abs(checks.number(spin, "spin")) * math.sqrt((b - a) / a * ((c - b) / c))


def oscillation_rates(moments: ArrayLike, spin: float) -> tuple[float, float]:
    """Angular frequencies of small departures from spin about the two stable axes [rad/s].

    spin sqrt((B - A)(C - A) / (B C)) about the smallest moment A, and
    spin sqrt((C - A)(C - B) / (A B)) about the largest moment C.

    Args:
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        spin: rate of the steady rotation [rad/s].

    Returns:
        The frequency about the axis of the smallest moment, and about that of the largest.

    Raises:
        ValueError: a wrong shape, a moment that is not positive, or a number that is not finite.

    Source: Goldstein, sec. 5.6; Landau & Lifshitz, par. 37, problem 1.
    """
    a, b, c = _ascending(moments)
    size = abs(checks.number(spin, "spin"))
    smallest, largest = (b - a) / b * ((c - a) / c), (c - a) / a * ((c - b) / b)
    return size * math.sqrt(smallest), size * math.sqrt(largest)


def _ascending(moments: ArrayLike) -> tuple[float, float, float]:
    """Principal moments, checked and sorted."""
    inertia = checks.positive_array(moments, "moments", "kg m^2", 3)
    a, b, c = sorted(float(x) for x in inertia)
    return a, b, c


# The free symmetric top: two cones that roll on each other, and the wobble of the Earth.
#
# With the moment I3 about the axis, I1 across it and the axial rate omega3, omega, L and the axis
# lie in one plane at all times. The body cone, which omega runs through about the axis, rolls
# without slip on the space cone, which omega runs through about L.
#
# Sources: Landau & Lifshitz, Mechanics, par. 33; Goldstein, Classical Mechanics, sec. 5.6.


@dataclass(frozen=True)
class Cones:
    """The two cones of a free symmetric top.

    Attributes:
        axis: body axis (0, 1, 2) of symmetry; 2 for a sphere, which has none of its own.
        body_angle: half angle of the body cone, between omega and the axis line [rad].
        space_angle: half angle of the space cone, between omega and L [rad].
        tilt: between the axis line and L, half angle of the cone of the axis in space [rad]:
            body_angle + space_angle if prolate, body_angle - space_angle if oblate.
        body_rate: of omega about the axis in the body, positive by the right hand about the body
            axis [rad/s].
        space_rate: of omega and of the axis about L in space [rad/s].
        space_cone: where it lies: "outside" the body cone (prolate, I3 < I1), "inside" it (oblate,
            I3 > I1), or "none" (sphere: it is a line).
    """

    axis: int
    body_angle: float
    space_angle: float
    tilt: float
    body_rate: float
    space_rate: float
    space_cone: Literal["outside", "inside", "none"]


def symmetric_cones(moments: ArrayLike, omega0: ArrayLike) -> Cones:
    """Find the cones on which the motion of a free symmetric top rolls.

    With the part w of omega across the axis,

        tan body_angle = w / omega3,    tan tilt = I1 w / (I3 omega3),
        tan space_angle = abs(I3 - I1) w omega3 / (I1 w^2 + I3 omega3^2).

    Args:
        moments: principal moments of inertia, shape (3,), two of them equal [kg m^2], any order.
        omega0: angular velocity, shape (3,) [rad/s], principal body axes.

    Raises:
        ValueError: no two moments are equal, or bad numbers as in `polhode`.

    Source: Goldstein, sec. 5.6; Landau & Lifshitz, par. 33.
    """
    inertia, rates, axis = _symmetric(moments, omega0)
    axial, transverse = float(inertia[axis]), float(inertia[axis - 1])
    along, across = abs(float(rates[axis])), math.hypot(rates[axis - 1], rates[axis - 2])
    # Of unit size: squares of slow rates underflow.
    size = math.hypot(along, across) or 1.0
    cos, sin = along / size, across / size
    body_rate, space_rate = symmetric_rates(moments, omega0)
    return Cones(
        axis=axis,
        body_angle=math.atan2(across, along),
        space_angle=math.atan2(
            abs(axial - transverse) * sin * cos, transverse * sin * sin + axial * cos * cos
        ),
        tilt=math.atan2(transverse * across, axial * along),
        body_rate=body_rate,
        space_rate=space_rate,
        space_cone=(
            "outside" if axial < transverse else "inside" if axial > transverse else "none"
        ),
    )


def symmetric_rates(moments: ArrayLike, omega0: ArrayLike) -> tuple[float, float]:
    """Rates of the two cones of a free symmetric top, axis I3 and transverse moment I1.

    Args:
        moments: principal moments of inertia, shape (3,), two of them equal [kg m^2], any order.
        omega0: angular velocity, shape (3,) [rad/s], principal body axes.

    Returns:
        (I3 - I1) / I1 omega3, at which omega turns about the symmetry axis in the body
        (positive by the right hand), and L / I1, at which the symmetry axis turns about L in
        space [rad/s].

    Raises:
        ValueError: no two moments are equal, or bad numbers as in `polhode`.

    Source: Landau & Lifshitz, par. 33; Goldstein, sec. 5.6.
    """
    inertia, rates, axis = _symmetric(moments, omega0)
    axial, transverse = float(inertia[axis]), float(inertia[axis - 1])
    across = math.hypot(rates[axis - 1], rates[axis - 2])
    space_rate = math.hypot(across, axial / transverse * float(rates[axis]))
    return (axial - transverse) / transverse * float(rates[axis]), space_rate


def chandler_period(omega3: float, *, i_perp: float, i3: float) -> float:
    """Period in which the pole of a rigid oblate body runs round its axis, in the body [s].

    2 pi I1 / ((I3 - I1) omega3), Euler's free precession: 304 days for a rigid Earth. (Chandler's
    433 days are the same motion of the elastic one.)

    Args:
        omega3: rate about the axis of symmetry, not 0 [rad/s].
        i_perp: transverse moment I1 [kg m^2].
        i3: axial moment I3, above i_perp [kg m^2].

    Raises:
        ValueError: a body that is not oblate, or one that does not turn.

    Source: Goldstein, sec. 5.6; Landau & Lifshitz, par. 33.
    """
    rate = abs(checks.number(omega3, "omega3"))
    checks.require(rate > 0.0, omega3, "omega3", "a rate other than 0 [rad/s]")
    return 2.0 * math.pi * chandler_turns(i_perp=i_perp, i3=i3) / rate


def chandler_turns(*, i_perp: float, i3: float) -> float:
    """The same period in turns of the body about its axis: I1 / (I3 - I1).

    Args:
        i_perp: transverse moment I1 [kg m^2].
        i3: axial moment I3, above i_perp [kg m^2].

    Raises:
        ValueError: a body that is not oblate.

    Source: Goldstein, sec. 5.6.
    """
    checks.all_positive(i_perp=i_perp, i3=i3)
    checks.require(i3 > i_perp, i3, "i3", f"above i_perp = {i_perp}: use symmetric_rates")
    return i_perp / (i3 - i_perp)


def _symmetric(moments: ArrayLike, omega0: ArrayLike) -> tuple[Array, Array, int]:
    """Moments and rates, checked, and the body axis of symmetry."""
    inertia = checks.positive_array(moments, "moments", "kg m^2", 3)
    rates = checks.exact_array(omega0, "omega0", 3)
    axes = [k for k in (2, 1, 0) if inertia[k - 2] == inertia[k - 1]]
    checks.require(bool(axes), inertia, "moments", "two equal: use polhode instead")
    return inertia, rates, axes[0]


# Attitude of a free body by an elliptic integral of the third kind.
#
# Sources: Landau & Lifshitz, Mechanics, par. 37; van Zon & Schofield (2007), J. Comput. Phys.
# 225:145, doi:10.1016/j.jcp.2006.11.019.


def attitude(t: ArrayLike, moments: ArrayLike, omega0: ArrayLike, q0: ArrayLike) -> Array:
    """Attitude of a free body, continuous in t and equal to q0 at t = 0.

    In a space frame with z along L the attitude has z-x-z Euler angles: theta and psi from the
    direction n of L in the body, and the precession

        phi' = L / J2 + L (1 / J1 - 1 / J2) cn^2 / (1 + nu sn^2),
        nu = J3 (J2 - J1) / (J1 (J3 - J2)),

    which `special.cn2_integral` integrates. The second term dies out at the separatrix, where the
    motion lingers; and since n3 >= 0 in the normal frame, the quaternion of the angles is smooth
    even where the angles are not.

    Args:
        t: times, any shape [s].
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.

    Returns:
        Attitude, shape t.shape + (4,), unit (w, x, y, z), body to world.

    Raises:
        ValueError: a wrong shape, a moment that is not positive, a quaternion that is not unit, or
            a number that is not finite.

    Source: Landau & Lifshitz, par. 37; van Zon & Schofield (2007).
    """
    path, q_start = polhode(moments, omega0), special.normalized(q0, "q0")
    turned = special.product(special.conjugate(_from_momentum(path, 0.0)), _from_momentum(path, t))
    turned[..., 1:] = path.to_body(turned[..., 1:])
    return special.product(np.broadcast_to(q_start, turned.shape), turned)


def _from_momentum(path: Polhode, t: ArrayLike) -> Array:
    """Quaternion from the normal frame to a space frame with z along L, shape t.shape + (4,)."""
    u = path.argument(t)
    sn, cn, dn = special.jacobi(u, path.m1)
    shares = np.array(path.amplitudes) / (path.momentum or 1.0)  # squares of slow rates underflow
    momentum = np.stack([cn, sn, dn], axis=-1) * shares * np.array(path.moments)
    if path.momentum == 0.0:
        momentum[..., 2] = 1.0  # at rest any direction will do
    momentum /= np.linalg.norm(momentum, axis=-1, keepdims=True)
    # The third component is never negative: nothing cancels, and theta <= 90 degrees.
    cos_half = np.sqrt(0.5 * (1.0 + momentum[..., 2]))
    sin_half = np.hypot(momentum[..., 0], momentum[..., 1]) / (2.0 * cos_half)
    phi, psi = _precession(path, u, t), _spin(path, u)
    total, difference = 0.5 * (phi + psi), 0.5 * (phi - psi)
    parts = [
        cos_half * np.cos(total),
        sin_half * np.cos(difference),
        sin_half * np.sin(difference),
        cos_half * np.sin(total),
    ]
    return np.stack(parts, axis=-1)


def _precession(path: Polhode, u: Array, t: ArrayLike) -> Array:
    """Euler angle phi about L [rad], up to a constant."""
    j1, j2, _ = path.moments
    steady = path.momentum / j2 * np.asarray(t, dtype=np.float64)
    if path.rate == 0.0 or j1 == j2:
        return steady
    factor = path.momentum / j2 / path.rate * ((j2 - j1) / j1)
    return steady + factor * special.cn2_integral(u, _characteristic(path), path.m1)


def _spin(path: Polhode, u: Array) -> Array:
    """Euler angle psi [rad], with tan psi = n1 / n2, continuous in u."""
    n, v = special.split_half_periods(u, path.m1)
    sn, cn, _ = special.jacobi(v, path.m1)
    stretch = math.sqrt(1.0 + _characteristic(path))
    return np.pi * (0.5 - n) - np.arctan2(stretch * sn, cn)


def _characteristic(path: Polhode) -> float:
    """Return nu of the precession, minus the characteristic of Legendre's Pi."""
    j1, j2, j3 = path.moments
    return j3 / j1 * ((j2 - j1) / (j3 - j2)) if j3 != j2 else 0.0


# Poinsot's construction: the ellipsoid of inertia rolls on the invariable plane.
#
# omega ends on the energy ellipsoid, omega . I omega = 2 T, which is fixed in the body and whose
# normal there is I omega = L. So it touches, at omega, the plane with normal L at the distance
# omega . L / norm(L) = 2 T / L from the centre; and since omega is also the axis about which the
# body turns, it rolls on that plane without slip. In the body the contact runs through the polhode,
# on the plane through the herpolhode.
#
# Sources: Goldstein, Classical Mechanics, sec. 5.6; Landau & Lifshitz, Mechanics, par. 37.


@dataclass(frozen=True)
class Poinsot:
    """Measures of the rolling ellipsoid.

    Attributes:
        momentum: L, magnitude of the angular momentum [kg m^2/s].
        energy: T, kinetic energy [J].
        distance: of the invariable plane from the centre, 2 T / L, which is the constant component
            of omega along L [rad/s]. 0 at rest.
        ellipsoid_distance: the same for the ellipsoid of inertia rho . I rho = 1, whose contact is
            rho = omega / sqrt(2 T): sqrt(2 T) / L [kg^-1/2 m^-1]. At rest the limit of a slow spin.
        radius_min: smallest distance of the herpolhode from the foot of L on the plane [rad/s].
        radius_max: largest one [rad/s]; both are 0 where omega does not change.
        period: of the polhode, 4 K / p [s]; the herpolhode has the same shape twice in it.
        advance: angle about L by which the contact advances in that time [rad]; infinite where the
            period is.
    """

    momentum: float
    energy: float
    distance: float
    ellipsoid_distance: float
    radius_min: float
    radius_max: float
    period: float
    advance: float


def poinsot(moments: ArrayLike, omega0: ArrayLike) -> Poinsot:
    """Find the invariable plane and the ring in which the herpolhode lies.

    The contact is norm(omega x L) / L away from the foot of L, and in the normal frame of
    `Polhode`, where nothing cancels,

        r_max = abs(J3 - J1) a1 a3 / L at cn = 1,
        r_min = abs(J3 - J2) a2 a3 sqrt(1 - m) / L at sn = 1.

    Args:
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.

    Raises:
        ValueError: a wrong shape, a moment that is not positive, or a number that is not finite.

    Source: Landau & Lifshitz, par. 37; Whittaker, Analytical Dynamics, ch. VI.
    """
    path = polhode(moments, omega0)
    (j1, j2, j3), (a1, a2, _) = path.moments, path.amplitudes
    momentum, share = path.momentum, _shares(path)[2]
    rates = checks.exact_array(omega0, "omega0", 3)
    distance = float(rates @ _direction(path, checks.exact_array(moments, "moments", 3) * rates))
    return Poinsot(
        momentum=momentum,
        energy=0.5 * momentum * distance,
        distance=distance,
        ellipsoid_distance=math.sqrt(distance / momentum if momentum else 1.0 / j3),
        radius_min=a2 * math.sqrt(path.m1) * (abs(j3 - j2) * share),
        radius_max=a1 * (abs(j3 - j1) * share) if math.isfinite(path.start) else 0.0,
        period=path.period,
        advance=_advance(path),
    )


def invariable_plane(moments: ArrayLike, omega0: ArrayLike, q0: ArrayLike) -> tuple[Array, float]:
    """Place of the invariable plane in the world: normal . omega_world = distance at all times.

    Args:
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.

    Returns:
        The normal L / norm(L), shape (3,), world, and the distance 2 T / norm(L) from the centre
        [rad/s]. At rest the distance is 0 and the normal one of the body axes.

    Raises:
        ValueError: bad numbers as in `poinsot`, or a quaternion that is not unit.

    Source: Goldstein, sec. 5.6.
    """
    path, q = polhode(moments, omega0), special.normalized(q0, "q0")
    inertia, rates = (
        checks.exact_array(moments, "moments", 3),
        checks.exact_array(omega0, "omega0", 3),
    )
    body = _direction(path, inertia * rates)
    pure = np.concatenate([np.zeros(1), body])
    world = special.product(special.product(q, pure), special.conjugate(q))[1:]
    return world, float(body @ rates)


def herpolhode(t: ArrayLike, moments: ArrayLike, omega0: ArrayLike) -> tuple[Array, Array]:
    """Curve of the contact on the invariable plane, in polar coordinates about the foot of L.

    The angle is the precession of the third axis of the normal frame about L and, on top of it, the
    angle at L between that axis and omega,

        tan = (J2 - J1) L a2 sn cn / (J1 (J1 - J3) a1 a3 dn),

    which swings to and fro and never turns round, because dn > 0.

    Args:
        t: times, any shape [s].
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.

    Returns:
        Radius [rad/s] and angle about L since t = 0, continuous [rad], each of the shape of t.

    Raises:
        ValueError: bad numbers as in `poinsot`.

    Source: Landau & Lifshitz, par. 37.
    """
    path = polhode(moments, omega0)
    u = path.argument(t)
    angle = _precession(path, u, t) + _lead(path, u)
    start = _precession(path, path.argument(0.0), 0.0) + _lead(path, path.argument(0.0))
    return _radius(path, u), angle - start


def _direction(path: Polhode, momentum: Array) -> Array:
    """Unit vector along L in the body; at rest along the axis that the normal frame has third."""
    if path.momentum == 0.0:
        return path.to_body(np.array([0.0, 0.0, 1.0]))
    return momentum / path.momentum


def _advance(path: Polhode) -> float:
    """Precession during one period of the polhode [rad]."""
    if math.isinf(path.period):
        return math.inf
    whole = math.copysign(4.0 * special.quarter_period(path.m1), path.rate)
    return float(_precession(path, np.array(whole), path.period))


def _radius(path: Polhode, u: Array) -> Array:
    """Distance of the contact from the foot of L, norm(omega x L) / L [rad/s]."""
    (j1, j2, j3), (a1, a2, _) = path.moments, path.amplitudes
    share1, _, share3 = _shares(path)
    sn, cn, dn = special.jacobi(u, path.m1)
    cross = (
        a2 * ((j3 - j2) * share3) * sn * dn,
        a1 * ((j3 - j1) * share3) * cn * dn,
        a2 * ((j2 - j1) * share1) * sn * cn,
    )
    return np.hypot(np.hypot(cross[0], cross[1]), cross[2])


def _lead(path: Polhode, u: Array) -> Array:
    """Angle about L from the third axis of the normal frame, or its opposite, to omega [rad]."""
    (j1, j2, j3), (share1, share2, share3) = path.moments, _shares(path)
    sn, cn, dn = special.jacobi(u, path.m1)
    across = math.copysign(1.0, j1 - j3) * (j2 - j1) * share2 * sn * cn
    return np.asarray(np.arctan2(across, (abs(j1 - j3) * share1) * (j1 * share3) * dn))


def _shares(path: Polhode) -> tuple[float, float, float]:
    """a1 / L, a2 / L and a3 / L, for products that neither under- nor overflow; 0 at rest."""
    a1, a2, a3 = (a / (path.momentum or 1.0) for a in path.amplitudes)
    return a1, a2, a3
