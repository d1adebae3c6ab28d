"""The Lie group SO(3): exp, log, axis and angle, so(3) matrices, Jacobians, geodesics."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array, array, require
from rigid_envs.rotations.quaternions import angle, canonicalize, conjugate, multiply
from rigid_envs.rotations.vectors import norm, unit

__all__ = [
    "axis_angle_from_quaternion",
    "exp",
    "hat",
    "left_jacobian",
    "left_jacobian_inverse",
    "log",
    "quaternion_from_axis_angle",
    "right_jacobian",
    "right_jacobian_inverse",
    "slerp",
    "vee",
]


def exp(rotation_vector: ArrayLike) -> Array:
    """Turn about a vector by its length: (cos(a / 2), sin(a / 2) / a * v), a = |v|.

    Args:
        rotation_vector: axis * angle [rad], of any length, (..., 3).

    Returns:
        Unit quaternion, (..., 4), accurate to rounding in every entry, however small.

    Source:
        Sola, Quaternion kinematics for the error-state Kalman filter, section 2; arXiv:1711.02508.
    """
    half = 0.5 * array(rotation_vector, "rotation_vector", 3)
    half_angle = norm(half)
    return np.concatenate([np.cos(half_angle), _sinc(half_angle) * half], axis=-1)


def log(q: ArrayLike) -> Array:
    """Return the shortest rotation vector, 2 atan2(|u|, w) u / |u| of the canonical (w, u).

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        axis * angle [rad], angle in [0, pi], (..., 3); the inverse of `exp` for angles below pi.

    Raises:
        ValueError: if q is not unit.

    Source:
        Sola, Quaternion kinematics for the error-state Kalman filter, section 2; arXiv:1711.02508.
    """
    rows = canonicalize(q)
    w, u = rows[..., :1], rows[..., 1:]
    return 2.0 * _quotient(np.arctan2(norm(u), w), norm(u)) * u


def _quotient(numerator: Array, denominator: Array) -> Array:
    """Divide, with the limit 1 where the denominator is 0."""
    return np.divide(numerator, denominator, np.ones_like(denominator), where=denominator != 0.0)


def _sinc(x: Array) -> Array:
    """Return sin(x) / x: the quotient itself is accurate to rounding for every x but 0."""
    return _quotient(np.sin(x), x)


def quaternion_from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Turn about a unit axis: (cos(angle / 2), sin(angle / 2) axis).

    Args:
        axis: unit vector, (..., 3).
        angle: any angle [rad], (...).

    Returns:
        Unit quaternion, (..., 4).

    Raises:
        ValueError: if the axis is not unit (`exp` takes axis * angle).
    """
    half = 0.5 * array(angle, "angle")[..., None]
    vector = np.sin(half) * unit(axis, "axis", 3)
    scalar = np.broadcast_to(np.cos(half), (*vector.shape[:-1], 1))
    return np.concatenate([scalar, vector], axis=-1)


def axis_angle_from_quaternion(q: ArrayLike) -> tuple[Array, Array]:
    """Split a rotation into its axis and its angle.

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        Unit axis, (..., 3), the same in body and world axes, (0, 0, 1) where there is no
        rotation; and angle in [0, pi] [rad], (...).

    Raises:
        ValueError: if q is not unit.
    """
    rows = canonicalize(q)
    u = rows[..., 1:]
    axis = np.where(norm(u) == 0.0, np.array([0.0, 0.0, 1.0]), u)
    return axis / norm(axis), angle(rows)


def hat(v: ArrayLike) -> Array:
    """Return the so(3) matrix of a vector, V u = v x u for every u.

    Args:
        v: vector, (..., 3).

    Returns:
        Skew-symmetric matrix, (..., 3, 3).
    """
    x, y, z = np.moveaxis(array(v, "v", 3), -1, 0)
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(*x.shape, 3, 3)


def vee(skew: ArrayLike) -> Array:
    """Return the vector of a cross-product matrix, the inverse of `hat`.

    Args:
        skew: skew-symmetric matrix, (..., 3, 3).

    Returns:
        Vector, (..., 3).

    Raises:
        ValueError: if an entry of skew + skew^T exceeds 1e-6 of the largest of skew.
    """
    m = array(skew, "skew", 3, 3)
    with np.errstate(over="ignore"):  # then it is not skew-symmetric
        even = 0.5 * (m + np.swapaxes(m, -1, -2))
    size = np.max(np.abs(m), axis=(-1, -2))
    skew_symmetric = np.max(np.abs(even), axis=(-1, -2)) <= 0.5e-6 * size
    expected = "a skew-symmetric matrix: take (m - m.T) / 2 of it first"
    require(skew_symmetric, m, "skew", expected)
    return (m - even)[..., [2, 0, 1], [1, 2, 0]]  # exact where even is 0, subnormal numbers too


