"""Motion of the symmetric top in closed form."""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.base import checks
from rigid_envs.base.checks import Array
from rigid_envs.mechanics import special

# Constants of a top's motion from its initial state, in exact arithmetic.
#
# Whether the axis passes the vertical at 1e-17 rad or through it, on which side, and whether a top
# ever comes back down hang on differences of large numbers: b - a, b + a and E - mgl. Here they are
# taken in rational numbers from the doubles given, and rounded once.

# Tilts and transverse rates whose fourth powers, in the cubic, underflow are taken as 0.
_SMALLEST = 1e-75


@dataclass(frozen=True)
class _Pole:
    """Initial state relative to one pole, with distances d = 1 - u from upright, or 1 + u.

    Attributes:
        side: +1 for upright, -1 for hanging.
        here: d at the start.
        twist: b - a for upright, b + a for hanging [rad/s].
        cubic: coefficients c2, c1, c0 of the monic cubic in d.
    """

    side: float
    here: float
    twist: float
    cubic: tuple[float, float, float]


@dataclass(frozen=True)
class _Start:
    """Constants of the motion.

    Attributes:
        a: I3 omega3 / I [rad/s].
        b: p_phi / I [rad/s].
        beta: 2 mgl / I [1/s^2].
        omega3: axial angular velocity [rad/s].
        climb: u' at the start [1/s].
        upright: the start from the upper pole.
        hanging: the start from the lower pole.
        cayley_klein: w + i z and x + i y of the start.
        across: omega1 + i omega2 of the start [rad/s].
    """

    a: float
    b: float
    beta: float
    omega3: float
    climb: float
    upright: _Pole
    hanging: _Pole
    cayley_klein: tuple[complex, complex]
    across: complex


@dataclass(frozen=True)
class Invariants:
    """Conserved quantities of the top.

    Attributes:
        energy: kinetic energy about the pivot plus mgl cos theta [J].
        p_phi: vertical angular momentum [kg m^2/s].
        p_psi: axial angular momentum I3 omega3 [kg m^2/s].
    """

    energy: float
    p_phi: float
    p_psi: float


def _start_of(omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float) -> _Start:
    """Check the start of a top and find the constants of its motion.

    Args:
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Raises:
        ValueError: a moment or mgl that is not positive, a quaternion that is not unit, a wrong
            shape, or a number that is not finite.
    """
    checks.all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    rates = checks.exact_array(omega0, "omega0", 3)
    expected = (
        "rates, moments and weight whose ratios double precision has: I omega^2 / mgl and "
        "(I3 omega3)^2 / (I mgl) below 1e100"
    )
    try:
        start = _start(rates.tolist(), q0, i_perp, i3, mgl)
    except OverflowError:
        raise ValueError(f"omega0 = {rates.tolist()}; expected {expected}") from None
    largest = max(map(abs, start.upright.cubic + start.hanging.cubic))
    checks.require(largest < 1e100, rates, "omega0", expected)
    return start


def _start(rates: list[float], q0: ArrayLike, i_perp: float, i3: float, mgl: float) -> _Start:
    """Constants of the motion of a start whose numbers are checked, but for the quaternion."""
    unit = special.normalized(q0, "q0").tolist()
    swing = math.sqrt(mgl / i_perp)
    w1, w2, w3 = _exact(rates[0], swing), _exact(rates[1], swing), Fraction(rates[2])
    qw, qx, qy, qz = (_exact(x, 1.0) for x in checks.exact_array(q0, "q0", 4).tolist())
    square = qw * qw + qx * qx + qy * qy + qz * qz
    # gamma = R^T e_z; its third component is u.
    gamma1, gamma2 = 2 * (qx * qz - qw * qy) / square, 2 * (qy * qz + qw * qx) / square
    a = Fraction(float(i3)) * w3 / Fraction(float(i_perp))
    beta = 2 * Fraction(float(mgl)) / Fraction(float(i_perp))
    upright, hanging = 2 * (qx * qx + qy * qy) / square, 2 * (qw * qw + qz * qz) / square
    speed, turn = w1 * w1 + w2 * w2, gamma1 * w1 + gamma2 * w2
    return _Start(
        a=float(a),
        b=float(turn + a * (hanging - upright) / 2),
        beta=float(beta),
        omega3=float(w3),
        climb=float(gamma1 * w2 - gamma2 * w1),
        upright=_pole(1, upright, speed, turn, a, beta),
        hanging=_pole(-1, hanging, speed, turn, a, beta),
        cayley_klein=(complex(unit[0], unit[3]), complex(unit[1], unit[2])),
        across=complex(w1, w2),
    )


def invariants(
    omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> Invariants:
    """Find energy and momenta of a top from its start.

    Args:
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Raises:
        ValueError: a moment or mgl that is not positive, a quaternion that is not unit, a wrong
            shape, or a number that is not finite.

    Source: Goldstein, sec. 5.7.
    """
    start = _start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl)
    kinetic = 0.5 * (i_perp * abs(start.across) ** 2 + i3 * start.omega3**2)
    return Invariants(
        energy=kinetic + 0.5 * mgl * (start.hanging.here - start.upright.here),
        p_phi=i_perp * start.b,
        p_psi=i3 * start.omega3,
    )


