"""A wheel on level ground, and the cycloid that a point of its rim draws."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array, array, number, positive

__all__ = ["cycloid_arch_length", "roll_wheel"]


def roll_wheel(t: ArrayLike, *, radius: float, omega: float) -> tuple[Array, Array]:
    """Paths of a uniformly rolling wheel's centre, and of the rim point that starts on the ground.

    x_centre = radius omega t, and the cycloid with its cusps on the ground

        x = radius (angle - sin(angle)),  y = radius (1 - cos(angle)),  angle = omega t.

    Args:
        t: times, any shape [s].
        radius: of the wheel [m].
        omega: angular velocity, positive where the wheel rolls towards +x [rad/s].

    Returns:
        x of the centre, of the shape of t [m], and the rim point (x, height above the ground),
        shape t.shape + (2,) [m].

    Raises:
        ValueError: a radius that is not positive, or a number that is not finite.

    Source: Goldstein, Classical Mechanics, sec. 1.3; Whittaker, Analytical Dynamics, ch. I.
    """
    positive(radius, "radius")
    angle = number(omega, "omega") * array(t, "t")
    centre = radius * angle
    # 1 - cos = 2 sin^2(angle / 2) keeps the digits of the height beside the cusp.
    height = 2.0 * radius * np.sin(0.5 * angle) ** 2
    return centre, np.stack([centre - radius * np.sin(angle), height], axis=-1)


def cycloid_arch_length(radius: float) -> float:
    """Length of the path of a rim point from ground to ground, 8 radius [m].

    Args:
        radius: of the wheel [m].

    Raises:
        ValueError: a radius that is not positive.

    Source: Wren (1658), in Wallis, De Cycloide.
    """
    positive(radius, "radius")
    return 8.0 * radius