def left_jacobian(rotation_vector: ArrayLike) -> Array:
    """Return J of omega_world = J dv/dt: exp(v + dv) = exp(J dv) exp(v) to first order.

    J = 1 + (1 - cos a) / a^2 V + (a - sin a) / a^3 V^2, with V = hat(v), a = |v|.

    Args:
        rotation_vector: v = axis * angle [rad], (..., 3).

    Returns:
        Matrix, (..., 3, 3); singular where the angle is a multiple of 2 pi, but for 0.

    Source:
        Barfoot, State Estimation for Robotics (2017), section 7.1.
    """
    v = array(rotation_vector, "rotation_vector", 3)
    a = norm(v)[..., None]
    linear = 0.5 * _sinc(0.5 * a) ** 2 * hat(v)
    root = np.sqrt(_cubic_coefficient(a)) * hat(v)  # its square cannot overflow
    return np.eye(3) + linear + root @ root


def _cubic_coefficient(a: Array) -> Array:
    """Return (a - sin a) / a^3: below 1, where it cancels, by its series."""
    square = np.minimum(a, 1.0) ** 2
    series = np.zeros_like(a)
    for k in range(21, 4, -2):  # Horner: 1/3! - a^2/5! + ... - a^18/21!
        series = (1.0 - series) * square / (k * (k - 1))
    large = np.maximum(a, 1.0)
    return np.where(a < 1.0, (1.0 - series) / 6.0, (1.0 - np.sin(large) / large) / large / large)


def right_jacobian(rotation_vector: ArrayLike) -> Array:
    """Return J of omega_body = J dv/dt: exp(v + dv) = exp(v) exp(J dv) to first order.

    It is the left Jacobian of -v, and its transpose.

    Args:
        rotation_vector: v = axis * angle [rad], (..., 3).

    Returns:
        Matrix, (..., 3, 3).

    Source:
        Barfoot, State Estimation for Robotics (2017), section 7.1.
    """
    return left_jacobian(-array(rotation_vector, "rotation_vector", 3))


def left_jacobian_inverse(rotation_vector: ArrayLike) -> Array:
    """Return J^-1 of dv/dt = J^-1 omega_world.

    Args:
        rotation_vector: v = axis * angle [rad], shorter than 2 pi, (..., 3).

    Returns:
        Matrix, (..., 3, 3); its condition number is a / (2 sin(a / 2)), pi / 2 at a = pi.

    Raises:
        ValueError: if the angle is 2 pi or more, where the inverse does not exist or is not wanted.
    """
    v = array(rotation_vector, "rotation_vector", 3)
    expected = "an angle below 2 pi: take log(exp(v)), the shortest vector of this rotation"
    require(norm(v)[..., 0] < 2.0 * np.pi, v, "rotation_vector", expected)
    return np.asarray(np.linalg.inv(left_jacobian(v)), dtype=np.float64)


def right_jacobian_inverse(rotation_vector: ArrayLike) -> Array:
    """Return J^-1 of dv/dt = J^-1 omega_body.

    Args:
        rotation_vector: v = axis * angle [rad], shorter than 2 pi, (..., 3).

    Returns:
        Matrix, (..., 3, 3).

    Raises:
        ValueError: if the angle is 2 pi or more.
    """
    return left_jacobian_inverse(-array(rotation_vector, "rotation_vector", 3))


def slerp(p: ArrayLike, q: ArrayLike, t: ArrayLike) -> Array:
    """Interpolate between attitudes at constant rate on the geodesic: p exp(t log(p^-1 q)).

    Args:
        p: unit quaternion at t = 0, (..., 4).
        q: unit quaternion at t = 1, (..., 4).
        t: fraction of the angle, beyond [0, 1] too, (...).

    Returns:
        Unit quaternion, (..., 4), continuous in t from p: at t = 1 it is q or -q.

    Raises:
        ValueError: if p or q is not unit.

    Source:
        Shoemake, Animating rotation with quaternion curves, SIGGRAPH (1985);
        doi:10.1145/325334.325242.
    """
    start = unit(p, "p", 4)
    vector = array(t, "t")[..., None] * log(multiply(conjugate(start), q))
    return multiply(start, exp(vector))
