"""Stability thresholds of an upright rolling disk and of a spinning coin."""

import cmath
import math

from rigid_envs.analytic.rolling_disk._disk import disk_of
from rigid_envs.checks import all_positive, number, positive

__all__ = ["rolling_exponent", "rolling_threshold", "spinning_exponent", "spinning_threshold"]


def rolling_threshold(*, m: float, radius: float, i_perp: float, i3: float, g: float) -> float:
    """Least rate at which an upright disk rolls straight on without falling [rad/s].

    omega3^2 = A m g radius / (C (C + m radius^2)); the speed radius omega3 is then
    sqrt(g radius / 3) for a disk and sqrt(g radius / 4) for a hoop.

    Args:
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive.

    Source: Routh, Advanced Part, par. 244; Bloch, Nonholonomic Mechanics and Control, sec. 1.5.
    """
    positive(g, "g")
    disk = disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)
    return math.sqrt(disk.i_perp / (disk.i3 * disk.axial)) * math.sqrt(g / radius)


def spinning_threshold(*, m: float, radius: float, i_perp: float, g: float) -> float:
    """Least rate at which a coin spins about a vertical diameter without falling [rad/s].

    phi'^2 = m g radius / (A + m radius^2).

    Args:
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive.

    Source: Routh, Advanced Part, par. 244.
    """
    all_positive(m=m, radius=radius, i_perp=i_perp, g=g)
    return math.sqrt(m * g * radius / (i_perp + m * radius * radius))


def rolling_exponent(
    omega3: float, *, m: float, radius: float, i_perp: float, i3: float, g: float
) -> complex:
    """Exponent lambda of a small lean of a disk that rolls upright [1/s].

    lambda^2 = B C / (A J) (threshold^2 - omega3^2): real below the threshold, where the lean grows
    as exp(lambda t), and imaginary above, where the disk wobbles at the frequency abs(lambda).

    Args:
        omega3: rate of rolling [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive, or omega3 not finite.

    Source: Routh, Advanced Part, par. 244.
    """
    least = rolling_threshold(m=m, radius=radius, i_perp=i_perp, i3=i3, g=g)
    disk = disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)
    factor = disk.i3 * disk.axial / (disk.i_perp * disk.tipping)
    return _exponent(factor, least, number(omega3, "omega3"))


def spinning_exponent(
    phi_rate: float, *, m: float, radius: float, i_perp: float, g: float
) -> complex:
    """Exponent lambda of a small lean of a coin that spins about a vertical diameter [1/s].

    lambda^2 = threshold^2 - phi'^2.

    Args:
        phi_rate: rate of spinning [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter that is not positive, or phi_rate not finite.

    Source: Routh, Advanced Part, par. 244.
    """
    least = spinning_threshold(m=m, radius=radius, i_perp=i_perp, g=g)
    return _exponent(1.0, least, number(phi_rate, "phi_rate"))


def _exponent(factor: float, threshold: float, rate: float) -> complex:
    """Root of factor (threshold^2 - rate^2), the difference taken without cancellation."""
    return cmath.sqrt(factor * (threshold - rate) * (threshold + rate))
