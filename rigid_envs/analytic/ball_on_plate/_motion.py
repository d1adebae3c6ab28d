"""Motions in world axes from complex numbers along the plate."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array

__all__ = ["Rolled", "about_x", "from_complex", "with_normal"]


class Rolled(NamedTuple):
    """Motion of the ball at given times, world axes.

    Attributes:
        centre: shape (..., 3) [m].
        velocity: of the centre, shape (..., 3) [m/s].
        omega: angular velocity, shape (..., 3) [rad/s].
    """

    centre: Array
    velocity: Array
    omega: Array


def from_complex(along: ArrayLike, normal: float) -> Array:
    """Vectors (real, imaginary, normal), shape (..., 3), of complex ones along the plate."""
    along = np.asarray(along)
    return with_normal(np.stack([along.real, along.imag], axis=-1), normal)


def with_normal(along: Array, normal: float) -> Array:
    """Vectors (x, y, normal), shape (..., 3)."""
    return np.concatenate([along, np.full_like(along[..., :1], normal)], axis=-1)


def about_x(vectors: Array, angle: float | Array) -> Array:
    """Turn vectors, shape (..., 3), about x by the angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([x, c * y - s * z, s * y + c * z], axis=-1)
