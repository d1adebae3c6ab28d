"""Rolling round a circle: omega is constant in a frame that turns with the centre."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import _quaternion
from rigid_envs.checks import Array, all_finite, all_positive, array, positive, positive_array

__all__ = ["circle_holonomy", "circle_rotation_vector", "roll_circle"]


def roll_circle(
    t: ArrayLike,
    *,
    radius: float,
    circle_radius: float,
    rate: float,
    phase: float = 0.0,
    spin: float = 0.0,
) -> tuple[Array, Array]:
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
    all_positive(radius=radius, circle_radius=circle_radius)
    all_finite(rate=rate, phase=phase, spin=spin)
    times = array(t, "t")
    angle = phase + rate * times
    place = circle_radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    steady = np.array([-circle_radius / radius * rate, 0.0, spin - rate])
    inner = _quaternion.from_rotation_vector(times[..., np.newaxis] * steady)
    turn = _quaternion.product(inner, _quaternion.about_vertical(np.full_like(times, -phase)))
    return place, _quaternion.product(_quaternion.about_vertical(angle), turn)


def circle_holonomy(circle_radius: ArrayLike, radius: float, *, phase: float = 0.0) -> Array:
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
    all_finite(phase=phase)
    rho = positive_array(circle_radius, "circle_radius", "m") / positive(radius, "radius", "m")
    root = np.sqrt(1.0 + rho * rho)
    angle = 2.0 * np.pi * rho * rho / (1.0 + root)  # 2 pi (root - 1), without the cancellation
    axis = np.stack([-rho * np.cos(phase), -rho * np.sin(phase), -np.ones_like(rho)], axis=-1)
    return _quaternion.from_rotation_vector((angle / root)[..., np.newaxis] * axis)


def circle_rotation_vector(
    circle_radius: ArrayLike, radius: float, *, phase: float = 0.0, spin_per_rate: float = 0.0
) -> Array:
    """Rotation vector of one counter-clockwise round, whole turns included.

    2 pi (-rho, 0, spin / rate - 1) for rho = circle_radius / radius, turned about z by the phase.
    Its length without spin is 2 pi sqrt(1 + rho^2); `circle_holonomy` is its rotation.

    Args:
        circle_radius: of the circle that the centre runs on, any shape [m].
        radius: of the ball [m].
        phase: angle of the centre at the start, from world x [rad].
        spin_per_rate: constant omega_z of the ball over the angular velocity of the centre.

    Returns:
        Rotation vector, shape circle_radius.shape + (3,) [rad], world.

    Raises:
        ValueError: a radius that is not positive.

    Source: Hammersley (1983).
    """
    all_finite(phase=phase, spin_per_rate=spin_per_rate)
    rho = positive_array(circle_radius, "circle_radius", "m") / positive(radius, "radius", "m")
    vertical = np.full_like(rho, spin_per_rate - 1.0)
    return 2.0 * np.pi * np.stack([-rho * np.cos(phase), -rho * np.sin(phase), vertical], axis=-1)
