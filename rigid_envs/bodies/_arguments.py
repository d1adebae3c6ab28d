"""Arguments of several constructors: the radii of a hollow body, an attitude."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs import checks
from rigid_envs.rotations import matrix_from_quaternion

__all__ = ["attitude_matrix", "distance", "extent", "hollow"]

_LONGEST = 1e100  # [m]; the fourth power would leave double precision


def extent(value: float, name: str, thin: str) -> float:
    """Positive length of a solid; the refusal names the body that is left where it is 0."""
    try:
        return distance(value, name)
    except ValueError as error:
        raise ValueError(f"{error}, or for 0 {thin}") from None


def distance(value: float, name: str) -> float:
    """Positive length whose square double precision has."""
    checked = checks.positive(value, name, "m")
    checks.require(checked <= _LONGEST, value, name, f"a length of at most {_LONGEST:g} m")
    return checked


def hollow(inner_radius: float, outer_radius: float) -> tuple[float, float]:
    """Radii of a hollow body, 0 <= inner <= outer: from solid to a thin shell."""
    inner = checks.non_negative(inner_radius, "inner_radius", "m")
    outer = distance(outer_radius, "outer_radius")
    expected = f"from 0 to outer_radius = {outer} [m]: check their order and units"
    checks.require(inner <= outer, inner, "inner_radius", expected)
    return inner, outer


def attitude_matrix(attitude: ArrayLike, name: str) -> checks.Array:
    """Rotation matrix of a unit quaternion, or the one nearest to a matrix."""
    rows = checks.array(attitude, name)
    if rows.shape == (4,):
        return matrix_from_quaternion(checks.unit_quaternion(rows, name))
    if rows.shape != (3, 3):
        raise ValueError(
            f"{name} has shape {rows.shape}; expected (4,) or (3, 3): a quaternion (w, x, y, z) or "
            "a rotation matrix"
        )
    R = checks.rotation_matrix(rows, name)
    for _ in range(2):  # Newton's iteration for the polar factor: an error of 1e-6 becomes 1e-24
        R = R @ (1.5 * np.eye(3) - 0.5 * R.T @ R)
    return R
