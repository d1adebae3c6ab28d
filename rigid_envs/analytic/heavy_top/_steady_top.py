"""Effective potential of the tilt, and the steady precessions at its minimum."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array, all_finite, all_positive, array, real_numbers

__all__ = [
    "effective_potential",
    "nutation_frequency",
    "steady_precession",
    "steady_threshold",
]


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
    all_positive(i_perp=i_perp, mgl=mgl)
    all_finite(p_phi=p_phi, p_psi=p_psi)
    tilt = array(theta, "theta")
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
    all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    spin, fall = i3 / i_perp * array(omega3, "omega3"), mgl / i_perp  # in units of I
    level = np.cos(array(theta, "theta"))
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
    all_positive(i_perp=i_perp, i3=i3)
    theta, rate = array(theta, "theta"), real_numbers(precession, "precession")
    spin = i3 / i_perp * array(omega3, "omega3")
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
    all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    level = np.maximum(np.cos(array(theta, "theta")), 0.0)
    return np.asarray(2.0 * np.sqrt(mgl / i_perp * level) / (i3 / i_perp), dtype=np.float64)
