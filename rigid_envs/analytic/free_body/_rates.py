"""Rates of a free body near its steady rotations, and of the free symmetric top."""

import math

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic._inputs import finite, positive, vector

__all__ = ["growth_rate", "oscillation_rates", "symmetric_rates"]


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
    return abs(float(finite("spin", spin))) * math.sqrt((b - a) * (c - b) / (a * c))


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
    size = abs(float(finite("spin", spin)))
    smallest, largest = (b - a) * (c - a) / (b * c), (c - a) * (c - b) / (a * b)
    return size * math.sqrt(smallest), size * math.sqrt(largest)


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
    inertia, rates = vector("moments", moments, 3), vector("omega0", omega0, 3)
    positive(moments=inertia)
    axis = next((k for k in (2, 1, 0) if inertia[k - 2] == inertia[k - 1]), None)
    if axis is None:
        raise ValueError(f"moments are {inertia.tolist()}; expected two equal: use polhode instead")
    axial, transverse = float(inertia[axis]), float(inertia[axis - 1])
    momentum = float(np.linalg.norm(inertia * rates))
    return (axial - transverse) / transverse * float(rates[axis]), momentum / transverse


def _ascending(moments: ArrayLike) -> tuple[float, float, float]:
    """Principal moments, checked and sorted."""
    inertia = vector("moments", moments, 3)
    positive(moments=inertia)
    a, b, c = sorted(float(x) for x in inertia)
    return a, b, c
