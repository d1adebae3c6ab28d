"""Attitude: quaternions, rotation matrices, z-x-z Euler angles, exp and log, change of frame.

Conventions. A quaternion q = (w, x, y, z) is unit, Hamilton, body to world; R is its matrix,
v_world = R v_body; Euler angles are (phi, theta, psi) with R = Rz(phi) Rx(theta) Rz(psi): phi
precession, theta nutation, psi spin; a rotation vector is axis * angle [rad]. q and -q are the
same attitude.

At gimbal lock (sin(theta) = 0) only phi + psi or phi - psi is defined: angles are finite, with
psi = 0, and Euler-angle rates, which do not exist there, are refused with a `ValueError`.

Every function takes array-likes with any leading axes, broadcasts them, returns new float64
arrays, and refuses bad input with a `ValueError`: wrong trailing shape, no real numbers, NaN or
infinity, a quaternion or axis whose length, or a matrix whose R^T R, is more than 1e-6 from one
(float32 rounding passes and is normalised away; what is unit to rounding passes bit for bit).
"""

from rigid_envs.rotations.conversions import (
    euler_from_matrix,
    euler_from_quaternion,
    euler_rates_from_omega_body,
    euler_rates_from_omega_world,
    matrix_from_euler,
    matrix_from_quaternion,
    matrix_from_rot6d,
    omega_body_from_euler_rates,
    omega_world_from_euler_rates,
    quaternion_from_euler,
    quaternion_from_matrix,
    rot6d_from_matrix,
)
from rigid_envs.rotations.lie import (
    axis_angle_from_quaternion,
    exp,
    hat,
    left_jacobian,
    left_jacobian_inverse,
    log,
    quaternion_from_axis_angle,
    right_jacobian,
    right_jacobian_inverse,
    slerp,
    vee,
)
from rigid_envs.rotations.quaternions import (
    angle,
    canonicalize,
    conjugate,
    distance,
    identity,
    multiply,
    normalize,
    quaternion_rate,
    random_quaternion,
    rotate,
    rotate_inverse,
)
from rigid_envs.rotations.transport import (
    body_rate,
    rotate_tensor,
    transform_tensor,
    world_rate,
)

__all__ = [
    "angle",
    "axis_angle_from_quaternion",
    "body_rate",
    "canonicalize",
    "conjugate",
    "distance",
    "euler_from_matrix",
    "euler_from_quaternion",
    "euler_rates_from_omega_body",
    "euler_rates_from_omega_world",
    "exp",
    "hat",
    "identity",
    "left_jacobian",
    "left_jacobian_inverse",
    "log",
    "matrix_from_euler",
    "matrix_from_quaternion",
    "matrix_from_rot6d",
    "multiply",
    "normalize",
    "omega_body_from_euler_rates",
    "omega_world_from_euler_rates",
    "quaternion_from_axis_angle",
    "quaternion_from_euler",
    "quaternion_from_matrix",
    "quaternion_rate",
    "random_quaternion",
    "right_jacobian",
    "right_jacobian_inverse",
    "rot6d_from_matrix",
    "rotate",
    "rotate_inverse",
    "rotate_tensor",
    "slerp",
    "transform_tensor",
    "vee",
    "world_rate",
]
