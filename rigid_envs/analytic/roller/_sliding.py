"""A ball that slides on level ground until friction has made it roll."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array, all_positive, array, exact_array, require

__all__ = ["SlipToRoll", "slide", "slip_to_roll"]


@dataclass(frozen=True)
class SlipToRoll:
    """Sliding phase of a ball and the rolling that follows; world axes, z up.

    Attributes:
        time: at which the ball begins to roll [s].
        velocity: of the centre from then on, shape (2,) [m/s].
        omega: angular velocity from then on, shape (3,) [rad/s].
        position: of the centre where it begins to roll, from its start, shape (2,) [m].
        slip: velocity of the contact point at the start, shape (2,) [m/s]; it dies out linearly.
        omega_rate: constant angular acceleration while sliding, shape (3,) [rad/s^2].
    """

    time: float
    velocity: Array
    omega: Array
    position: Array
    slip: Array
    omega_rate: Array


def slip_to_roll(
    velocity: ArrayLike, omega: ArrayLike, *, beta: float, radius: float, mu: float, g: float
) -> SlipToRoll:
    """Follow a sliding ball until it rolls.

    Friction mu m g points against the slip u = v + omega x (-radius e_z) and never changes its
    direction e, for u' = -mu g (1 + 1 / beta) e: the centre runs along a parabola and

        t_roll = abs(u) beta / ((1 + beta) mu g),  v_final = v - u beta / (1 + beta).

    Args:
        velocity: of the centre, shape (2,) [m/s], world.
        omega: angular velocity, shape (3,) [rad/s], world; omega_z does not change.
        beta: inertia ratio I / (m radius^2).
        radius: of the ball [m].
        mu: coefficient of sliding friction.
        g: gravity [m/s^2].

    Raises:
        ValueError: a wrong shape, or a parameter that is not positive.

    Source: Sommerfeld, Mechanics, par. 27, on the high and low shots in billiards; Coriolis (1835).
    """
    all_positive(beta=beta, radius=radius, mu=mu, g=g)
    v, w = exact_array(velocity, "velocity", 2), exact_array(omega, "omega", 3)
    slip = v + radius * np.array([-w[1], w[0]])
    speed = float(np.hypot(*slip))
    e = slip / speed if speed > 0.0 else np.zeros(2)
    time = speed * beta / ((1.0 + beta) * mu * g)
    omega_rate = mu * g / (beta * radius) * np.array([-e[1], e[0], 0.0])
    final = v - beta / (1.0 + beta) * slip
    return SlipToRoll(
        time=time,
        velocity=final,
        omega=w + time * omega_rate,
        position=0.5 * time * (v + final),
        slip=slip,
        omega_rate=omega_rate,
    )


def slide(
    t: ArrayLike,
    velocity: ArrayLike,
    omega: ArrayLike,
    *,
    beta: float,
    radius: float,
    mu: float,
    g: float,
) -> tuple[Array, Array, Array]:
    """Place, velocity and angular velocity of a ball that slides first and rolls then.

    Args:
        t: times from 0 on, any shape [s].
        velocity: of the centre at t = 0, shape (2,) [m/s], world.
        omega: angular velocity at t = 0, shape (3,) [rad/s], world.
        beta: inertia ratio I / (m radius^2).
        radius: of the ball [m].
        mu: coefficient of sliding friction.
        g: gravity [m/s^2].

    Returns:
        Displacement of the centre since t = 0, shape t.shape + (2,) [m], its velocity, the same
        shape [m/s], and the angular velocity, shape t.shape + (3,) [rad/s], world.

    Raises:
        ValueError: as `slip_to_roll`, or a negative time.

    Source: Sommerfeld, Mechanics, par. 27.
    """
    end = slip_to_roll(velocity, omega, beta=beta, radius=radius, mu=mu, g=g)
    times = array(t, "t")
    require(times >= 0.0, times, "t", "at least 0, the start [s]")
    times = times[..., np.newaxis]
    left = np.maximum(end.time - times, 0.0)  # of the sliding
    rate = (np.asarray(velocity) - end.velocity) / end.time if end.time > 0.0 else np.zeros(2)
    position = end.position + (times - end.time) * end.velocity - 0.5 * left * left * rate
    return position, end.velocity + left * rate, end.omega - left * end.omega_rate
