"""The boundary of bodies: numbers of one body, positive where they must be, and attitudes."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.rotations import matrix_from_quaternion
from rigid_envs.rotations._boundary import Array, real, rotation_matrix, unit


def exactly(value: ArrayLike, name: str, *shape: int) -> Array:
    """Return a finite float64 copy of `value`, of this shape and no other."""
    array = real(value, name, *shape)
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}: expected {shape}, for one body")
    return array


def positive(value: ArrayLike, name: str, si: str) -> float:
    """Return a positive finite number."""
    number = float(exactly(value, name))
    if number <= 0.0:
        raise ValueError(f"{name} = {number}: expected a positive number [{si}]")
    return number


def mass_of(value: ArrayLike) -> float:
    """Return a mass."""
    return positive(value, "mass", "kg")


def metres(value: ArrayLike, name: str) -> float:
    """Return a length."""
    return positive(value, name, "m")


def bores(inner_radius: ArrayLike, outer_radius: ArrayLike) -> tuple[float, float]:
    """Return the radii of something hollow, 0 <= inner <= outer: from full to thin."""
    inner = float(exactly(inner_radius, "inner_radius"))
    outer = metres(outer_radius, "outer_radius")
    if not 0.0 <= inner <= outer:
        raise ValueError(
            f"inner_radius = {inner}: expected from 0 to outer_radius = {outer} m; check "
            "their order and units"
        )
    return inner, outer


def attitude_matrix(attitude: ArrayLike, name: str) -> Array:
    """Return the rotation matrix of a unit quaternion, or the one nearest to a matrix."""
    rows = real(attitude, name)
    if rows.shape == (4,):
        return matrix_from_quaternion(unit(rows, name, 4))
    if rows.shape != (3, 3):
        raise ValueError(
            f"{name} has shape {rows.shape}: expected a quaternion (w, x, y, z), shape (4,), "
            "or a rotation matrix, shape (3, 3)"
        )
    R = rotation_matrix(rows, name)
    for _ in range(2):  # Newton's iteration for the polar factor: an error of 1e-6 becomes 1e-24
        R = R @ (1.5 * np.eye(3) - 0.5 * R.T @ R)
    return R
