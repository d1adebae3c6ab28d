"""Nutation: the tilt of the top at any time, by Jacobi elliptic functions."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import elliptic
from rigid_envs.analytic.heavy_top._cubic import cubic_roots
from rigid_envs.analytic.heavy_top._start import Start, start_of
from rigid_envs.checks import Array, array

__all__ = ["Nutation", "nutation", "nutation_of", "tilt"]


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
        return self.start + self.rate * array(t, "t")


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
    return nutation_of(start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl))


def nutation_of(start: Start) -> Nutation:
    """Nutation of a start that has been checked."""
    (d1, e1), (d2, e2), d3 = _turning_points(start)
    span = d1 + d3
    moves = span > elliptic.SMALLEST
    rate = 0.5 * math.sqrt(start.beta * span) if moves else 0.0
    m1 = min((d2 + d3) / span, 1.0) if moves else 1.0
    m1 = m1 if m1 > elliptic.SMALLEST else 0.0
    return Nutation(
        theta_min=2.0 * math.atan2(math.sqrt(d2), math.sqrt(e2)),
        theta_max=2.0 * math.atan2(math.sqrt(d1), math.sqrt(e1)),
        period=2.0 * elliptic.quarter_period(m1) / rate if rate > 0.0 else math.inf,
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
    sn, cn, _ = elliptic.jacobi(swing.argument(t), swing.m1)
    from_top, from_bottom = (
        np.sqrt(first * cn * cn + second * sn * sn)
        for first, second, _ in (swing.depths, swing.heights)
    )
    return np.asarray(2.0 * np.arctan2(from_top, from_bottom))


def _turning_points(start: Start) -> tuple[tuple[float, float], tuple[float, float], float]:
    """1 - u and 1 + u at u1 and at u2, with the start between them, and u3 - 1.

    Each root is taken from the nearer pole.
    """
    up, down = start.upright.here, start.hanging.here
    third, d2, d1 = cubic_roots(*start.upright.cubic)
    e1, e2, _ = cubic_roots(*start.hanging.cubic)
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
    start: Start, low: float, high: float, here: float, beyond: float
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


def _lag(start: Start, beyond: float) -> float:
    """Rate dn of the elliptic functions at the start, sqrt(beta (u3 - u0)) / 2 [rad/s]."""
    return 0.5 * math.sqrt(start.beta * (start.upright.here + beyond))


def _argument(start: Start, sums: tuple[float, float], lag: float, m1: float) -> float:
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
        return elliptic.quarter_period(m1) if m1 == 0.0 else 0.0
    cos_double = cosine / length
    if cos_double >= 0.0:
        cn = math.sqrt(0.5 * (1.0 + cos_double))
        sn = 0.5 * sine / length / cn
    else:
        sn = math.copysign(math.sqrt(0.5 * (1.0 - cos_double)), sine)
        cn = 0.5 * sine / length / sn
    return float(elliptic.argument(sn, cn, math.sqrt(m1 * sn * sn + cn * cn)))
