"""Lines, parabolas, circles and trochoids: plates at rest and turntables, level or tilted."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic._phi import phi1, phi2
from rigid_envs.analytic.ball_on_plate._motion import Rolled, about_x, from_complex
from rigid_envs.checks import (
    Array,
    all_positive,
    array,
    exact_array,
    non_negative,
    number,
    positive,
    require,
)

__all__ = ["TurntableCircle", "drift_across_slope", "roll_on_plate", "turntable_circle"]


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
        about_x(exact_array(omega, "omega", 3), -lean),
    )
    v0 = 1j * (table * start - radius * complex(spin[0], spin[1]))
    fall = -1j * g * np.sin(lean) / (1.0 + beta)
    angle = beta / (1.0 + beta) * table * times
    z = start + times * (v0 * phi1(angle) + fall * times * phi2(angle))
    v = v0 * np.exp(1j * angle) + fall * times * phi1(angle)
    w = (table * z + 1j * v) / radius
    return Rolled(
        about_x(from_complex(z, radius), lean),
        about_x(from_complex(v, 0.0), lean),
        about_x(from_complex(w, spin[2]), lean),
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
