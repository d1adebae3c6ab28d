"""Nutation: the tilt of the top at any time, by Jacobi elliptic functions."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import elliptic
from rigid_envs.analytic._inputs import FloatArray, finite, positive, unit_quaternion, vector

__all__ = ["Nutation", "nutation", "tilt"]


@dataclass(frozen=True)
class Nutation:
    """The oscillation of the tilt between its two turning points.

    cos theta = u1 cn^2 + u2 sn^2 of the argument start + rate t, u1 <= u2 <= u3 being the roots of
    the cubic (1 - u^2)(alpha - beta u) - (b - a u)^2.

    Attributes:
        theta_min: smallest tilt [rad].
        theta_max: largest tilt [rad].
        period: time from one smallest tilt to the next [s]; infinite on the way to upright.
        m1: complementary parameter (u3 - u2) / (u3 - u1) of the elliptic functions.
        rate: sqrt(beta (u3 - u1)) / 2 [rad/s].
        start: argument at t = 0.
        from_below: whether distances are counted from hanging (1 + u) instead of upright (1 - u).
        distances: that distance at u1 and at u2, exact where it is small.
    """

    theta_min: float
    theta_max: float
    period: float
    m1: float
    rate: float
    start: float
    from_below: bool
    distances: tuple[float, float]


def nutation(omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float) -> Nutation:
    """Find turning points and period of the nutation of a top started anyhow.

    The cubic is taken in the distance d = 1 - u from the vertical (1 + u below the horizontal),
    and its coefficients from the state instead of the momenta: so a tilt of 1e-12 keeps its digits.
    (Exactly at the sleeping threshold tilts below 1e-8 do not: the rounding of the spin decides.)

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
    positive(i_perp=i_perp, i3=i3, mgl=mgl)
    w1, w2, w3 = vector("omega0", omega0, 3).tolist()
    qw, qx, qy, qz = unit_quaternion("q0", q0).tolist()
    # gamma = R^T e_z; its third component is u.
    gamma1, gamma2 = 2.0 * (qx * qz - qw * qy), 2.0 * (qy * qz + qw * qx)
    upright, hanging = 2.0 * (qx * qx + qy * qy), 2.0 * (qw * qw + qz * qz)
    side, here = (1.0, upright) if upright <= hanging else (-1.0, hanging)
    a, beta = i3 * w3 / i_perp, 2.0 * mgl / i_perp
    # alpha - beta u = energy + side beta d and b - a u = twist + side a d.
    energy = w1 * w1 + w2 * w2 - side * beta * here
    twist = gamma1 * w1 + gamma2 * w2 - side * a * here
    roots = _cubic_roots(
        side * (energy + a * a) / beta - 2.0,
        2.0 * (a * twist - side * energy) / beta,
        side * twist * twist / beta,
    )
    climb = gamma1 * w2 - gamma2 * w1
    third, d2, d1, lag = _turning_points(roots, side, here, climb, beta)
    span = abs(d1 - third)
    rate = 0.5 * math.sqrt(beta * span)
    m1 = min(abs(d2 - third) / span, 1.0) if span > 0.0 else 1.0
    return Nutation(
        theta_min=float(_tilt_at(d2, side < 0.0)),
        theta_max=float(_tilt_at(d1, side < 0.0)),
        period=2.0 * elliptic.quarter_period(m1) / rate if rate > 0.0 else math.inf,
        m1=m1,
        rate=rate,
        start=_start(climb, lag * side * (2.0 * here - d1 - d2), m1),
        from_below=side < 0.0,
        distances=(d1, d2),
    )


def tilt(
    t: ArrayLike, omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> FloatArray:
    """Tilt of the axis of a top started anyhow, at any time.

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
    u = swing.start + swing.rate * finite("t", t)
    sn, cn, _ = elliptic.jacobi(u, swing.m1)
    d1, d2 = swing.distances
    return _tilt_at(d1 * cn * cn + d2 * sn * sn, swing.from_below)


def _turning_points(
    roots: tuple[float, float, float], side: float, here: float, climb: float, beta: float
) -> tuple[float, float, float, float]:
    """Distances at u3, u2 and u1, with the start between the last two; and rate dn at the start.

    Near a double root, a steady precession, the cubic leaves half of the digits of the gap: there
    (u0 - u1)(u2 - u0) = u'^2 / (beta (u3 - u0)) of the start gives all.
    """
    third, d2, d1 = roots if side > 0.0 else roots[::-1]
    lag = 0.5 * math.sqrt(beta * abs(here - third))
    if abs(d1 - d2) < 0.5 * (d1 + d2):
        middle = 0.5 * (d1 + d2)
        gap = math.copysign(math.hypot(here - middle, 0.5 * climb / lag), side)
        d1, d2 = middle + gap, middle - gap
    low, high = max(min(d1, d2, here), 0.0), min(max(d1, d2, here), 2.0)
    return (third, low, high, lag) if side > 0.0 else (third, high, low, lag)


def _tilt_at(distance: ArrayLike, from_below: bool) -> FloatArray:
    """Tilt from 1 - cos theta, or from 1 + cos theta, exact at both ends [rad]."""
    near, far = np.sqrt(distance), np.sqrt(np.maximum(2.0 - np.asarray(distance), 0.0))
    return np.asarray(2.0 * (np.arctan2(far, near) if from_below else np.arctan2(near, far)))


def _start(sine: float, cosine: float, m1: float) -> float:
    """Argument at t = 0, from numbers proportional to 2 sn cn and cn^2 - sn^2."""
    length = math.hypot(sine, cosine)
    if length == 0.0:
        # At rest between equal roots any argument will do; upright on the separatrix it is K.
        return elliptic.quarter_period(m1) if m1 == 0.0 else 0.0
    cos_double = cosine / length
    if cos_double >= 0.0:
        cn = math.sqrt(0.5 * (1.0 + cos_double))
        sn = 0.5 * sine / length / cn
    else:
        sn = math.copysign(math.sqrt(0.5 * (1.0 - cos_double)), sine)
        cn = 0.5 * sine / length / sn
    return float(elliptic.argument(sn, cn, math.sqrt(m1 * sn * sn + cn * cn)))


def _cubic_roots(c2: float, c1: float, c0: float) -> tuple[float, float, float]:
    """Roots, ascending, of d^3 + c2 d^2 + c1 d + c0 that has three real ones.

    The lone root by Viete's cosine and Newton's step, the pair from the quadratic that is left,
    divided out from the end at which nothing cancels: small roots keep their relative accuracy.
    """
    centre, square = -c2 / 3.0, c2 * c2 / 9.0 - c1 / 3.0
    radius = math.sqrt(max(square, 0.0))
    bias = centre**3 - 0.5 * (c1 * centre + c0)
    ratio = min(abs(bias) / radius**3, 1.0) if radius > 0.0 else 0.0
    root = centre + 2.0 * math.copysign(radius, bias) * math.cos(math.acos(ratio) / 3.0)
    for _ in range(3):
        slope = (3.0 * root + 2.0 * c2) * root + c1
        root -= (((root + c2) * root + c1) * root + c0) / slope if slope else 0.0
    if abs(root) ** 3 > abs(c0):
        product = -c0 / root
        half_sum = 0.5 * (c1 - product) / root
    else:
        half_sum = -0.5 * (c2 + root)
        product = c1 - 2.0 * half_sum * root
    gap = math.sqrt(max(half_sum * half_sum - product, 0.0))
    outer = half_sum + math.copysign(gap, half_sum)
    inner = product / outer if outer else 0.0
    low, middle, high = sorted((root, inner, outer))
    return low, middle, high
