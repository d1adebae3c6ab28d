"""The algebra of unit quaternions, their rate, the distance of attitudes, uniform samples."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array, array, require
from rigid_envs.rotations.vectors import cross, direction, norm, unit

__all__ = [
    "angle",
    "canonicalize",
    "conjugate",
    "distance",
    "identity",
    "multiply",
    "normalize",
    "quaternion_rate",
    "random_quaternion",
    "rotate",
    "rotate_inverse",
]


def identity(shape: tuple[int, ...] = ()) -> Array:
    """Return the quaternion of no rotation, (1, 0, 0, 0).

    Args:
        shape: leading axes.

    Returns:
        Quaternions, (*shape, 4).
    """
    return np.tile([1.0, 0.0, 0.0, 0.0], (*shape, 1))


def normalize(q: ArrayLike) -> Array:
    """Scale to unit length, q / |q|, without overflow or underflow.

    Args:
        q: any quaternion but zero, (..., 4).

    Returns:
        Unit quaternion, (..., 4).

    Raises:
        ValueError: if q is zero.
    """
    rows = array(q, "q", 4)
    expected = "a quaternion that is not zero: no rotation is (1, 0, 0, 0), see identity()"
    require(np.any(rows != 0.0, axis=-1), rows, "q", expected)
    return direction(rows)


def multiply(p: ArrayLike, q: ArrayLike) -> Array:
    """Compose two rotations, q first: the Hamilton product p q, R(p q) = R(p) R(q).

    Args:
        p: unit quaternion, (..., 4).
        q: unit quaternion, (..., 4).

    Returns:
        Unit quaternion, (..., 4).

    Raises:
        ValueError: if p or q is not unit.

    Source:
        Sola, Quaternion kinematics for the error-state Kalman filter, section 1; arXiv:1711.02508.
    """
    return product(unit(p, "p", 4), unit(q, "q", 4))


def product(p: Array, q: Array) -> Array:
    """Return the Hamilton product of any two quaternions, unchecked."""
    p_w, p_v, q_w, q_v = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    w = p_w * q_w - np.sum(p_v * q_v, axis=-1, keepdims=True)
    return np.concatenate([w, p_w * q_v + q_w * p_v + cross(p_v, q_v)], axis=-1)


def conjugate(q: ArrayLike) -> Array:
    """Invert a rotation: (w, -x, -y, -z), world to body.

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        Unit quaternion, (..., 4).

    Raises:
        ValueError: if q is not unit.
    """
    rows = unit(q, "q", 4)
    return np.concatenate([rows[..., :1], -rows[..., 1:]], axis=-1)


def rotate(q: ArrayLike, v: ArrayLike) -> Array:
    """Take a vector from body to world axes: v_world = R(q) v_body = v + w t + u x t, t = 2 u x v.

    Args:
        q: unit quaternion (w, u), (..., 4).
        v: vector in body axes, (..., 3).

    Returns:
        The same vector in world axes, (..., 3).

    Raises:
        ValueError: if q is not unit.
    """
    rows, vectors = unit(q, "q", 4), array(v, "v", 3)
    w, u = rows[..., :1], rows[..., 1:]
    t: Array = 2.0 * cross(u, vectors)
    turned: Array = vectors + w * t + cross(u, t)
    return turned


def rotate_inverse(q: ArrayLike, v: ArrayLike) -> Array:
    """Take a vector from world to body axes: v_body = R(q)^T v_world.

    Args:
        q: unit quaternion, (..., 4).
        v: vector in world axes, (..., 3).

    Returns:
        The same vector in body axes, (..., 3).

    Raises:
        ValueError: if q is not unit.
    """
    return rotate(conjugate(q), v)


def quaternion_rate(q: ArrayLike, omega_body: ArrayLike) -> Array:
    """Return dq/dt = q (0, omega_body) / 2.

    Args:
        q: unit quaternion, (..., 4).
        omega_body: angular velocity in body axes [rad/s], (..., 3).

    Returns:
        Rate of the quaternion [1/s], (..., 4), orthogonal to q.

    Raises:
        ValueError: if q is not unit.

    Source:
        Sola, Quaternion kinematics for the error-state Kalman filter, section 4; arXiv:1711.02508.
    """
    omega = array(omega_body, "omega_body", 3)
    pure = np.concatenate([np.zeros_like(omega[..., :1]), omega], axis=-1)
    return 0.5 * product(unit(q, "q", 4), pure)


def canonicalize(q: ArrayLike) -> Array:
    """Choose between q and -q: w >= 0, and at w = 0 the first nonzero of x, y, z positive.

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        Unit quaternion of the same attitude, (..., 4); the same bits for q and -q.

    Raises:
        ValueError: if q is not unit.
    """
    rows = unit(q, "q", 4)
    first = np.argmax(rows != 0.0, axis=-1, keepdims=True)
    negative = np.take_along_axis(rows, first, axis=-1) < 0.0
    return np.where(negative, -rows, rows) + 0.0  # + 0.0 makes a zero of -0.0


def angle(q: ArrayLike) -> Array:
    """Return the angle of a rotation, 2 atan2(|(x, y, z)|, |w|): accurate near 0 and near pi.

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        Angle in [0, pi] [rad], (...).

    Raises:
        ValueError: if q is not unit.
    """
    rows = unit(q, "q", 4)
    half: Array = np.arctan2(norm(rows[..., 1:])[..., 0], np.abs(rows[..., 0]))
    return 2.0 * half


def distance(p: ArrayLike, q: ArrayLike) -> Array:
    """Return the angle of the rotation that leads from p to q, the geodesic metric of SO(3).

    Args:
        p: unit quaternion, (..., 4).
        q: unit quaternion, (..., 4).

    Returns:
        Angle in [0, pi] [rad], (...); exactly 0 between q and -q.

    Raises:
        ValueError: if p or q is not unit.

    Source:
        Huynh, Metrics for 3D rotations, J. Math. Imaging Vision 35 (2009), Phi_6;
        doi:10.1007/s10851-009-0161-2.
    """
    return angle(multiply(conjugate(unit(p, "p", 4)), q))


def random_quaternion(rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
    """Draw attitudes uniform on SO(3): a normal sample in four dimensions, normalised.

    Args:
        rng: the only source of randomness.
        shape: leading axes.

    Returns:
        Unit quaternions, (*shape, 4); both signs are equally likely.

    Raises:
        ValueError: if rng is not a numpy.random.Generator.

    Source:
        Muller, Comm. ACM 2(4) (1959) 19; doi:10.1145/377939.377946.
    """
    expected = "a numpy Generator: see np.random.default_rng"
    require(isinstance(rng, np.random.Generator), rng, "rng", expected)
    return normalize(rng.standard_normal((*shape, 4)))