def _exact(value: float, size: float) -> Fraction:
    """Return the rational number that a double is, or 0 for one that is next to nothing."""
    return Fraction(value) if abs(value) > _SMALLEST * size else Fraction(0)


def _pole(
    side: int, here: Fraction, speed: Fraction, turn: Fraction, a: Fraction, beta: Fraction
) -> _Pole:
    """Twist and cubic (1 - u^2)(alpha - beta u) - (b - a u)^2 in the distance from one pole.

    There alpha - beta u = energy + side beta d, b - a u = twist + side a d, 1 - u^2 = d (2 - d).
    """
    energy, twist = speed - side * beta * here, turn - side * a * here
    return _Pole(
        side=float(side),
        here=float(here),
        twist=float(twist),
        cubic=(
            float(side * (energy + a * a) / beta - 2),
            float(2 * (a * twist - side * energy) / beta),
            float(side * twist * twist / beta),
        ),
    )


# Roots of a cubic, each to its own relative accuracy.


def _cubic_roots(c2: float, c1: float, c0: float) -> tuple[float, float, float]:
    """Roots, ascending, of d^3 + c2 d^2 + c1 d + c0 that has three real ones.

    The lone root by Viete's cosine and Newton's step, the pair from the quadratic that is left,
    divided out from the end at which nothing cancels: small roots keep their relative accuracy.
    """
    centre, square = -c2 / 3.0, c2 * c2 / 9.0 - c1 / 3.0
    radius = math.sqrt(max(square, 0.0))
    bias, cube = centre**3 - 0.5 * (c1 * centre + c0), radius**3
    ratio = min(abs(bias) / cube, 1.0) if cube > 0.0 else 0.0
    root = centre + 2.0 * math.copysign(radius, bias) * math.cos(math.acos(ratio) / 3.0)
    for _ in range(3):
        slope = (3.0 * root + 2.0 * c2) * root + c1
        root -= (((root + c2) * root + c1) * root + c0) / slope if slope else 0.0
    half_sum, product = -0.5 * (c2 + root), (root + c2) * root + c1
    if root * root > abs(product):
        product = -c0 / root
        half_sum = 0.5 * (c1 - product) / root
    gap = math.sqrt(max(half_sum * half_sum - product, 0.0))
    outer = half_sum + math.copysign(gap, half_sum)
    inner = product / outer if outer else 0.0
    low, middle, high = sorted((root, inner, outer))
    return low, middle, high


# Nutation: the tilt of the top at any time, by Jacobi elliptic functions.


@dataclass(frozen=True)
class Nutation:
    """The oscillation of the tilt between its two turning points.

    cos theta = u1 cn^2 + u2 sn^2 of the argument start + rate t, u1 <= u2 <= 1 <= u3 being the
    roots of the cubic (1 - u^2)(alpha - beta u) - (b - a u)^2.

    Attributes:
        theta_min: smallest tilt [rad].
        theta_max: largest tilt [rad].
        period: time from one smallest tilt to the next [s]; infinite on the way to upright.
        m1: complementary parameter (u3 - u2) / (u3 - u1) of the elliptic functions.
        rate: sqrt(beta (u3 - u1)) / 2 [rad/s].
        start: argument at t = 0.
        depths: 1 - u1, 1 - u2 and u3 - 1, each exact where it is small.
        heights: 1 + u1, 1 + u2 and 1 + u3, each exact where it is small.
    """

    theta_min: float
    theta_max: float
    period: float
    m1: float
    rate: float
    start: float
    depths: tuple[float, float, float]
    heights: tuple[float, float, float]

    @property
    def roots(self) -> tuple[float, float, float]:
        """u1, u2, u3: cosines of the largest and of the smallest tilt, and the one beyond 1."""
        d1, d2, d3 = self.depths
        e1, e2, _ = self.heights
        return 0.5 * (e1 - d1), 0.5 * (e2 - d2), 1.0 + d3

    def argument(self, t: ArrayLike) -> Array:
        """Argument of the elliptic functions at the times t [s], of the shape of t."""
        return self.start + self.rate * checks.array(t, "t")


def nutation(omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float) -> Nutation:
    """Find turning points and period of the nutation of a top from any initial state.

    The cubic is taken in the distances from both poles, 1 - u and 1 + u, with coefficients exact to
    rounding: so a tilt of 1e-12 keeps its digits. (Exactly at the sleeping threshold tilts below
    1e-8 do not: the rounding of the spin decides.)

    Args:
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Raises:
        ValueError: a moment or mgl that is not positive, a quaternion that is not unit, a wrong
            shape, or a number that is not finite.

    Source: Goldstein, sec. 5.7; Landau & Lifshitz, par. 35, problem 1.
    """
    return _nutation_of(_start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl))


