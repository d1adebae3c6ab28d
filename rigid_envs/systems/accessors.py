"""Accessors of the attitude that all systems with a quaternion share."""

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations

__all__ = ["ATTITUDE", "gamma", "quaternion"]

Array = npt.NDArray[np.float64]


def quaternion(y: npt.ArrayLike) -> Array:
    """Attitude q = (w, x, y, z), unit, body to world; shape (..., 4)."""
    return np.array(np.asarray(y, dtype=np.float64)[..., :4])


def matrix(y: npt.ArrayLike) -> Array:
    """Rotation matrix R, v_world = R v_body; shape (..., 3, 3)."""
    return rotations.matrix_from_quaternion(quaternion(y))


def euler(y: npt.ArrayLike) -> Array:
    """Angles (phi, theta, psi) of z-x-z, R = Rz(phi) Rx(theta) Rz(psi) [rad]; shape (..., 3)."""
    return rotations.euler_from_quaternion(quaternion(y))


def gamma(y: npt.ArrayLike) -> Array:
    """R^T e_z, the world vertical in body axes; shape (..., 3)."""
    return rotations.rotate_inverse(quaternion(y), np.array([0.0, 0.0, 1.0]))


ATTITUDE: Mapping[str, Callable[[npt.ArrayLike], Array]] = {
    "q": quaternion,
    "R": matrix,
    "euler": euler,
    "gamma": gamma,
}
