"""A ball on a plate in closed form."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.base.checks import (
    Array,
    all_finite,
    all_positive,
    array,
    exact_array,
    non_negative,
    number,
    positive,
    require,
)
from rigid_envs.mechanics import special
from rigid_envs.mechanics.special import phi1, phi2

# Motions in world axes from complex numbers along the plate.


class Rolled(NamedTuple):
    """Motion of the ball at given times, world axes.

    Attributes:
        centre: shape (..., 3) [m].
        velocity: of the centre, shape (..., 3) [m/s].
        omega: angular velocity, shape (..., 3) [rad/s].
    """

    centre: Array
    velocity: Array
    omega: Array


def _from_complex(along: ArrayLike, normal: float) -> Array:
    """Vectors (real, imaginary, normal), shape (..., 3), of complex ones along the plate."""
    along = np.asarray(along)
    return _with_normal(np.stack([along.real, along.imag], axis=-1), normal)


def _with_normal(along: Array, normal: float) -> Array:
    """Vectors (x, y, normal), shape (..., 3)."""
    return np.concatenate([along, np.full_like(along[..., :1], normal)], axis=-1)


def _about_x(vectors: Array, angle: float | Array) -> Array:
    """Turn vectors, shape (..., 3), about x by the angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([x, c * y - s * z, s * y + c * z], axis=-1)


# Lines, parabolas, circles and trochoids: plates at rest and turntables, level or tilted.


@dataclass(frozen=True)
class TurntableCircle:
    """The circle of a ball on a level turntable, in space.

    Attributes:
        centre: shape (2,) [m].
        circle_radius: distance of the ball's centre from it [m].
        rate: angular velocity round it, k Omega [rad/s].
    """

    centre: Array
    circle_radius: float
    rate: float


def roll_on_plate(
    t: ArrayLike,
    place: ArrayLike,
    omega: ArrayLike,
    *,
    beta: float,
    radius: float,
    turntable_rate: float = 0.0,
    tilt: float = 0.0,
    g: float,
) -> Rolled:
    """Roll on a plate at rest or on a turntable, level or tilted.

    z = z0 + v0 t phi_1(x) - i g sin(tilt) / (1 + beta) t^2 phi_2(x) with x = k Omega t,
    phi_1 = (exp(i x) - 1) / (i x) and phi_2 = (exp(i x) - 1 - i x) / (i x)^2: a straight line, a
    parabola (tilted), a circle (turning) or a trochoid (both).

    Args:
        t: times, any shape [s].
        place: of the centre at t = 0, shape (2,) [m], plate axes.
        omega: angular velocity at t = 0, shape (3,) [rad/s], world; the velocity follows from it.
        beta: inertia ratio I / (m radius^2).
        radius: of the ball [m].
        turntable_rate: Omega about the plate's normal [rad/s].
        tilt: of the plate about world +x [rad].
        g: gravity [m/s^2].

    Returns:
        Centre, velocity and angular velocity, each of shape t.shape + (3,), world.

    Raises:
        ValueError: a wrong shape, or a number outside its range.

    Source: Neimark & Fufaev, ch. III; Weltner (1979).
    """
    all_positive(beta=beta, radius=radius)
    non_negative(g, "g")
    times = array(t, "t")
    lean, table = number(tilt, "tilt"), number(turntable_rate, "turntable_rate")
    start, spin = (
        complex(*exact_array(place, "place", 2)),
        _about_x(exact_array(omega, "omega", 3), -lean),
    )
    v0 = 1j * (table * start - radius * complex(spin[0], spin[1]))
    fall = -1j * g * np.sin(lean) / (1.0 + beta)
    angle = beta / (1.0 + beta) * table * times
    z = start + times * (v0 * phi1(angle) + fall * times * phi2(angle))
    v = v0 * np.exp(1j * angle) + fall * times * phi1(angle)
    w = (table * z + 1j * v) / radius
    return Rolled(
        _about_x(_from_complex(z, radius), lean),
        _about_x(_from_complex(v, 0.0), lean),
        _about_x(_from_complex(w, spin[2]), lean),
    )


def turntable_circle(
    place: ArrayLike, omega: ArrayLike, *, beta: float, radius: float, turntable_rate: float
) -> TurntableCircle:
    """Find the circle on which a ball runs on a level turntable.

    Its rate is k Omega whatever the start, its centre z0 + i v0 / (k Omega).

    Args:
        place: of the centre at t = 0, shape (2,) [m].
        omega: angular velocity at t = 0, shape (3,) [rad/s], world.
        beta: inertia ratio I / (m radius^2).
        radius: of the ball [m].
        turntable_rate: Omega about the vertical, not 0 [rad/s].

    Raises:
        ValueError: a turntable at rest, a wrong shape, or a number outside its range.

    Source: Weltner (1979).
    """
    _moving(turntable_rate)
    begin = roll_on_plate(
        0.0, place, omega, beta=beta, radius=radius, turntable_rate=turntable_rate, g=0.0
    )
    rate = beta / (1.0 + beta) * float(turntable_rate)
    to_centre = np.array([-begin.velocity[1], begin.velocity[0]]) / rate
    return TurntableCircle(begin.centre[:2] + to_centre, float(np.hypot(*to_centre)), rate)


def drift_across_slope(*, beta: float, turntable_rate: float, tilt: float, g: float) -> float:
    """Mean velocity of a ball on a tilted turntable, along plate +X [m/s].

    g sin(tilt) / ((1 + beta) k Omega) = g sin(tilt) / (beta Omega): it never runs away downhill.

    Args:
        beta: inertia ratio I / (m r^2).
        turntable_rate: Omega about the plate's normal, not 0 [rad/s].
        tilt: of the plate about world +x [rad].
        g: gravity [m/s^2].

    Raises:
        ValueError: a turntable at rest, or a number outside its range.

    Source: Neimark & Fufaev, ch. III.
    """
    positive(beta, "beta")
    non_negative(g, "g")
    return g * math.sin(number(tilt, "tilt")) / (beta * _moving(turntable_rate))


def _moving(turntable_rate: float) -> float:
    """Rate of a turntable, checked to turn [rad/s]."""
    rate = number(turntable_rate, "turntable_rate")
    expected = "a rate other than 0 [rad/s]: on a plate at rest nothing turns"
    require(rate != 0.0, turntable_rate, "turntable_rate", expected)
    return rate


# A ball on a plate that is shaken in its own plane.


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
        _with_normal(centre, radius),
        _with_normal(steady + share * plate_velocity, 0.0),
        _with_normal(np.stack([-slip[..., 1], slip[..., 0]], axis=-1), spin[2]),
    )


# The two motions on a level turntable that have a closed attitude: about its axis, and at rest.


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
        _from_complex(z, radius), _from_complex(1j * rate * z, 0.0), _from_complex(w * z, spin)
    )
    start = w * circle_radius * np.array([math.cos(phase), math.sin(phase), 0.0])
    steady = start + np.array([0.0, 0.0, spin - rate])
    inner = special.from_rotation_vector(times[..., np.newaxis] * steady)
    return motion, special.product(special.about_vertical(rate * times), inner)


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
    return omega, special.from_rotation_vector(array(t, "t")[..., np.newaxis] * omega)