def _nutation_of(start: _Start) -> Nutation:
    """Nutation of a start that has been checked."""
    (d1, e1), (d2, e2), d3 = _turning_points(start)
    span = d1 + d3
    moves = span > special.SMALLEST
    rate = 0.5 * math.sqrt(start.beta * span) if moves else 0.0
    m1 = min((d2 + d3) / span, 1.0) if moves else 1.0
    m1 = m1 if m1 > special.SMALLEST else 0.0
    return Nutation(
        theta_min=2.0 * math.atan2(math.sqrt(d2), math.sqrt(e2)),
        theta_max=2.0 * math.atan2(math.sqrt(d1), math.sqrt(e1)),
        period=2.0 * special.quarter_period(m1) / rate if rate > 0.0 else math.inf,
        m1=m1,
        rate=rate,
        start=_argument(start, (d1 + d2, e1 + e2), _lag(start, d3), m1),
        depths=(d1, d2, d3),
        heights=(e1, e2, 2.0 + d3),
    )


def tilt(
    t: ArrayLike, omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> Array:
    """Tilt of the axis of a top from any initial state, at any time.

    Args:
        t: times, any shape [s].
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        theta, of the shape of t [rad].

    Raises:
        ValueError: as `nutation`.

    Source: Whittaker, ch. VI.
    """
    swing = nutation(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl)
    sn, cn, _ = special.jacobi(swing.argument(t), swing.m1)
    from_top, from_bottom = (
        np.sqrt(first * cn * cn + second * sn * sn)
        for first, second, _ in (swing.depths, swing.heights)
    )
    return np.asarray(2.0 * np.arctan2(from_top, from_bottom))


def _turning_points(start: _Start) -> tuple[tuple[float, float], tuple[float, float], float]:
    """1 - u and 1 + u at u1 and at u2, with the start between them, and u3 - 1.

    Each root is taken from the nearer pole.
    """
    up, down = start.upright.here, start.hanging.here
    third, d2, d1 = _cubic_roots(*start.upright.cubic)
    e1, e2, _ = _cubic_roots(*start.hanging.cubic)
    d3 = max(-third, 0.0)
    if d1 - d2 < d2 + d3:
        d2, d1 = _double(start, d2, d1, up, d3)
        e1, e2 = _double(start, e1, e2, down, d3)
    d1, d2 = min(max(d1, up), 2.0), max(min(d2, up), 0.0)
    e1, e2 = max(min(e1, down), 0.0), min(max(e2, down), 2.0)
    lowest = (d1, 2.0 - d1) if d1 <= 1.0 else (2.0 - e1, e1)
    highest = (d2, 2.0 - d2) if d2 <= 1.0 else (2.0 - e2, e2)
    return lowest, highest, d3


def _double(
    start: _Start, low: float, high: float, here: float, beyond: float
) -> tuple[float, float]:
    """Distances at u1 and u2 near a double root, a steady precession.

    There the cubic leaves half of the digits of the gap, and
    (u0 - u1)(u2 - u0) = u'^2 / (beta (u3 - u0)) of the start gives all.
    """
    if high - low > 0.5 * (high + low):
        return low, high
    middle, lag = 0.5 * (low + high), 2.0 * _lag(start, beyond)
    gap = math.hypot(here - middle, start.climb / lag if lag > 0.0 else 0.0)
    return middle - gap, middle + gap


def _lag(start: _Start, beyond: float) -> float:
    """Rate dn of the elliptic functions at the start, sqrt(beta (u3 - u0)) / 2 [rad/s]."""
    return 0.5 * math.sqrt(start.beta * (start.upright.here + beyond))


def _argument(start: _Start, sums: tuple[float, float], lag: float, m1: float) -> float:
    """Argument at t = 0, from numbers proportional to 2 sn cn and cn^2 - sn^2 there.

    u' = 2 rate (u2 - u1) sn cn dn and 2 u = u1 + u2 - (u2 - u1)(cn^2 - sn^2), the latter counted
    from the nearer pole.
    """
    up, down = start.upright, start.hanging
    across = 2.0 * up.here - sums[0] if up.here <= down.here else sums[1] - 2.0 * down.here
    sine, cosine = start.climb, lag * across
    length = math.hypot(sine, cosine)
    if length == 0.0:
        # At rest between equal roots any argument will do; upright on the separatrix it is K.
        return special.quarter_period(m1) if m1 == 0.0 else 0.0
    cos_double = cosine / length
    if cos_double >= 0.0:
        cn = math.sqrt(0.5 * (1.0 + cos_double))
        sn = 0.5 * sine / length / cn
    else:
        sn = math.copysign(math.sqrt(0.5 * (1.0 - cos_double)), sine)
        cn = 0.5 * sine / length / sn
    return float(special.argument(sn, cn, math.sqrt(m1 * sn * sn + cn * cn)))


# Cayley-Klein parameters of the top, w + i z and x + i y of its attitude, in closed form.
#
# In Euler angles they are cos(theta / 2) exp(i (phi + psi) / 2) and sin(theta / 2)
# exp(i (phi - psi) / 2), and their phases need one elliptic integral of the third kind each,
#
#     (phi + psi)' = omega3 - a + (b + a) / (1 + u),
#     (phi - psi)' = a - omega3 + (b - a) / (1 - u).
#
# Both integrals have a pole where the axis passes a vertical. Legendre's relations between
# integrals of the third kind take it out as an arctangent, whose factor is exactly 1. Together with
# the root cos(theta / 2) or sin(theta / 2) in front, that is the smooth number p F(u) + i q G(u),
# and what remains is H of `special.cn2_integral`, bounded in all cases:
#
#     (p F + i q G) / sqrt(2 (1 + nu sn^2)) exp(i ((spin + drift) t + depth H)).
#
# So nothing special happens at the poles, beside them, or at the separatrix. With d = 1 - u,
# e = 1 + u, D = u3 - 1, span = u3 - u1 and spin = +-(omega3 - a) / 2,
#
#     w + i z: F = cn dn, G = sn, p^2 = e1, q^2 = e2 e3 / span, nu = e1 / span,
#              depth^2 = e1 e2 / (span e3), drift = (b + a) / (2 e3);
#     x + i y: F = cn, G = sn dn, p^2 = d1, q^2 = span nu, nu = d2 / D,
#              depth^2 = d1 nu / span, drift = 0, where d2 <= D, and else
#              F = dn, G = sn cn, p^2 = d1, q^2 = (d1 - d2) nu, nu = m D / d2, with the integral of
#              dn^2 instead of cn^2 and its factor^2 = d1 D / (span d2).
#
# q has the sign of b + a or b - a, and depth the other; in the last row it is reversed.
#
# Sources: Whittaker, Analytical Dynamics, ch. VI; Klein & Sommerfeld, Theorie des Kreisels, vol.
# II; DLMF 19.7(iii).

_Pair = Callable[[Array, Array, Array, float], tuple[Array, Array, Array, Array]]


@dataclass(frozen=True)
class _Wave:
    """One of the two parameters as a function of time.

    Attributes:
        swing: the nutation that it belongs to.
        pair: F, G and their derivatives, from sn, cn, dn and m.
        winds: whether F and G change their signs with each half period 2 K, if there is one.
        p: factor of F.
        q: factor of G, with the sense in which the phase turns.
        nu: minus the characteristic of H.
        spin: rate of the phase that is opposite in the other parameter [rad/s].
        drift: rest of the steady rate of the phase [rad/s].
        depth: factor of H.
        turn: constant factor, of size 1, that makes it start as the top does.
    """

    swing: Nutation
    pair: _Pair
    winds: bool
    p: float
    q: float
    nu: float
    spin: float
    drift: float
    depth: float
    turn: complex = 1.0

    def at(self, t: ArrayLike) -> tuple[special.ComplexArray, special.ComplexArray]:
        """Value, and time derivative without that of the spin, at the times t [s]."""
        swing = self.swing
        sn, cn, dn = special.jacobi(swing.argument(t), swing.m1)
        F, G, F_slope, G_slope = self.pair(sn, cn, dn, 1.0 - swing.m1)
        factor, slope = self.p * F + 1j * self.q * G, self.p * F_slope + 1j * self.q * G_slope
        under = 1.0 + self.nu * sn * sn
        growth = (1j * self.depth * cn * cn - self.nu * sn * cn * dn) / under
        turn = np.exp(1j * (self.spin * checks.array(t, "t") + self._phase(t))) / np.sqrt(
            2.0 * under
        )
        rate = swing.rate * (slope + growth * factor) + 1j * self.drift * factor
        return self.turn * factor * turn, self.turn * rate * turn

    def argument(self, t: ArrayLike) -> tuple[Array, Array]:
        """Phase at the times t, continuous: half turns, and the rest without that of the spin."""
        n, v = special.split_half_periods(self.swing.argument(t), self.swing.m1)
        F, G, _, _ = self.pair(*special.jacobi(v, self.swing.m1), 1.0 - self.swing.m1)
        rest = np.angle(self.turn) + np.arctan2(self.q * G, self.p * F) + self._phase(t)
        return self.half_turn * n, np.asarray(rest)

    @property
    def half_turn(self) -> float:
        """Half turns of the phase that each nutation adds: 1, -1 or 0."""
        return math.copysign(1.0, self.q) if self.winds else 0.0

    def per_nutation(self) -> float:
        """Angle that one nutation adds to the phase, but for turns, drift and spin [rad]."""
        end = 2.0 * special.quarter_period(self.swing.m1)
        return self.depth * float(self._bounded(np.array(end)))

    def _phase(self, t: ArrayLike) -> Array:
        """Phase of the exponential but for the spin, 0 at t = 0 [rad]."""
        u = self.swing.argument(t)
        turned = self._bounded(u) - self._bounded(np.array(self.swing.start))
        return np.asarray(self.drift * checks.array(t, "t") + self.depth * turned)

    def _bounded(self, u: Array) -> Array:
        return special.cn2_integral(u, self.nu, self.swing.m1)


def _waves(start: _Start) -> tuple[_Wave, _Wave]:
    """Find w + i z and x + i y of a motion."""
    swing = _nutation_of(start)
    wz, xy = start.cayley_klein
    # q' = q (0, omega) / 2, without the spin.
    wz_rate = 0.5 * (1j * start.a * wz - xy * start.across.conjugate())
    xy_rate = 0.5 * (wz * start.across - 1j * start.a * xy)
    return (
        _aligned(_scalar(start, swing), wz, wz_rate, start.beta),
        _aligned(_vector(start, swing), xy, xy_rate, start.beta),
    )


def _aligned(wave: _Wave, value: complex, rate: complex, weight: float) -> _Wave:
    """Give a wave the phase of its start: of the value there, and at a pole of the rate.

    The ratios of both to those of the wave are the same complex number of size 1.
    """
    (found,), (found_rate,) = wave.at([0.0])
    turn = weight * value * found.conjugate() + rate * found_rate.conjugate()
    return replace(wave, turn=complex(turn / abs(turn)) if turn else 1.0)


def _scalar(start: _Start, swing: Nutation) -> _Wave:
    """Find w + i z, which vanishes at the lower pole."""
    e1, e2, e3 = swing.heights
    span, sense = _span(swing), math.copysign(1.0, start.hanging.twist)
    return _Wave(
        swing=swing,
        pair=_far_pair,
        winds=True,
        p=math.sqrt(e1),
        q=sense * math.sqrt(e2 * e3 / span),
        nu=e1 / span,
        spin=0.5 * (start.omega3 - start.a),
        drift=0.5 * start.hanging.twist / e3,
        depth=-sense * math.sqrt(e1 * e2 / (span * e3)),
    )


def _vector(start: _Start, swing: Nutation) -> _Wave:
    """Find x + i y, which vanishes at the upper pole."""
    (d1, d2, beyond), m1 = swing.depths, swing.m1
    span, sense = _span(swing), math.copysign(1.0, start.upright.twist)
    spin, p = 0.5 * (start.a - start.omega3), math.sqrt(d1)
    if d2 <= beyond:
        nu = d2 / beyond if d2 > 0.0 else 0.0
        q, depth = sense * math.sqrt(span * nu), -sense * math.sqrt(d1 * nu / span)
        return _Wave(swing, _near_pair, m1 > 0.0, p, q, nu, spin, 0.0, depth)
    nu = (1.0 - m1) * beyond / d2
    q, depth = -sense * math.sqrt((d1 - d2) * nu), sense * math.sqrt(d1 * beyond / (span * d2))
    # Here the integral is that of dn^2 = cn^2 + m1 sn^2 over 1 + nu sn^2.
    linear = m1 / (1.0 + nu)
    drift = depth * linear * swing.rate
    return _Wave(swing, _beyond_pair, False, p, q, nu, spin, drift, depth * (1.0 - linear))


def _span(swing: Nutation) -> float:
    """u3 - u1; where it is 0, at the sleeping threshold, nothing moves and any value does."""
    return swing.depths[0] + swing.depths[2] if swing.rate > 0.0 else 1.0


def _far_pair(sn: Array, cn: Array, dn: Array, m: float) -> tuple[Array, Array, Array, Array]:
    """Pair F = cn dn, G = sn, and the derivatives of both."""
    return cn * dn, sn, -sn * (dn * dn + m * cn * cn), cn * dn


def _near_pair(sn: Array, cn: Array, dn: Array, m: float) -> tuple[Array, Array, Array, Array]:
    """Pair F = cn, G = sn dn, and the derivatives of both."""
    return cn, sn * dn, -sn * dn, cn * (dn * dn - m * sn * sn)


def _beyond_pair(sn: Array, cn: Array, dn: Array, m: float) -> tuple[Array, Array, Array, Array]:
    """Pair F = dn, G = sn cn, and the derivatives of both."""
    return dn, sn * cn, -m * sn * cn, dn * (cn * cn - sn * sn)


# Attitude, Euler angles and angular velocity of the top at any time.


def attitude(
    t: ArrayLike, omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> Array:
    """Attitude of a top from any initial state, continuous in t and equal to q0 at t = 0.

    Also where the axis passes through a vertical, and Euler's angles jump.

    Args:
        t: times, any shape [s].
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        Attitude, shape t.shape + (4,), unit (w, x, y, z), body to world.

    Raises:
        ValueError: as `nutation`.

    Source: Whittaker, ch. VI.
    """
    (wz, _), (xy, _) = (
        wave.at(t) for wave in _waves(_start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl))
    )
    q = np.stack([wz.real, xy.real, xy.imag, wz.imag], axis=-1)
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True))


