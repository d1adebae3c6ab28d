"""Checks of principal moments and inertia ratios: those that a distribution of mass can have."""

from rigid_envs.checks import number, positive, require

__all__ = ["ball_ratio", "principal_moments"]

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
