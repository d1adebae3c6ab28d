"""Straight rolls, each a rotation about a horizontal axis, and sequences of them."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import _quaternion
from rigid_envs.analytic._inputs import FloatArray, finite, positive

__all__ = ["roll_polygon", "roll_segments", "roll_straight"]


def roll_straight(displacement: ArrayLike, radius: float, *, twist: ArrayLike = 0.0) -> FloatArray:
    """Turn of a straight roll: the rotation vector (-d_y / radius, d_x / radius, twist).

    Args:
        displacement: way of the centre, shape (..., 2) [m], world.
        radius: of the ball [m].
        twist: angle spun about the vertical on the way, uniformly, broadcast with (...) [rad].

    Returns:
        Turn, shape (..., 4).

    Raises:
        ValueError: the displacement has not two components, or the radius is not positive.
    """
    positive(radius=radius)
    way = finite("displacement", displacement)
    if way.shape[-1:] != (2,):
        raise ValueError(f"displacement has shape {way.shape}; expected (..., 2)")
    parts = np.broadcast_arrays(-way[..., 1] / radius, way[..., 0] / radius, finite("twist", twist))
    return _quaternion.from_rotation_vector(np.stack(parts, axis=-1))


def roll_polygon(displacements: ArrayLike, radius: float) -> FloatArray:
    """Turn of straight rolls one after the other: their product, the last on the left.

    Args:
        displacements: way of the centre in each roll, shape (n, 2) [m], world.
        radius: of the ball [m].

    Returns:
        Turn, shape (4,).

    Raises:
        ValueError: a wrong shape, or the radius is not positive.
    """
    ways = finite("displacements", displacements)
    if ways.ndim != 2 or ways.shape[1] != 2:
        raise ValueError(f"displacements have shape {ways.shape}; expected (n, 2)")
    total = np.array([1.0, 0.0, 0.0, 0.0])
    for turn in roll_straight(ways, radius):
        total = _quaternion.product(turn, total)
    return total


def roll_segments(
    t: ArrayLike, segments: ArrayLike, radius: float
) -> tuple[FloatArray, FloatArray]:
    """Way and turn of a ball given one constant velocity after another.

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
    times, rows = finite("t", t), finite("segments", segments)
    if rows.ndim != 2 or rows.shape[1] != 4 or not np.all(rows[:, 3] >= 0.0):
        raise ValueError(f"segments are {rows.tolist()}; expected rows v_x, v_y, spin, duration")
    if not np.all((times >= 0.0) & (times <= np.sum(rows[:, 3]))):
        raise ValueError(
            f"t is {times.tolist()}; expected within the segments, 0 to {np.sum(rows[:, 3])} s"
        )
    way = np.zeros((*times.shape, 2))
    turn = np.broadcast_to(np.array([1.0, 0.0, 0.0, 0.0]), (*times.shape, 4))
    begin = np.cumsum(rows[:, 3]) - rows[:, 3]
    for (v_x, v_y, spin, duration), start in zip(rows, begin, strict=True):
        spent = np.clip(times - start, 0.0, duration)
        step = spent[..., np.newaxis] * np.array([v_x, v_y])
        way = way + step
        turn = _quaternion.product(roll_straight(step, radius, twist=spin * spent), turn)
    return way, turn