def omega(
    t: ArrayLike, omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> Array:
    """Angular velocity of a top from any initial state, at any time.

    omega1 + i omega2 = 2 (conj(w + i z) (x + i y)' - (x + i y) conj(w + i z)'), and omega3 is
    constant.

    Args:
        t: times, any shape [s].
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        Angular velocity, shape t.shape + (3,) [rad/s], principal body axes.

    Raises:
        ValueError: as `nutation`.

    Source: Whittaker, ch. I (Cayley-Klein parameters) and VI.
    """
    start = _start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl)
    (wz, wz_rate), (xy, xy_rate) = (wave.at(t) for wave in _waves(start))
    across = 2.0 * (np.conj(wz) * xy_rate - xy * np.conj(wz_rate))
    axial = np.full(across.shape, start.omega3)
    return np.stack([across.real, across.imag, axial], axis=-1)


def euler_angles(
    t: ArrayLike, omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> tuple[Array, Array, Array]:
    """Nutation, precession and spin angle of a top from any initial state, unwrapped.

    phi and psi are continuous from values in [-pi, pi] at t = 0, but for jumps by pi at the moments
    when the axis passes exactly through a vertical: there phi jumps by +pi, and psi by -pi at the
    upper and +pi at the lower pole. (By -pi and so on would do as well: an axis that passes beside
    the pole turns quickly by one or the other.) Where the axis stays on the vertical only phi + psi
    (upright) or phi - psi (hanging) has a meaning.

    Args:
        t: times, any shape [s].
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        theta, in [0, pi], phi and psi, each of the shape of t [rad], z-x-z.

    Raises:
        ValueError: as `nutation`.

    Source: Whittaker, ch. VI; Goldstein, sec. 5.7.
    """
    start = _start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl)
    first, second = _waves(start)
    (wz, _), (xy, _) = first.at(t), second.at(t)
    theta = np.asarray(2.0 * np.arctan2(np.abs(xy), np.abs(wz)))
    phi, psi = _phi_and_psi(first, second, t)
    turns = np.rint(np.array(_phi_and_psi(first, second, 0.0)) / (2.0 * np.pi))
    return theta, phi - 2.0 * np.pi * turns[0], psi - 2.0 * np.pi * turns[1]


