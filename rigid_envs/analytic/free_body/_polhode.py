"""Angular velocity of a free body by Jacobi elliptic functions.

The trick that makes one formula serve all cases is a *normal frame*: a proper rotation of the
principal axes that puts the axis that omega circulates about third, the intermediate axis second,
and makes the first and third components of omega0 non-negative. There, with moments J1, J2, J3,

    omega = (a1 cn u, a2 sn u, a3 dn u),    u = u0 + p t,    0 <= m <= 1.

No digit of the input is lost near the separatrix: amplitudes and m are sums of terms of one sign
and products, and the one difference, which is 1 - m, is taken exactly.

Source: Landau & Lifshitz, Mechanics, par. 37; Goldstein, Classical Mechanics, ch. 5.
"""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import elliptic
from rigid_envs.checks import Array, array, exact_array, positive_array, require

__all__ = ["Polhode", "omega", "polhode"]


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
        return 2.0 * elliptic.quarter_period(self.m1) / abs(self.rate) if self.rate else math.inf

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
        times = array(t, "t")
        with np.errstate(over="ignore"):
            turned = self.rate * times
        expected = f"times with a finite phase at {self.rate:.9g} rad/s [s]"
        require(np.isfinite(turned), times, "t", expected)
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
    inertia = positive_array(moments, "moments", "kg m^2", 3)
    rates = exact_array(omega0, "omega0", 3)
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
        m=j1 * abs(j2 - j1) * a1 * a1 / scale if scale else 0.0,
        m1=min(m1, 1.0) if m1 > elliptic.SMALLEST else 0.0,
        rate=math.copysign(size * a3 * math.sqrt((j3 - j2) * (j3 - j1) / (j1 * j2)), j3 - j2),
        start=float(elliptic.argument(sn, cn, dn)),
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
    sn, cn, dn = elliptic.jacobi(path.argument(t), path.m1)
    return path.to_body(np.stack([cn, sn, dn], axis=-1) * np.array(path.amplitudes))


def _power_of_two(values: Array) -> float:
    """The size of the largest: divided by it squares stay in range, and no digit changes."""
    return 2.0 ** (math.frexp(float(np.max(np.abs(values))))[1] - 1)


def _momentum(inertia: Array, rates: Array, heft: float, size: float) -> float:
    """Magnitude of the angular momentum [kg m^2/s], refused where it is no normal number."""
    momentum = heft * (size * float(np.linalg.norm((inertia / heft) * (rates / size))))
    normal = not np.any(rates) or np.finfo(np.float64).tiny <= momentum < math.inf
    expected = "an angular momentum within double precision: choose other units"
    require(bool(normal), rates, "omega0", expected)
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
