"""Rotations by small angles, from polynomials.

A turn by the angle 2 x is a quaternion along (1, tan(x) e), or (cos x, sin(x) e). The polynomials
take z = x^2, so that no root is needed to find the angle of a rotation vector.
"""

from rigid_envs.kernels.algebra import Quaternion, Vector, dot
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma

__all__ = ["cayley", "half_turn", "tangent"]


@scalar
def cayley(a: float) -> tuple[float, float]:
    """Versine m = 1 - cos and sine s of 2 arctan(a): m^2 + s^2 = 2 m, a rotation for any a.

    With the versine, unlike a cosine near 1, the rounding error of the norm does not accumulate.
    """
    s = 2.0 * a / fma(a, a, 1.0)
    return s * a, s


@scalar
def tangent(z: float) -> float:
    """tan(x) / x for z = x^2; the first neglected term is 0.009 z^5."""
    t = fma(z, fma(z, 62.0 / 2835.0, 17.0 / 315.0), 2.0 / 15.0)
    return fma(z, fma(z, t, 1.0 / 3.0), 1.0)


@scalar
def half_turn(half: Vector) -> Quaternion:
    """Unit quaternion of the rotation vector 2 * half; exact to rounding up to a quarter turn."""
    z = dot(half, half)
    s = sinc(z)
    return (cosine(z), s * half[0], s * half[1], s * half[2])


@scalar
def sinc(z: float) -> float:
    """sin(x) / x for z = x^2; the first neglected term is x^16 / 17!."""
    s = fma(z, -1.0 / 1307674368000.0, 1.0 / 6227020800.0)
    s = fma(z, fma(z, s, -1.0 / 39916800.0), 1.0 / 362880.0)
    s = fma(z, fma(z, s, -1.0 / 5040.0), 1.0 / 120.0)
    return fma(z, fma(z, s, -1.0 / 6.0), 1.0)


@scalar
def cosine(z: float) -> float:
    """cos(x) for z = x^2; the first neglected term is x^18 / 18!."""
    c = fma(z, 1.0 / 20922789888000.0, -1.0 / 87178291200.0)
    c = fma(z, fma(z, c, 1.0 / 479001600.0), -1.0 / 3628800.0)
    c = fma(z, fma(z, c, 1.0 / 40320.0), -1.0 / 720.0)
    return fma(z, fma(z, fma(z, c, 1.0 / 24.0), -0.5), 1.0)
