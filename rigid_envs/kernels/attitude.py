"""Observed attitude: matrix, two columns, quaternion or Euler angles."""

import math

from rigid_envs.kernels.algebra import Quaternion, Row, matrix
from rigid_envs.kernels.compiler import routine, scalar
from rigid_envs.kernels.elementary import atan2, fma, select
from rigid_envs.kernels.layout import Buffer
from rigid_envs.kernels.rows import LANES, load, store

__all__ = ["EULER", "HIDDEN", "MATRIX", "QUATERNION", "ROT6D", "write_attitude"]

HIDDEN, MATRIX, ROT6D, QUATERNION, EULER = range(5)
_Q = (1.0, 0.0, 0.0, 0.0)


@scalar
def canonical(q: Quaternion) -> Quaternion:
    """Quaternion of the same attitude with w >= 0."""
    sign = select(q[0] < 0.0, -1.0, 1.0)
    return (sign * q[0], sign * q[1], sign * q[2], sign * q[3])


@scalar
def rot6d(q: Quaternion) -> Row:
    """First two columns of R, one after the other (Zhou et al. 2019, arXiv:1812.07035)."""
    r = matrix(q)
    return (r[0], r[3], r[6], r[1], r[4], r[7])


@scalar
def euler(q: Quaternion) -> Row:
    """Angles (phi, theta, psi) of R = Rz(phi) Rx(theta) Rz(psi) [rad].

    With phi + psi = 2 atan2(z, w) and phi - psi = 2 atan2(y, x). At theta = 0 and pi one of the two
    is undefined and replaced by atan2(0, 0) = 0: finite, but not continuous.
    """
    w, x, y, z = q
    total, difference = atan2(z, w), atan2(y, x)
    theta = 2.0 * atan2(math.sqrt(fma(x, x, y * y)), math.sqrt(fma(w, w, z * z)))
    return (_wrapped(total + difference), theta, _wrapped(total - difference))


@scalar
def _wrapped(angle: float) -> float:
    """The same angle in [-pi, pi], for one in [-2 pi, 2 pi]."""
    turn = select(angle > math.pi, -2.0 * math.pi, 0.0)
    return angle + select(angle < -math.pi, 2.0 * math.pi, turn)


@routine
def write_attitude(
    buffer: Buffer, base: int, end: int, first: int, last: int, representation: int
) -> None:
    """Write the attitude of rows ``first .. last - 1`` to the slots before `end`."""
    if representation == MATRIX:
        for i in range(first, last):
            r = matrix(load(buffer, base + i, _Q, LANES))
            store(buffer, end - 9 * LANES + i, r, LANES)
    elif representation == ROT6D:
        for i in range(first, last):
            columns = rot6d(load(buffer, base + i, _Q, LANES))
            store(buffer, end - 6 * LANES + i, columns, LANES)
    elif representation == QUATERNION:
        for i in range(first, last):
            q = canonical(load(buffer, base + i, _Q, LANES))
            store(buffer, end - 4 * LANES + i, q, LANES)
    elif representation == EULER:
        for i in range(first, last):
            angles = euler(load(buffer, base + i, _Q, LANES))
            store(buffer, end - 3 * LANES + i, angles, LANES)