def _phi_and_psi(first: _Wave, second: _Wave, t: ArrayLike) -> tuple[Array, Array]:
    """Sum and difference of the phases of w + i z and of x + i y; what is opposite cancels."""
    (turns1, rest1), (turns2, rest2) = first.argument(t), second.argument(t)
    phi = np.pi * (turns1 + turns2) + (rest1 + rest2)
    psi = np.pi * (turns1 - turns2) + (rest1 - rest2) + 2.0 * first.spin * checks.array(t, "t")
    return phi, psi


# Precession: angle per nutation, mean rate, and the kind of path of the axis.

_Path = Literal["smooth", "cusped", "looping", "steady", "sleeping", "through_pole"]

# cos theta that moves by less counts as steady.
_STEADY = 1e-12
# A path whose precession stops this close to its highest point, as a part of all the way that
# cos theta goes, counts as cusped: seen from where it turns, the loop or wave has no size.
_CUSP = 1e-9
_ROUNDING = 8.0 * sys.float_info.epsilon


@dataclass(frozen=True)
class Precession:
    """The path of the axis on the sphere.

    Attributes:
        per_nutation: angle phi gained from one smallest tilt to the next [rad]; infinite on the way
            to upright (unless in a plane), NaN where the axis stays on the vertical.
        mean_rate: per_nutation over the period of the nutation, or its limit [rad/s].
        path: kind of the path, the first of these that fits:
            "sleeping": the axis stays on the vertical, upright or hanging.
            "through_pole": it passes exactly through the vertical.
            "steady": cos theta moves by less than 1e-12.
            "cusped": the precession stops at the highest point, or within 1e-9 of the way of
            cos theta from it.
            "looping": the precession changes its direction on the way.
            "smooth": it never does, or the axis is on the way to upright.
    """

    per_nutation: float
    mean_rate: float
    path: _Path


