"""Straight rolls, each a rotation about a horizontal axis, and sequences of them."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import _quaternion
from rigid_envs.checks import Array, array, exact_array, positive, require

__all__ = ["roll_polygon", "roll_segments", "roll_straight"]


def roll_straight(displacement: ArrayLike, radius: float, *, twist: ArrayLike = 0.0) -> Array:
    """Turn of a straight roll: the rotation vector (-d_y / radius, d_x / radius, twist).

    Args:
        displacement: of the centre, shape (..., 2) [m], world.
        radius: of the ball [m].
        twist: angle spun about the vertical meanwhile, uniformly, broadcast with (...) [rad].

    Returns:
        Turn, shape (..., 4).

    Raises:
        ValueError: the displacement has not two components, or the radius is not positive.
    """
    positive(radius, "radius")
    moved = array(displacement, "displacement", 2)
    parts = np.broadcast_arrays(
        -moved[..., 1] / radius, moved[..., 0] / radius, array(twist, "twist")
    )
    return _quaternion.from_rotation_vector(np.stack(parts, axis=-1))


def roll_polygon(displacements: ArrayLike, radius: float) -> Array:
    """Turn of straight rolls one after the other: their product, the last on the left.

    Args:
        displacements: of the centre in each roll, shape (n, 2) [m], world.
        radius: of the ball [m].

    Returns:
        Turn, shape (4,).

    Raises:
        ValueError: a wrong shape, or the radius is not positive.
    """
    rolls = array(displacements, "displacements", 2)
    if rolls.ndim != 2:
        raise ValueError(f"displacements has shape {rolls.shape}; expected (n, 2)")
    total = np.array([1.0, 0.0, 0.0, 0.0])
    for turn in roll_straight(rolls, radius):
        total = _quaternion.product(turn, total)
    return total


def roll_segments(t: ArrayLike, segments: ArrayLike, radius: float) -> tuple[Array, Array]:
    """Displacement and turn of a ball under piecewise constant velocity.

    Args:
        t: times, any shape [s], 0 up to the sum of the durations.
        segments: shape (n, 4): v_x, v_y [m/s], spin omega_z [rad/s], duration [s], world.
        radius: of the ball [m].

    Returns:
        Displacement of the centre since t = 0, shape t.shape + (2,) [m], and turn since t = 0,
        shape t.shape + (4,).

    Raises:
        ValueError: a wrong shape, a negative duration, a time outside the segments, or the radius
            is not positive.
    """
    times, rows = array(t, "t"), exact_array(segments, "segments", "n", 4)
    require(rows[:, 3] >= 0.0, rows, "segments", "v_x, v_y, spin and a duration of at least 0")
    span = float(np.sum(rows[:, 3]))
    inside = (times >= 0.0) & (times <= span)
    require(inside, times, "t", f"a time within the segments, 0 to {span} [s]")
    moved = np.zeros((*times.shape, 2))
    turn = np.broadcast_to(np.array([1.0, 0.0, 0.0, 0.0]), (*times.shape, 4))
    begin = np.cumsum(rows[:, 3]) - rows[:, 3]
    for (v_x, v_y, spin, duration), start in zip(rows, begin, strict=True):
        spent = np.clip(times - start, 0.0, duration)
        step = spent[..., np.newaxis] * np.array([v_x, v_y])
        moved = moved + step
        turn = _quaternion.product(roll_straight(step, radius, twist=spin * spent), turn)
    return moved, turn
