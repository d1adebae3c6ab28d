"""Vectors and quaternions as tuples, small rotations, coefficients of composed steps, contacts."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import atan2, fma, select, sqrt

# Vectors and quaternions as tuples of scalars. ``q = (w, x, y, z)``, unit, body to world.

Row = tuple[float, ...]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@scalar
def attitude(y: Any) -> Quaternion:
    """Attitude q of a state that has one."""
    return (y.w, y.x, y.y, y.z)


@scalar
def dot(a: Vector, b: Vector) -> float:
    """Scalar product a . b."""
    return fma(a[0], b[0], fma(a[1], b[1], a[2] * b[2]))


@scalar
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product a x b."""
    return (
        fma(a[1], b[2], -a[2] * b[1]),
        fma(a[2], b[0], -a[0] * b[2]),
        fma(a[0], b[1], -a[1] * b[0]),
    )


@scalar
def scaled(s: float, a: Vector) -> Vector:
    """Product of a scalar and a vector."""
    return (s * a[0], s * a[1], s * a[2])


@scalar
def compose(p: Quaternion, q: Quaternion) -> Quaternion:
    """Hamilton product p q: the rotation q followed by p, both about world axes."""
    a0, a1, a2, a3 = p
    b0, b1, b2, b3 = q
    return (
        fma(a0, b0, -fma(a1, b1, fma(a2, b2, a3 * b3))),
        fma(a0, b1, fma(a1, b0, fma(a2, b3, -a3 * b2))),
        fma(a0, b2, fma(a2, b0, fma(a3, b1, -a1 * b3))),
        fma(a0, b3, fma(a3, b0, fma(a1, b2, -a2 * b1))),
    )


@scalar
def turning(q: Quaternion, omega: Vector) -> Quaternion:
    """Rate of change q' = q (0, omega) / 2, with omega in body axes."""
    w, x, y, z = q
    w1, w2, w3 = omega
    return (
        -0.5 * (x * w1 + y * w2 + z * w3),
        0.5 * (w * w1 + y * w3 - z * w2),
        0.5 * (w * w2 + z * w1 - x * w3),
        0.5 * (w * w3 + x * w2 - y * w1),
    )


@scalar
def normalize(q: Quaternion) -> Quaternion:
    """Unit quaternion along q."""
    w, x, y, z = q
    s = 1.0 / math.sqrt(fma(w, w, fma(x, x, fma(y, y, z * z))))
    return (s * w, s * x, s * y, s * z)


@scalar
def normalize_near_unit(q: Quaternion) -> Quaternion:
    """Unit quaternion along q where norm(q) - 1 is a few roundings: one Newton step, no root."""
    w, x, y, z = q
    s = fma(-0.5, fma(w, w, fma(x, x, fma(y, y, z * z))), 1.5)
    return (s * w, s * x, s * y, s * z)


@scalar
def rotate(q: Quaternion, v: Vector) -> Vector:
    """World components R v of a body vector: v + 2 w (p x v) + 2 p x (p x v), p = (x, y, z)."""
    p = (q[1], q[2], q[3])
    t = cross(p, v)
    tt = cross(p, t)
    return (
        fma(2.0, fma(q[0], t[0], tt[0]), v[0]),
        fma(2.0, fma(q[0], t[1], tt[1]), v[1]),
        fma(2.0, fma(q[0], t[2], tt[2]), v[2]),
    )


@scalar
def rotate_inverse(q: Quaternion, v: Vector) -> Vector:
    """Body components R^T v of a world vector."""
    return rotate((q[0], -q[1], -q[2], -q[3]), v)


@scalar
def vertical(q: Quaternion) -> Vector:
    """Gamma = R^T e_z, the world vertical in body axes: the third row of R."""
    w, x, y, z = q
    return (
        2.0 * fma(x, z, -w * y),
        2.0 * fma(y, z, w * x),
        fma(w, w, z * z) - fma(x, x, y * y),
    )


@scalar
def matrix(q: Quaternion) -> Row:
    """The nine entries of R, row by row."""
    w, x, y, z = q
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    return (
        (ww + xx) - (yy + zz),
        2.0 * fma(x, y, -w * z),
        2.0 * fma(x, z, w * y),
        2.0 * fma(x, y, w * z),
        (ww + yy) - (xx + zz),
        2.0 * fma(y, z, -w * x),
        2.0 * fma(x, z, -w * y),
        2.0 * fma(y, z, w * x),
        (ww + zz) - (xx + yy),
    )


@scalar
def matrix_product(a: Row, b: Row) -> Row:
    """The nine entries of ``A B^T``: of rotations, that from B to A in world axes."""
    return (
        fma(a[0], b[0], fma(a[1], b[1], a[2] * b[2])),
        fma(a[0], b[3], fma(a[1], b[4], a[2] * b[5])),
        fma(a[0], b[6], fma(a[1], b[7], a[2] * b[8])),
        fma(a[3], b[0], fma(a[4], b[1], a[5] * b[2])),
        fma(a[3], b[3], fma(a[4], b[4], a[5] * b[5])),
        fma(a[3], b[6], fma(a[4], b[7], a[5] * b[8])),
        fma(a[6], b[0], fma(a[7], b[1], a[8] * b[2])),
        fma(a[6], b[3], fma(a[7], b[4], a[8] * b[5])),
        fma(a[6], b[6], fma(a[7], b[7], a[8] * b[8])),
    )


