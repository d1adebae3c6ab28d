"""Rates of a free body near its steady rotations."""

import math

from numpy.typing import ArrayLike

from rigid_envs.checks import number, positive_array

__all__ = ["growth_rate", "oscillation_rates"]


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
    return abs(number(spin, "spin")) * math.sqrt((b - a) / a * ((c - b) / c))


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
    size = abs(number(spin, "spin"))
    smallest, largest = (b - a) / b * ((c - a) / c), (c - a) / a * ((c - b) / b)
    return size * math.sqrt(smallest), size * math.sqrt(largest)


def _ascending(moments: ArrayLike) -> tuple[float, float, float]:
    """Principal moments, checked and sorted."""
    inertia = positive_array(moments, "moments", "kg m^2", 3)
    a, b, c = sorted(float(x) for x in inertia)
    return a, b, c
