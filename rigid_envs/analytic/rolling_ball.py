"""Attitude of a ball that rolls without slip on the plane z = 0, in closed form.

v = omega x radius e_z in world axes, so that omega = (-v_y / radius, v_x / radius, spin). Straight
rolls are rotations about horizontal axes; along a circle omega is constant in a frame that turns
with the centre, and two rotations are enough. What is left when the centre is back is the holonomy:
a small counter-clockwise loop of area A turns the ball by -A / radius^2 about the vertical.

A *turn* is the rotation that the roll added, a unit quaternion (w, x, y, z) in world axes:
attitude after = turn * attitude before.

Sources: Hammersley (1983), Oxford commemoration ball, in Probability, Statistics and Analysis, LMS
Lecture Notes 79; Jurdjevic (1993), Arch. Rational Mech. Anal. 124:305, doi:10.1007/BF00375605.
"""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import _quaternion
from rigid_envs.analytic._inputs import FloatArray, finite, positive

__all__ = [
    "circle_holonomy",
    "roll_circle",
    "roll_polygon",
    "roll_segments",
    "roll_straight",
]


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


def roll_circle(
    t: ArrayLike,
    *,
    radius: float,
    circle_radius: float,
    rate: float,
    phase: float = 0.0,
    spin: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Place and turn of a ball whose centre runs uniformly round a circle about the origin.

    With rho = circle_radius / radius and angle = phase + rate t, omega is Rz(angle) w for the
    constant w = (-rho rate, 0, spin), hence

        turn = Rz(angle) exp(t (w - rate e_z)) Rz(-phase).

    Args:
        t: times, any shape [s].
        radius: of the ball [m].
        circle_radius: of the circle that the centre runs on [m].
        rate: angular velocity of the centre, positive counter-clockwise [rad/s].
        phase: angle of the centre at t = 0, from world x [rad].
        spin: constant omega_z of the ball [rad/s].

    Returns:
        Position of the centre from the circle's own centre, shape t.shape + (2,) [m], and turn
        since t = 0, shape t.shape + (4,).

    Raises:
        ValueError: a radius that is not positive.
    """
    positive(radius=radius, circle_radius=circle_radius)
    times = finite("t", t)
    angle = phase + rate * times
    place = circle_radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    steady = np.array([-circle_radius / radius * rate, 0.0, spin - rate])
    inner = _quaternion.from_rotation_vector(times[..., np.newaxis] * steady)
    turn = _quaternion.product(inner, _about_vertical(np.full_like(times, -phase)))
    return place, _quaternion.product(_about_vertical(angle), turn)


def circle_holonomy(circle_radius: ArrayLike, radius: float, *, phase: float = 0.0) -> FloatArray:
    """Turn of one round of a circle, counter-clockwise, without spin about the vertical.

    exp(2 pi (-rho, 0, -1)) for rho = circle_radius / radius, turned about z by the phase. Less one
    whole turn, its angle is 2 pi (sqrt(1 + rho^2) - 1): for small circles pi rho^2 = A / radius^2
    about -z, for rho = sqrt(3) nothing at all. Clockwise it is the inverse.

    Args:
        circle_radius: of the circle that the centre runs on, any shape [m].
        radius: of the ball [m].
        phase: angle of the centre at the start, from world x [rad].

    Returns:
        Turn, shape circle_radius.shape + (4,).

    Raises:
        ValueError: a radius that is not positive.
    """
    positive(radius=radius, circle_radius=circle_radius)
    rho = np.asarray(circle_radius, dtype=np.float64) / radius
    root = np.sqrt(1.0 + rho * rho)
    angle = 2.0 * np.pi * rho * rho / (1.0 + root)  # 2 pi (root - 1), without the cancellation
    axis = np.stack([-rho * np.cos(phase), -rho * np.sin(phase), -np.ones_like(rho)], axis=-1)
    return _quaternion.from_rotation_vector((angle / root)[..., np.newaxis] * axis)


def _about_vertical(angle: FloatArray) -> FloatArray:
    """Quaternion of a rotation about world z, shape (..., 4)."""
    zero = np.zeros_like(angle)
    return _quaternion.from_rotation_vector(np.stack([zero, zero, angle], axis=-1))
