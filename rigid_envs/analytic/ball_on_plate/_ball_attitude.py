"""The two motions on a level turntable that have a closed attitude: about its axis, and at rest."""

import math

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import _quaternion
from rigid_envs.analytic.ball_on_plate._motion import Rolled, from_complex
from rigid_envs.checks import Array, all_finite, all_positive, array, exact_array, number, positive

__all__ = ["roll_round_axis", "stand_in_space"]


def roll_round_axis(
    t: ArrayLike,
    *,
    circle_radius: float,
    phase: float = 0.0,
    spin: float = 0.0,
    beta: float,
    radius: float,
    turntable_rate: float,
) -> tuple[Rolled, Array]:
    """Roll on a level turntable round its own axis, where the attitude is closed, too.

    omega turns with the centre, its horizontal part Omega / (1 + beta) times the centre's place
    over the radius, and with w = k Omega

        turn = Rz(w t) exp(t (omega0 - w e_z)).

    For a circle about any other point omega has a second, constant part, and the attitude is a
    spin in two fields: there is no elementary form.

    Args:
        t: times, any shape [s].
        circle_radius: distance of the ball's centre from the axis [m].
        phase: angle of the centre at t = 0, from world x [rad].
        spin: omega_z [rad/s].
        beta: inertia ratio I / (m radius^2).
        radius: of the ball [m].
        turntable_rate: Omega about the vertical [rad/s].

    Returns:
        Motion, and turn since t = 0, a quaternion (w, x, y, z) of shape t.shape + (4,) with
        attitude after = turn * attitude before.

    Raises:
        ValueError: a number outside its range.

    Source: Weltner (1979).
    """
    all_positive(beta=beta, radius=radius, circle_radius=circle_radius)
    all_finite(phase=phase, spin=spin)
    times, table = array(t, "t"), number(turntable_rate, "turntable_rate")
    rate = beta / (1.0 + beta) * table
    z = circle_radius * np.exp(1j * (phase + rate * times))
    w = table / (1.0 + beta) / radius
    motion = Rolled(
        from_complex(z, radius), from_complex(1j * rate * z, 0.0), from_complex(w * z, spin)
    )
    start = w * circle_radius * np.array([math.cos(phase), math.sin(phase), 0.0])
    steady = start + np.array([0.0, 0.0, spin - rate])
    inner = _quaternion.from_rotation_vector(times[..., np.newaxis] * steady)
    return motion, _quaternion.product(_quaternion.about_vertical(rate * times), inner)


def stand_in_space(
    t: ArrayLike, place: ArrayLike, *, spin: float = 0.0, radius: float, turntable_rate: float
) -> tuple[Array, Array]:
    """Roll on a level turntable with the centre at rest in space.

    omega = (Omega X / radius, Omega Y / radius, spin), constant, whatever the inertia.

    Args:
        t: times, any shape [s].
        place: of the centre, shape (2,) [m].
        spin: omega_z [rad/s].
        radius: of the ball [m].
        turntable_rate: Omega about the vertical [rad/s].

    Returns:
        Angular velocity, shape (3,) [rad/s], world, and turn since t = 0, shape t.shape + (4,).

    Raises:
        ValueError: a wrong shape, or a number outside its range.

    Source: Weltner (1979).
    """
    positive(radius, "radius")
    x, y = number(turntable_rate, "turntable_rate") / radius * exact_array(place, "place", 2)
    omega = np.array([x, y, number(spin, "spin")])
    return omega, _quaternion.from_rotation_vector(array(t, "t")[..., np.newaxis] * omega)