def precession(
    omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> Precession:
    """Find the precession of a top from any initial state.

    A jump of phi at a pole, as in `euler_angles`, is counted.

    Args:
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Raises:
        ValueError: as `nutation`.

    Source: Goldstein, sec. 5.7; Landau & Lifshitz, par. 35.
    """
    start = _start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl)
    first, second = _waves(start)
    swing, drift = first.swing, first.drift + second.drift
    path = _path(start, swing)
    if path == "sleeping":
        return Precession(math.nan, math.nan, path)
    steady = drift * swing.period if drift != 0.0 else 0.0
    turns = math.pi * (first.half_turn + second.half_turn)
    angle = turns + (first.per_nutation() + second.per_nutation() + steady)
    return Precession(angle, angle / swing.period if swing.period < math.inf else drift, path)


def _path(start: _Start, swing: Nutation) -> _Path:
    """Kind of path, from b - a u at both turning points."""
    (d1, d2, d3), (e1, e2, _) = swing.depths, swing.heights
    if start.across == 0.0 and 0.0 in (start.upright.here, start.hanging.here):
        return "sleeping"
    if e1 == 0.0 or d2 == 0.0 < d3:
        return "through_pole"
    if d2 == 0.0:  # on the way to upright phi' tends to a / 2
        return "smooth"
    way = min(d1 - d2, e2 - e1)
    if way < _STEADY:
        return "steady"
    highest, lowest = start.upright.twist + start.a * d2, start.hanging.twist - start.a * e1
    if abs(highest) <= (_CUSP * way + _ROUNDING * d2) * abs(start.a):
        return "cusped"
    return "looping" if highest * lowest < 0.0 else "smooth"


