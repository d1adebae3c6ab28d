"""Relative poses of a rolling ball, and the pose after straight rolls. Lengths are in radii."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.checks import positive_array
from rigid_envs.systems import RollingBall

__all__ = ["AXES", "difference", "rolled"]

Array = npt.NDArray[np.float64]

AXES = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 0.0]])
"""Rotation vector of a displacement, or rolling rate of a velocity, both in radii."""


def difference(
    start: npt.ArrayLike, goal: npt.ArrayLike, radius: npt.ArrayLike
) -> tuple[Array, Array]:
    """Relative pose: R_goal = R_turn R_start, p_goal = p_start + radius displacement.

    Args:
        start: states (w, x, y, z, X, Y) of `RollingBall`, shape (..., 6).
        goal: the same, broadcast against start.
        radius: of the balls, shape (...) [m].

    Returns:
        turn, world, shape (..., 4), and displacement of the centre [radii], shape (..., 2).

    Raises:
        ValueError: bad states, or a radius that is not positive.
    """
    size = positive_array(radius, "radius", "m")
    begin, end, size = np.broadcast_arrays(
        RollingBall.checked_state(start), RollingBall.checked_state(goal), size[..., None]
    )
    turn = rotations.multiply(end[..., :4], rotations.conjugate(begin[..., :4]))
    return turn, (end[..., 4:6] - begin[..., 4:6]) / size[..., :2]


def rolled(rolls: Array) -> tuple[Array, Array]:
    """Turn by straight rolls one after the other, and its derivatives.

    A roll by d turns the ball by the rotation vector d* = (-d_y, d_x, 0). A change of it turns the
    ball by J dd* more, with the left Jacobian J of d*, carried along by the rolls that follow.

    Args:
        rolls: displacements of the centre in turn, shape (..., K, 2) [radii].

    Returns:
        turn, shape (..., 4), and the rotation vectors, world, per change of each roll, shape
        (..., K, 3, 2).
    """
    vectors = rolls @ AXES.T
    turns, jacobians = rotations.exp(vectors), rotations.left_jacobian(vectors) @ AXES
    total, after = turns[..., -1, :], [jacobians[..., -1, :, :]]
    for k in range(rolls.shape[-2] - 2, -1, -1):
        after.append(rotations.matrix_from_quaternion(total) @ jacobians[..., k, :, :])
        total = rotations.multiply(total, turns[..., k, :])
    return total, np.stack(after[::-1], axis=-3)
