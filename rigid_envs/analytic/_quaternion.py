"""The few quaternion operations that the oracles need, written apart from `rotations` on purpose.

Quaternions are (w, x, y, z) in the last axis.
"""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array, exact_array, unit_quaternion

__all__ = ["about_vertical", "conjugate", "from_rotation_vector", "normalized", "product"]


def normalized(value: ArrayLike, name: str) -> Array:
    """One unit quaternion, shape (4,), normalised to rounding.

    Raises:
        ValueError: another shape, no finite numbers, or a length that is not 1 within 1e-6.
    """
    q = unit_quaternion(exact_array(value, name, 4), name)
    return q / float(np.linalg.norm(q))


def conjugate(q: Array) -> Array:
    """Inverse rotation of a unit quaternion, shape (..., 4)."""
    return np.concatenate([q[..., :1], -q[..., 1:]], axis=-1)


def product(p: Array, q: Array) -> Array:
    """Hamilton product p q, shape (..., 4): the rotation q followed by p."""
    p_scalar, p_vector, q_scalar, q_vector = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    scalar = p_scalar * q_scalar - np.sum(p_vector * q_vector, axis=-1, keepdims=True)
    cross = np.cross(p_vector, q_vector)
    return np.concatenate([scalar, p_scalar * q_vector + q_scalar * p_vector + cross], axis=-1)


def from_rotation_vector(rotation: Array) -> Array:
    """Unit quaternion (cos(a/2), sin(a/2) n) of the rotation vector a n [rad], shape (..., 3)."""
    angle = np.linalg.norm(rotation, axis=-1, keepdims=True)
    # np.sinc(x) = sin(pi x) / (pi x) is exact at 0, where a n / a is not.
    half_sinc = 0.5 * np.sinc(angle / (2.0 * np.pi))
    return np.concatenate([np.cos(0.5 * angle), half_sinc * rotation], axis=-1)


def about_vertical(angle: Array) -> Array:
    """Rotation about world z by the angle [rad], shape (..., 4)."""
    zero = np.zeros_like(angle)
    return np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], axis=-1)
