"""Rolling along a clothoid, whose curvature grows with the arc length: Landau and Zener's ball.

At finite times the attitude is a Kummer function of complex order; what is elementary is the path,
and how far the complete clothoid, from one eye to the other, tips the ball.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fresnel

from rigid_envs.checks import Array, all_positive, array, number, require

__all__ = ["clothoid_path", "complete_clothoid_angle"]


def clothoid_path(t: ArrayLike, *, speed: float, heading_acceleration: float) -> Array:
    """Path of a centre with constant speed and the heading k t^2 / 2 from world x.

    x + i y = speed sqrt(pi / k) (C(z) + i S(z)),  z = t sqrt(k / pi), mirrored for k < 0.

    Args:
        t: times, negative ones included, any shape [s].
        speed: of the centre [m/s].
        heading_acceleration: k, not 0 [rad/s^2].

    Returns:
        Displacement of the centre since t = 0, shape t.shape + (2,) [m], world.

    Raises:
        ValueError: heading_acceleration is 0, or a number is not finite.

    Source: DLMF 7.2(iii), 7.20(ii).
    """
    k, v = number(heading_acceleration, "heading_acceleration"), number(speed, "speed")
    expected = "a number other than 0 [rad/s^2]: use roll_straight instead"
    require(k != 0.0, heading_acceleration, "heading_acceleration", expected)
    scale = math.sqrt(math.pi / abs(k))
    sine, cosine = fresnel(array(t, "t") / scale)
    return np.asarray(v * scale * np.stack([cosine, math.copysign(1.0, k) * sine], axis=-1))


def complete_clothoid_angle(*, speed: float, heading_acceleration: float, radius: float) -> float:
    """Angle by which a ball is tipped that rolls a whole clothoid, t from -inf to inf [rad].

    cos(angle / 2) = exp(-pi (speed / radius)^2 / (4 k)), so that the 33 element of the turn is
    2 exp(-pi (speed / radius)^2 / (2 k)) - 1. The axis of the turn tends to the horizontal, but in
    no direction: that drifts with the logarithm of the time.

    Args:
        speed: of the centre, without spin about the vertical [m/s].
        heading_acceleration: k of the heading k t^2 / 2, positive [rad/s^2].
        radius: of the ball [m].

    Raises:
        ValueError: a number that is not positive.

    Source: Zener (1932), Proc. R. Soc. A 137:696, doi:10.1098/rspa.1932.0165; Rojo & Bloch (2010),
        The rolling sphere, the quantum spin and a simple view of the Landau-Zener problem,
        arXiv:0906.2934.
    """
    all_positive(speed=speed, heading_acceleration=heading_acceleration, radius=radius)
    exponent = -0.5 * math.pi * (speed / radius) ** 2 / heading_acceleration
    return 2.0 * math.atan2(math.sqrt(-math.expm1(exponent)), math.exp(0.5 * exponent))