@scalar
def unit_quaternion(r: Row) -> Quaternion:
    """The unit quaternion of a rotation matrix, up to its sign.

    The entries of R give those of ``4 q q^T``, all of whose rows are along q. The row with the
    largest entry of the diagonal is longest, and so the most exact. Source: Shepperd 1978,
    doi:10.2514/3.55767b.
    """
    ww, xx = 1.0 + r[0] + r[4] + r[8], 1.0 + r[0] - r[4] - r[8]
    yy, zz = 1.0 - r[0] + r[4] - r[8], 1.0 - r[0] - r[4] + r[8]
    wx, wy, wz = r[7] - r[5], r[2] - r[6], r[3] - r[1]
    xy, xz, yz = r[1] + r[3], r[2] + r[6], r[5] + r[7]
    x_over_w, z_over_y = xx > ww, zz > yy
    largest, other = max(ww, xx), max(yy, zz)
    one = (
        select(x_over_w, wx, ww),
        select(x_over_w, xx, wx),
        select(x_over_w, xy, wy),
        select(x_over_w, xz, wz),
    )
    two = (
        select(z_over_y, wz, wy),
        select(z_over_y, xz, xy),
        select(z_over_y, yz, yy),
        select(z_over_y, zz, yz),
    )
    take: bool = other > largest
    q = (
        select(take, two[0], one[0]),
        select(take, two[1], one[1]),
        select(take, two[2], one[2]),
        select(take, two[3], one[3]),
    )
    return normalize(q)


@scalar
def log_rotation(q: Quaternion) -> Vector:
    """Rotation vector theta = log R, angle in [0, pi] [rad]."""
    s = math.sqrt(fma(q[1], q[1], fma(q[2], q[2], q[3] * q[3])))
    half = atan2(s, abs(q[0]))
    # sin(x) / x -> 1: below 1e-8 the ratio is 1 to rounding
    factor = select(s > 1e-8, 2.0 * half / select(s > 1e-8, s, 1.0), 2.0)
    factor = select(q[0] < 0.0, -factor, factor)
    return (factor * q[1], factor * q[2], factor * q[3])


@scalar
def weighted_sum(weights: Row, terms: Row) -> float:
    """Sum of weights[k] terms[k]."""
    total = 0.0
    for k in range(len(terms)):
        total = fma(weights[k], terms[k], total)
    return total


# Rotations by small angles, from polynomials.
#
# A turn by the angle 2 x is a quaternion along (1, tan(x) e), or (cos x, sin(x) e). The polynomials
# take z = x^2, so that no root is needed to find the angle of a rotation vector.


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


# Coefficients that compose a symmetric second-order step into a fourth-order one.
#
# Suzuki's fractal composition: five steps of length s h, s h, (1 - 4 s) h, s h, s h with s = 1 / (4
# - 4^(1/3)). The result is symmetric and conserves every invariant of the single step (M. Suzuki
# 1990, doi:10.1016/0375-9601(90)90962-N; Hairer, Lubich & Wanner, *Geometric Numerical
# Integration*, section II.4). Its error constant is far below that of the three-step composition at
# the same cost per unit of accuracy.

_S = 0.4144907717943757

SUZUKI = (_S, _S, 1.0 - 4.0 * _S, _S, _S)
EXACT = (1.0,)  # for steps that are the exact flow


# What a contact bears: the force of the ground, and the friction that rolling needs.

Function = Callable[..., Any]


class Grip(NamedTuple):
    """Normal force [N], and the least coefficient of friction without slip."""

    normal_force: float
    needed_friction: float


@scalar
def _grip(force: Row) -> Grip:
    """Grip that a force of the ground needs, whose last entry is normal; infinite without it."""
    square, normal = 0.0, force[len(force) - 1]
    for k in range(len(force) - 1):
        square += force[k] * force[k]
    held = normal > 0.0
    return Grip(normal, select(held, sqrt(square) / select(held, normal, 1.0), np.inf))


@scalar
def _slips(grip: Grip, p: Any) -> bool:
    slips: bool = grip.needed_friction > p.mu
    return slips


@scalar
def _no_force(_y: Row, _u: Row, _p: Row) -> tuple[()]:
    return ()


@scalar
def _no_grip(_force: tuple[()]) -> tuple[()]:
    return ()


@scalar
def _never(_grip: tuple[()], _p: Row) -> bool:
    return False


class Contact(NamedTuple):
    """Compiled functions of a contact.

    Attributes:
        force: ``force(y, u, p)``, force of the ground [N], the normal force last.
        grip: ``grip(force)``, the `Grip` that it needs.
        slips: ``slips(grip, p)``, whether rolling needs more friction than there is.
        n_force: number of components of the force.
        names: those of the grip.
    """

    force: Function
    grip: Function
    slips: Function
    n_force: int
    names: tuple[str, ...]


NO_CONTACT = Contact(_no_force, _no_grip, _never, 0, ())
"""That of a system which touches nothing, or has no forces."""


def on_ground(force: Function, n_force: int) -> Contact:
    """Contact of a system that rolls; its parameters have mu, the coefficient of friction."""
    return Contact(force, _grip, _slips, n_force, Grip._fields)
