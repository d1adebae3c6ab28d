"""The sleeping top: stability threshold, exponents, homoclinic motion."""

import math

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import elliptic
from rigid_envs.checks import Array, all_positive, array, number, require

__all__ = ["homoclinic_tilt", "sleeping_exponents", "sleeping_threshold"]


def sleeping_threshold(*, i_perp: float, i3: float, mgl: float) -> float:
    """Axial rate above which an upright top sleeps: I3^2 omega3^2 = 4 I mgl [rad/s].

    Args:
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Source: Goldstein, sec. 5.7.
    """
    all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
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
    all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    half, fall = i3 * number(omega3, "omega3") / (2.0 * i_perp), math.sqrt(mgl / i_perp)
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
    below = abs(number(omega3, "omega3")) < threshold
    require(below, omega3, "omega3", f"below the threshold {threshold} [rad/s]")
    ratio = abs(omega3) / threshold
    growth = sleeping_exponents(omega3, i_perp=i_perp, i3=i3, mgl=mgl)[0].real
    _, sech, _ = elliptic.jacobi(growth * array(t, "t"), 0.0)
    return 2.0 * np.arcsin(math.sqrt((1.0 - ratio) * (1.0 + ratio)) * sech)
