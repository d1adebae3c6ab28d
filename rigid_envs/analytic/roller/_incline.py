"""Rolling down an incline: the race that the smallest inertia ratio wins."""

import math
from dataclasses import dataclass

from rigid_envs.checks import all_positive, between, non_negative, number

__all__ = ["Descent", "descend"]


@dataclass(frozen=True)
class Descent:
    """State of a body that has rolled down an incline from rest.

    Attributes:
        acceleration: of the centre, down the slope [m/s^2].
        speed: of the centre at the end [m/s].
        time: taken [s].
        angular_velocity: speed / radius at the end [rad/s].
        turns: distance along the slope over the circumference.
        least_friction: coefficient of static friction below which the body slips.
        friction_over_weight: friction force, which points up the slope, over m g.
    """

    acceleration: float
    speed: float
    time: float
    angular_velocity: float
    turns: float
    least_friction: float
    friction_over_weight: float


def descend(height: float, *, slope: float, beta: float, radius: float, g: float) -> Descent:
    """Roll down an incline without slipping, from rest.

    a = g sin(slope) / (1 + beta),  v^2 = 2 g height / (1 + beta), whatever the slope, and friction
    F = m g sin(slope) beta / (1 + beta) <= mu m g cos(slope).

    Args:
        height: by which the centre sinks [m].
        slope: of the incline, above 0 and below pi / 2 [rad].
        beta: inertia ratio I / (m radius^2); 0 is a body that slides without friction, for which
            angular velocity and turns are those of a wheel without inertia.
        radius: of the body [m].
        g: gravity [m/s^2].

    Raises:
        ValueError: a number outside its range.

    Source: Goldstein, Classical Mechanics, sec. 2.4; Landau & Lifshitz, Mechanics, par. 38.
    """
    all_positive(height=height, radius=radius, g=g)
    non_negative(beta, "beta")
    between(number(slope, "slope"), "slope", 0.0, 0.5 * math.pi)
    acceleration = g * math.sin(slope) / (1.0 + beta)
    distance = height / math.sin(slope)
    speed = math.sqrt(2.0 * g * height / (1.0 + beta))
    return Descent(
        acceleration=acceleration,
        speed=speed,
        time=math.sqrt(2.0 * distance / acceleration),
        angular_velocity=speed / radius,
        turns=distance / (2.0 * math.pi * radius),
        least_friction=math.tan(slope) * beta / (1.0 + beta),
        friction_over_weight=math.sin(slope) * beta / (1.0 + beta),
    )
