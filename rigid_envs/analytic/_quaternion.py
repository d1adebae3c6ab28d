"""The few quaternion operations that the oracles need, written apart from `rotations` on purpose.

Quaternions are (w, x, y, z) in the last axis.
"""

import numpy as np

from rigid_envs.analytic._inputs import FloatArray

__all__ = ["about_vertical", "conjugate", "from_rotation_vector", "product"]


def conjugate(q: FloatArray) -> FloatArray:
    """Inverse rotation of a unit quaternion, shape (..., 4)."""
    return np.concatenate([q[..., :1], -q[..., 1:]], axis=-1)


def product(p: FloatArray, q: FloatArray) -> FloatArray:
    """Hamilton product p q, shape (..., 4): the rotation q followed by p."""
    p_scalar, p_vector, q_scalar, q_vector = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    scalar = p_scalar * q_scalar - np.sum(p_vector * q_vector, axis=-1, keepdims=True)
    cross = np.cross(p_vector, q_vector)
    return np.concatenate([scalar, p_scalar * q_vector + q_scalar * p_vector + cross], axis=-1)


def from_rotation_vector(rotation: FloatArray) -> FloatArray:
    """Unit quaternion (cos(a/2), sin(a/2) n) of the rotation vector a n [rad], shape (..., 3)."""
    angle = np.linalg.norm(rotation, axis=-1, keepdims=True)
    # np.sinc(x) = sin(pi x) / (pi x) is exact at 0, where a n / a is not.
    half_sinc = 0.5 * np.sinc(angle / (2.0 * np.pi))
    return np.concatenate([np.cos(0.5 * angle), half_sinc * rotation], axis=-1)


def about_vertical(angle: FloatArray) -> FloatArray:
    """Rotation about world z by the angle [rad], shape (..., 4)."""
    zero = np.zeros_like(angle)
    return np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], axis=-1)
