"""Constants of a top's motion from its initial state, in exact arithmetic.

Whether the axis passes the vertical at 1e-17 rad or through it, on which side, and whether a top
ever comes back down hang on differences of large numbers: b - a, b + a and E - mgl. Here they are
taken in rational numbers from the doubles given, and rounded once.
"""

import math
from dataclasses import dataclass
from fractions import Fraction

from numpy.typing import ArrayLike

from rigid_envs.analytic import _quaternion
from rigid_envs.checks import all_positive, exact_array, require

__all__ = ["Invariants", "Pole", "Start", "invariants", "start_of"]

# Tilts and transverse rates whose fourth powers, in the cubic, underflow are taken as 0.
_SMALLEST = 1e-75


@dataclass(frozen=True)
class Pole:
    """Initial state relative to one pole, with distances d = 1 - u from upright, or 1 + u.

    Attributes:
        side: +1 for upright, -1 for hanging.
        here: d at the start.
        twist: b - a for upright, b + a for hanging [rad/s].
        cubic: coefficients c2, c1, c0 of the monic cubic in d.
    """

    side: float
    here: float
    twist: float
    cubic: tuple[float, float, float]


@dataclass(frozen=True)
class Start:
    """Constants of the motion.

    Attributes:
        a: I3 omega3 / I [rad/s].
        b: p_phi / I [rad/s].
        beta: 2 mgl / I [1/s^2].
        omega3: axial angular velocity [rad/s].
        climb: u' at the start [1/s].
        upright: the start from the upper pole.
        hanging: the start from the lower pole.
        cayley_klein: w + i z and x + i y of the start.
        across: omega1 + i omega2 of the start [rad/s].
    """

    a: float
    b: float
    beta: float
    omega3: float
    climb: float
    upright: Pole
    hanging: Pole
    cayley_klein: tuple[complex, complex]
    across: complex


@dataclass(frozen=True)
class Invariants:
    """Conserved quantities of the top.

    Attributes:
        energy: kinetic energy about the pivot plus mgl cos theta [J].
        p_phi: vertical angular momentum [kg m^2/s].
        p_psi: axial angular momentum I3 omega3 [kg m^2/s].
    """

    energy: float
    p_phi: float
    p_psi: float


def start_of(omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float) -> Start:
    """Check the start of a top and find the constants of its motion.

    Args:
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Raises:
        ValueError: a moment or mgl that is not positive, a quaternion that is not unit, a wrong
            shape, or a number that is not finite.
    """
    all_positive(i_perp=i_perp, i3=i3, mgl=mgl)
    rates = exact_array(omega0, "omega0", 3)
    expected = (
        "rates, moments and weight whose ratios double precision has: I omega^2 / mgl and "
        "(I3 omega3)^2 / (I mgl) below 1e100"
    )
    try:
        start = _start(rates.tolist(), q0, i_perp, i3, mgl)
    except OverflowError:
        raise ValueError(f"omega0 = {rates.tolist()}; expected {expected}") from None
    largest = max(map(abs, start.upright.cubic + start.hanging.cubic))
    require(largest < 1e100, rates, "omega0", expected)
    return start


def _start(rates: list[float], q0: ArrayLike, i_perp: float, i3: float, mgl: float) -> Start:
    """Constants of the motion of a start whose numbers are checked, but for the quaternion."""
    unit = _quaternion.normalized(q0, "q0").tolist()
    swing = math.sqrt(mgl / i_perp)
    w1, w2, w3 = _exact(rates[0], swing), _exact(rates[1], swing), Fraction(rates[2])
    qw, qx, qy, qz = (_exact(x, 1.0) for x in exact_array(q0, "q0", 4).tolist())
    square = qw * qw + qx * qx + qy * qy + qz * qz
    # gamma = R^T e_z; its third component is u.
    gamma1, gamma2 = 2 * (qx * qz - qw * qy) / square, 2 * (qy * qz + qw * qx) / square
    a = Fraction(float(i3)) * w3 / Fraction(float(i_perp))
    beta = 2 * Fraction(float(mgl)) / Fraction(float(i_perp))
    upright, hanging = 2 * (qx * qx + qy * qy) / square, 2 * (qw * qw + qz * qz) / square
    speed, turn = w1 * w1 + w2 * w2, gamma1 * w1 + gamma2 * w2
    return Start(
        a=float(a),
        b=float(turn + a * (hanging - upright) / 2),
        beta=float(beta),
        omega3=float(w3),
        climb=float(gamma1 * w2 - gamma2 * w1),
        upright=_pole(1, upright, speed, turn, a, beta),
        hanging=_pole(-1, hanging, speed, turn, a, beta),
        cayley_klein=(complex(unit[0], unit[3]), complex(unit[1], unit[2])),
        across=complex(w1, w2),
    )


def invariants(
    omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> Invariants:
    """Find energy and momenta of a top from its start.

    Args:
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Raises:
        ValueError: a moment or mgl that is not positive, a quaternion that is not unit, a wrong
            shape, or a number that is not finite.

    Source: Goldstein, sec. 5.7.
    """
    start = start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl)
    kinetic = 0.5 * (i_perp * abs(start.across) ** 2 + i3 * start.omega3**2)
    return Invariants(
        energy=kinetic + 0.5 * mgl * (start.hanging.here - start.upright.here),
        p_phi=i_perp * start.b,
        p_psi=i3 * start.omega3,
    )


def _exact(value: float, size: float) -> Fraction:
    """Return the rational number that a double is, or 0 for one that is next to nothing."""
    return Fraction(value) if abs(value) > _SMALLEST * size else Fraction(0)


def _pole(
    side: int, here: Fraction, speed: Fraction, turn: Fraction, a: Fraction, beta: Fraction
) -> Pole:
    """Twist and cubic (1 - u^2)(alpha - beta u) - (b - a u)^2 in the distance from one pole.

    There alpha - beta u = energy + side beta d, b - a u = twist + side a d, 1 - u^2 = d (2 - d).
    """
    energy, twist = speed - side * beta * here, turn - side * a * here
    return Pole(
        side=float(side),
        here=float(here),
        twist=float(twist),
        cubic=(
            float(side * (energy + a * a) / beta - 2),
            float(2 * (a * twist - side * energy) / beta),
            float(side * twist * twist / beta),
        ),
    )
