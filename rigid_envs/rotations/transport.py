"""Transport between frames: tensors of rank two, and the rates of vectors seen from two frames."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array, array, rotation_matrix
from rigid_envs.rotations.conversions import matrix_from_quaternion
from rigid_envs.rotations.quaternions import rotate, rotate_inverse
from rigid_envs.rotations.vectors import cross

__all__ = ["body_rate", "rotate_tensor", "transform_tensor", "world_rate"]


def rotate_tensor(q: ArrayLike, tensor: ArrayLike) -> Array:
    """Take a tensor of rank two from body to world axes: T_world = R(q) T_body R(q)^T.

    The inverse is that of the conjugate quaternion.

    Args:
        q: unit quaternion, (..., 4).
        tensor: tensor in body axes, such as an inertia tensor, (..., 3, 3).

    Returns:
        The same tensor in world axes, (..., 3, 3).

    Raises:
        ValueError: if q is not unit.

    Source:
        Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 5.2.
    """
    return transform_tensor(matrix_from_quaternion(q), tensor)


def transform_tensor(R: ArrayLike, tensor: ArrayLike) -> Array:
    """Take a tensor of rank two from body to world axes: T_world = R T_body R^T.

    The inverse is that of R^T.

    Args:
        R: rotation matrix, v_world = R v_body, (..., 3, 3).
        tensor: tensor in body axes, (..., 3, 3).

    Returns:
        The same tensor in world axes, (..., 3, 3).

    Raises:
        ValueError: if R is not orthonormal and right-handed.

    Source:
        Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 5.2.
    """
    m = rotation_matrix(R, "R")
    turned: Array = m @ array(tensor, "tensor", 3, 3) @ np.swapaxes(m, -1, -2)
    return turned


def world_rate(
    q: ArrayLike, v_body: ArrayLike, rate_body: ArrayLike, omega_body: ArrayLike
) -> Array:
    """Return the rate of a vector in world axes from its rate in body axes.

    d(v_world)/dt = R (d(v_body)/dt + omega_body x v_body), the transport theorem.

    Args:
        q: attitude of the body, unit quaternion, (..., 4).
        v_body: the vector in body axes, of any unit, (..., 3).
        rate_body: d(v_body)/dt, the rate of its components in body axes, (..., 3).
        omega_body: angular velocity of the body in body axes [rad/s], (..., 3).

    Returns:
        d(v_world)/dt, the rate of its components in world axes, (..., 3).

    Raises:
        ValueError: if q is not unit.

    Source:
        Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 4.9.
    """
    v, rate = array(v_body, "v_body", 3), array(rate_body, "rate_body", 3)
    return rotate(q, rate + cross(array(omega_body, "omega_body", 3), v))


def body_rate(
    q: ArrayLike, v_world: ArrayLike, rate_world: ArrayLike, omega_body: ArrayLike
) -> Array:
    """Return the rate of a vector in body axes, the inverse of `world_rate`.

    d(v_body)/dt = R^T d(v_world)/dt - omega_body x v_body, with v_body = R^T v_world.

    Args:
        q: attitude of the body, unit quaternion, (..., 4).
        v_world: the vector in world axes, of any unit, (..., 3).
        rate_world: d(v_world)/dt, the rate of its components in world axes, (..., 3).
        omega_body: angular velocity of the body in body axes [rad/s], (..., 3).

    Returns:
        d(v_body)/dt, the rate of its components in body axes, (..., 3).

    Raises:
        ValueError: if q is not unit.

    Source:
        Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 4.9.
    """
    v, rate = array(v_world, "v_world", 3), array(rate_world, "rate_world", 3)
    carried = cross(array(omega_body, "omega_body", 3), rotate_inverse(q, v))
    return rotate_inverse(q, rate) - carried
