"""A ball on a plate that is shaken in its own plane."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic.ball_on_plate._motion import Rolled, with_normal
from rigid_envs.checks import all_positive, array, exact_array

__all__ = ["roll_on_shaken_plate"]


def roll_on_shaken_plate(
    t: ArrayLike,
    place: ArrayLike,
    omega: ArrayLike,
    *,
    beta: float,
    radius: float,
    amplitudes: ArrayLike,
    frequencies: ArrayLike,
) -> Rolled:
    """Roll on a level plate that is shaken in its plane, O = (A sin(nu t), B sin(mu t)).

    The ball follows with the share k of the plate's acceleration: r'' = k O'' and
    omega = (-(r' - O')_y, (r' - O')_x) / radius.

    Args:
        t: times, any shape [s].
        place: of the centre at t = 0, where O = 0, shape (2,) [m].
        omega: angular velocity at t = 0, shape (3,) [rad/s], world; the velocity follows from it.
        beta: inertia ratio I / (m radius^2).
        radius: of the ball [m].
        amplitudes: A and B, shape (2,) [m].
        frequencies: nu and mu, shape (2,) [rad/s].

    Returns:
        Centre, velocity and angular velocity, each of shape t.shape + (3,), world.

    Raises:
        ValueError: a wrong shape, or a number outside its range.

    Source: Neimark & Fufaev, ch. III.
    """
    all_positive(beta=beta, radius=radius)
    times = array(t, "t")[..., np.newaxis]
    swing, nu = exact_array(amplitudes, "amplitudes", 2), exact_array(frequencies, "frequencies", 2)
    spin, share = exact_array(omega, "omega", 3), beta / (1.0 + beta)
    plate, plate_velocity = swing * np.sin(nu * times), swing * nu * np.cos(nu * times)
    # The velocity without the ball's share in the shaking stays as it is.
    steady = radius * np.array([spin[1], -spin[0]]) + (1.0 - share) * swing * nu
    centre = exact_array(place, "place", 2) + steady * times + share * plate
    slip = (steady - (1.0 - share) * plate_velocity) / radius
    return Rolled(
        with_normal(centre, radius),
        with_normal(steady + share * plate_velocity, 0.0),
        with_normal(np.stack([-slip[..., 1], slip[..., 0]], axis=-1), spin[2]),
    )