# Effective potential of the tilt, and the steady precessions at its minimum.


def effective_potential(
    theta: ArrayLike, p_phi: float, p_psi: float, *, i_perp: float, mgl: float
) -> Array:
    """Potential in which the tilt moves, I theta'^2 / 2 + V(theta) = E - p_psi^2 / (2 I3).

    V = (p_phi - p_psi cos theta)^2 / (2 I sin^2 theta) + mgl cos theta. The quotient is taken as
    ((p_phi - p_psi) cot(theta / 2) + (p_phi + p_psi) tan(theta / 2))^2 / (8 I), in which nothing
    cancels: a top that sleeps, p_phi = p_psi, has the potential mgl at theta = 0.

    Args:
        theta: tilt, any shape [rad].
        p_phi: vertical angular momentum [kg m^2/s].
        p_psi: axial angular momentum I3 omega3 [kg m^2/s].
        i_perp: transverse moment about the pivot [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        V, of the shape of theta [J]; infinite at theta = 0 unless p_phi = p_psi.

    Source: Goldstein, sec. 5.7.
    """
    checks.all_positive(i_perp=i_perp, mgl=mgl)
    checks.all_finite(p_phi=p_phi, p_psi=p_psi)
    tilt = checks.array(theta, "theta")
    sin, cos = np.sin(0.5 * tilt), np.cos(0.5 * tilt)
    with np.errstate(divide="ignore", over="ignore"):
        above = (p_phi - p_psi) * cos / sin if p_phi != p_psi else 0.0
        rate = (above + (p_phi + p_psi) * sin / cos) / i_perp
        centrifugal = 0.125 * i_perp * rate * rate
    return np.asarray(centrifugal + mgl * np.cos(tilt), dtype=np.float64)


