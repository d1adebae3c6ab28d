"""Vectors and quaternions as tuples of scalars. ``q = (w, x, y, z)``, unit, body to world."""

import math
from typing import Any

from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import atan2, fma, select

__all__ = [
    "Quaternion",
    "Row",
    "Vector",
    "attitude",
    "compose",
    "cross",
    "dot",
    "log_rotation",
    "matrix",
    "normalize",
    "normalize_near_unit",
    "rotate",
    "rotate_inverse",
    "scaled",
    "vertical",
    "weighted_sum",
]

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
