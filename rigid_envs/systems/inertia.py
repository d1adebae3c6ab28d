"""Checks of moments and inertia ratios: those that a distribution of mass can have.

Each condition is monotone in every parameter by itself, so that it holds throughout ranges of
parameters if it holds at all their corners.
"""

import math

from rigid_envs.checks import number, positive, require

__all__ = ["axial_moment", "ball_ratio", "pivot_distance", "principal_moments"]

_ROUNDING = 1e-9  # relative; admits moments written with ten digits


def principal_moments(I1: float, I2: float, I3: float) -> None:
    """Refuse moments that no distribution of mass has.

    Each moment is at most the sum of the other two (Landau & Lifshitz, *Mechanics*, section 32).

    Raises:
        ValueError: a moment that is not positive, or that breaks the triangle inequality by more
            than rounding.
    """
    moments = {"I1": I1, "I2": I2, "I3": I3}
    for name, value in moments.items():
        positive(value, name, "kg m^2")
    for name, value in moments.items():
        others = " + ".join(other for other in moments if other != name)
        rest = I1 + I2 + I3 - value
        expected = f"{name} <= {others} = {rest:.9g}: no rigid body has such principal moments"
        excess = 2.0 * value - (I1 + I2 + I3)
        require(bool(excess <= _ROUNDING * value), value, name, expected)


def pivot_distance(I1: float, I2: float, I3: float, m: float, ell: float) -> None:
    """Refuse a centre of mass so far along e3 that moments about the pivot leave none about it.

    Those about the centre of mass are I1 - m ell^2, I2 - m ell^2 and I3 (Steiner). As the moments
    about the pivot are those of a body, I3 <= I1 + I2 - 2 m ell^2 is all that is left to ask: signs
    and the other two inequalities follow. Equality is a lamina, or a rod on its end if I3 is small.

    Raises:
        ValueError: the inequality is broken by more than rounding.
    """
    room = I1 + I2 - I3
    longest = math.sqrt(max(room, 0.0) / 2.0 / m)
    expected = (
        f"at most sqrt((I1 + I2 - I3) / (2 m)) = {longest:.9g} m: I1 and I2 are about the pivot, "
        "m ell^2 more than about the centre of mass"
    )
    require(bool(2.0 * m * ell * ell <= room + _ROUNDING * (I1 + I2)), ell, "ell", expected)


def axial_moment(I3: float, m: float, radius: float) -> None:
    """Refuse moments about the axis of what rolls on its rim: no mass lies beyond the rim.

    It would pass below the plane when the axis is level.

    Raises:
        ValueError: above m radius^2, which is a hoop, by more than rounding.
    """
    rim = m * radius * radius
    expected = (
        f"at most m radius^2 = {rim:.9g} kg m^2, all mass on the rim: RollingDisk.uniform and "
        "RollingDisk.hoop fit the moments to mass and radius"
    )
    require(bool(I3 <= rim * (1.0 + _ROUNDING)), I3, "I3", expected)


def ball_ratio(beta: float) -> None:
    """Refuse ratios I / (m radius^2) that no ball has: all mass lies within the radius.

    Raises:
        ValueError: not between 0 and 2/3.
    """
    expected = (
        "I / (m radius^2) of a ball, between 0 (all mass at the centre) and 2/3 (all on the "
        "surface)"
    )
    require(0.0 <= number(beta, "beta") <= 2.0 / 3.0 + _ROUNDING, beta, "beta", expected)