def steady_precession(
    theta: ArrayLike, omega3: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> tuple[Array, Array]:
    """Both rates at which the top precesses without nutation.

    The roots of I cos(theta) phi'^2 - I3 omega3 phi' + mgl = 0, which has none where
    (I3 omega3)^2 < 4 I mgl cos(theta). Beyond the horizontal the roots have opposite signs.

    Args:
        theta: tilt, any shape [rad].
        omega3: axial angular velocity, broadcast with theta [rad/s].
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        The slow rate, near mgl / (I3 omega3) for a fast top, and the fast one, near
        I3 omega3 / (I cos(theta)), infinite at the horizontal [rad/s]. NaN where none exists.

    Source: Goldstein, sec. 5.7; Landau & Lifshitz, par. 35.
    """
    checks.all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    spin, fall = i3 / i_perp * checks.array(omega3, "omega3"), mgl / i_perp  # in units of I
    level = np.cos(checks.array(theta, "theta"))
    # Both roots from the one sum that does not cancel.
    with np.errstate(divide="ignore", invalid="ignore"):
        total = spin + np.copysign(np.sqrt(spin * spin - 4.0 * level * fall), spin)
        slow, fast = 2.0 * fall / total, total / (2.0 * level)
    return np.asarray(slow, dtype=np.float64), np.asarray(fast, dtype=np.float64)


def nutation_frequency(
    theta: ArrayLike, precession: ArrayLike, omega3: ArrayLike, *, i_perp: float, i3: float
) -> Array:
    """Angular frequency of small nutation about a steady precession [rad/s].

    sqrt((phi' sin theta)^2 + (I3 omega3 / I - 2 phi' cos theta)^2): the curvature of the effective
    potential at its minimum, over I.

    Args:
        theta: tilt, any shape [rad].
        precession: phi', a root of `steady_precession` at that tilt, NaN included [rad/s].
        omega3: axial angular velocity [rad/s].
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].

    Returns:
        The frequency, of the common shape of theta, precession and omega3 [rad/s].

    Source: Whittaker, ch. VI.
    """
    checks.all_positive(i_perp=i_perp, i3=i3)
    theta, rate = checks.array(theta, "theta"), checks.real_numbers(precession, "precession")
    spin = i3 / i_perp * checks.array(omega3, "omega3")
    frequency = np.hypot(rate * np.sin(theta), spin - 2.0 * rate * np.cos(theta))
    return np.asarray(frequency, dtype=np.float64)


def steady_threshold(theta: ArrayLike, *, i_perp: float, i3: float, mgl: float) -> Array:
    """Axial rate from which a top can precess steadily at a tilt: 2 sqrt(I mgl cos theta) / I3.

    0 from the horizontal on, where it can at any rate. Upright it is the sleeping threshold.

    Args:
        theta: tilt, any shape [rad].
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        Smallest abs(omega3), of the shape of theta [rad/s].

    Source: Goldstein, sec. 5.7.
    """
    checks.all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    level = np.maximum(np.cos(checks.array(theta, "theta")), 0.0)
    return np.asarray(2.0 * np.sqrt(mgl / i_perp * level) / (i3 / i_perp), dtype=np.float64)


# The sleeping top: stability threshold, exponents, homoclinic motion.


def sleeping_threshold(*, i_perp: float, i3: float, mgl: float) -> float:
    """Axial rate above which an upright top sleeps: I3^2 omega3^2 = 4 I mgl [rad/s].

    Args:
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Source: Goldstein, sec. 5.7.
    """
    checks.all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    return 2.0 * math.sqrt(mgl / i_perp) / (i3 / i_perp)


def sleeping_exponents(
    omega3: float, *, i_perp: float, i3: float, mgl: float
) -> tuple[complex, complex]:
    """Exponents s of the small tilt z = theta exp(i phi) = exp(s t) of an upright top.

    From I z'' - i I3 omega3 z' - mgl z = 0: s = i b +- sqrt(mgl / I - b^2), b = I3 omega3 / (2 I).
    The real part is a growth rate, the imaginary part a precession.

    Args:
        omega3: axial angular velocity [rad/s].
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        Below the threshold the growing and the decaying exponent; from it on the slow and the fast
        precession, both imaginary [1/s].

    Source: Goldstein, sec. 5.7; Whittaker, ch. VI.
    """
    checks.all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    half, fall = i3 * checks.number(omega3, "omega3") / (2.0 * i_perp), math.sqrt(mgl / i_perp)
    excess = (abs(half) - fall) * (abs(half) + fall)
    if excess < 0.0:
        growth = math.sqrt(-excess)
        return complex(growth, half), complex(-growth, half)
    fast = half + math.copysign(math.sqrt(excess), half)
    return complex(0.0, fall * fall / fast), complex(0.0, fast)


def homoclinic_tilt(t: ArrayLike, omega3: float, *, i_perp: float, i3: float, mgl: float) -> Array:
    """Tilt on the homoclinic orbit of the upright top, which takes infinite time either way.

    sin(theta / 2) = sqrt(1 - c) sech(lambda t), with c = (I3 omega3)^2 / (4 I mgl) < 1 and lambda
    the growth rate of `sleeping_exponents`; largest at t = 0.

    Args:
        t: time after the largest tilt, any shape [s].
        omega3: axial angular velocity, below the sleeping threshold [rad/s].
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        theta, of the shape of t [rad].

    Raises:
        ValueError: omega3 is at or above the threshold, where an upright top does not fall.

    Source: Whittaker, ch. VI: the cubic with a double root at the vertical.
    """
    threshold = sleeping_threshold(i_perp=i_perp, i3=i3, mgl=mgl)
    below = abs(checks.number(omega3, "omega3")) < threshold
    checks.require(below, omega3, "omega3", f"below the threshold {threshold} [rad/s]")
    ratio = abs(omega3) / threshold
    growth = sleeping_exponents(omega3, i_perp=i_perp, i3=i3, mgl=mgl)[0].real
    _, sech, _ = special.jacobi(growth * checks.array(t, "t"), 0.0)
    return 2.0 * np.arcsin(math.sqrt((1.0 - ratio) * (1.0 + ratio)) * sech)


# The fast top: precession and nutation to first order in the weight.


@dataclass(frozen=True)
class FastTop:
    """Motion of a fast top whose axis is let go at rest.

    Attributes:
        precession: mean rate, mgl / (I3 omega3) [rad/s].
        nutation: angular frequency, I3 omega3 / I [rad/s].
        amplitude: of the nutation, half of theta_max - theta_min, I mgl sin theta / (I3 omega3)^2
            [rad].
    """

    precession: Array
    nutation: Array
    amplitude: Array


def fast_top(
    theta: ArrayLike, omega3: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> FastTop:
    """Approximate the motion of a fast top, (I3 omega3)^2 much above 4 I mgl.

    Relative errors are of the order of I mgl / (I3 omega3)^2.

    Args:
        theta: tilt at which the axis is let go, any shape [rad].
        omega3: axial angular velocity, not 0, broadcast with theta [rad/s].
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Returns:
        Rates of the common shape of theta and omega3.

    Raises:
        ValueError: an omega3 of 0, a parameter that is not positive, or a number not finite.

    Source: Goldstein, sec. 5.7, "the fast top".
    """
    checks.all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    tilt, rates = np.broadcast_arrays(checks.array(theta, "theta"), checks.array(omega3, "omega3"))
    checks.require(rates != 0.0, rates, "omega3", "a spin other than 0 [rad/s]")
    spin, fall = i3 / i_perp * rates, mgl / i_perp  # in units of I
    return FastTop(
        precession=fall / spin,
        nutation=np.abs(spin),
        amplitude=fall * np.sin(tilt) / (spin * spin),
    )
