"""Rolling and sliding down inclines and in valleys in closed form."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.base import checks
from rigid_envs.mechanics import special

# Rolling down an incline: the race that the smallest inertia ratio wins.


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
    checks.all_positive(height=height, radius=radius, g=g)
    checks.non_negative(beta, "beta")
    checks.between(checks.number(slope, "slope"), "slope", 0.0, 0.5 * math.pi)
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


# A ball that slides on level ground until friction has made it roll.


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
    velocity: checks.Array
    omega: checks.Array
    position: checks.Array
    slip: checks.Array
    omega_rate: checks.Array


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
    checks.all_positive(beta=beta, radius=radius, mu=mu, g=g)
    v, w = checks.exact_array(velocity, "velocity", 2), checks.exact_array(omega, "omega", 3)
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
) -> tuple[checks.Array, checks.Array, checks.Array]:
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
    times = checks.array(t, "t")
    checks.require(times >= 0.0, times, "t", "at least 0, the start [s]")
    times = times[..., np.newaxis]
    left = np.maximum(end.time - times, 0.0)  # of the sliding
    rate = (np.asarray(velocity) - end.velocity) / end.time if end.time > 0.0 else np.zeros(2)
    position = end.position + (times - end.time) * end.velocity - 0.5 * left * left * rate
    return position, end.velocity + left * rate, end.omega - left * end.omega_rate


# A roller in a circular valley: the rolling pendulum, by Jacobi elliptic functions.


@dataclass(frozen=True)
class Swing:
    """The oscillation of a roller through the bottom of a valley, or its run round the circle.

    With the angle a = curvature s of the centre and w = sqrt(g curvature / (1 + beta)) the motion
    keeps k^2 = sin^2(a / 2) + (a' / (2 w))^2, below 1 where the roller swings.

    Attributes:
        period: time from one passage of the bottom to the next in the same sense [s]; infinite on
            the way to the top.
        reach: largest distance from the bottom along the path [m]; infinite where the roller runs
            round.
        modulus: k.
        m1: complementary parameter of the elliptic functions, abs(1 - k^2), over k^2 where k > 1.
        rate: of their argument [rad/s].
        start: argument at t = 0.
        sense: +1, or -1 where the motion is mirrored so that it starts forwards.
        rounds: whole circles that the start is away from the bottom.
    """

    period: float
    reach: float
    modulus: float
    m1: float
    rate: float
    start: float
    sense: float
    rounds: float


def swing(s0: float, v0: float, *, curvature: float, beta: float, g: float) -> Swing:
    """Find period, reach and elliptic constants of a roller from any initial state.

    Args:
        s0: place of the centre along its path, 0 at the bottom [m].
        v0: velocity along the path [m/s].
        curvature: 1 / rho of the circle that the centre moves on [1/m].
        beta: inertia ratio I / (m r^2).
        g: gravity [m/s^2].

    Raises:
        ValueError: a number outside its range.

    Source: Whittaker, Analytical Dynamics, par. 44; DLMF 22.19(i).
    """
    checks.all_positive(curvature=curvature, g=g)
    checks.non_negative(beta, "beta")
    slow = math.sqrt(g * curvature / (1.0 + beta))
    angle, sense = checks.number(s0, "s0") * curvature, math.copysign(1.0, checks.number(v0, "v0"))
    rounds = round(angle / (2.0 * math.pi))
    half = sense * (0.5 * angle - math.pi * rounds)
    sine, cosine = math.sin(half), max(math.cos(half), 0.0)
    climb = abs(v0) * curvature / (2.0 * slow)
    k = math.hypot(sine, climb)
    left = (cosine - climb) * (cosine + climb)  # 1 - k^2
    if left >= 0.0:
        start = special.argument(sine / (k or 1.0), climb / k if k else 1.0, cosine)
        reach = 2.0 * math.atan2(k, math.sqrt(left)) / curvature
        period = 4.0 * special.quarter_period(left) / slow
        return Swing(period, reach, k, left, slow, float(start), sense, float(rounds))
    start, m1 = special.argument(sine, cosine, climb / k), -left / (k * k)
    period = 2.0 * special.quarter_period(m1) / (k * slow)
    return Swing(period, math.inf, k, m1, k * slow, float(start), sense, float(rounds))


def valley(
    t: ArrayLike, s0: float, v0: float, *, curvature: float, beta: float, g: float
) -> tuple[checks.Array, checks.Array]:
    """Place and velocity of a roller in a circular valley at any time.

    s' = v,  (1 + beta) v' = -g sin(curvature s). With the angle a = curvature s,

        sin(a / 2) = k sn u,  cos(a / 2) = dn u,  a' = 2 w k cn u,    u = start + w t,

    for k < 1; sin(a / 2) = sn u,  cos(a / 2) = cn u,  a' = 2 w k dn u,  u = start + k w t beyond.

    Args:
        t: times, any shape [s].
        s0: place of the centre along its path at t = 0, 0 at the bottom [m].
        v0: velocity along the path at t = 0 [m/s].
        curvature: 1 / rho of the circle that the centre moves on [1/m].
        beta: inertia ratio I / (m r^2).
        g: gravity [m/s^2].

    Returns:
        s [m] and v [m/s], of the shape of t; s goes on growing where the roller runs round.

    Raises:
        ValueError: a number outside its range.

    Source: Whittaker, Analytical Dynamics, par. 44; DLMF 22.19(i).
    """
    path = swing(s0, v0, curvature=curvature, beta=beta, g=g)
    u = path.start + path.rate * checks.array(t, "t")
    if math.isfinite(path.reach):
        sn, cn, dn = special.jacobi(u, path.m1)
        half, speed = np.arctan2(path.modulus * sn, dn), path.modulus * path.rate * cn
    else:
        n, v = special.split_half_periods(u, path.m1)
        sn, cn, dn = special.jacobi(v, path.m1)
        half, speed = np.pi * n + np.arctan2(sn, cn), path.rate * dn
    place = 2.0 * (path.sense * half + np.pi * path.rounds) / curvature
    return np.asarray(place), np.asarray(2.0 * path.sense * speed / curvature)


# A wheel on level ground, and the cycloid that a point of its rim draws.


def roll_wheel(t: ArrayLike, *, radius: float, omega: float) -> tuple[checks.Array, checks.Array]:
    """Paths of a uniformly rolling wheel's centre, and of the rim point that starts on the ground.

    x_centre = radius omega t, and the cycloid with its cusps on the ground

        x = radius (angle - sin(angle)),  y = radius (1 - cos(angle)),  angle = omega t.

    Args:
        t: times, any shape [s].
        radius: of the wheel [m].
        omega: angular velocity, positive where the wheel rolls towards +x [rad/s].

    Returns:
        x of the centre, of the shape of t [m], and the rim point (x, height above the ground),
        shape t.shape + (2,) [m].

    Raises:
        ValueError: a radius that is not positive, or a number that is not finite.

    Source: Goldstein, Classical Mechanics, sec. 1.3; Whittaker, Analytical Dynamics, ch. I.
    """
    checks.positive(radius, "radius")
    angle = checks.number(omega, "omega") * checks.array(t, "t")
    centre = radius * angle
    # 1 - cos = 2 sin^2(angle / 2) keeps the digits of the height beside the cusp.
    height = 2.0 * radius * np.sin(0.5 * angle) ** 2
    return centre, np.stack([centre - radius * np.sin(angle), height], axis=-1)


def cycloid_arch_length(radius: float) -> float:
    """Length of the path of a rim point from ground to ground, 8 radius [m].

    Args:
        radius: of the wheel [m].

    Raises:
        ValueError: a radius that is not positive.

    Source: Wren (1658), in Wallis, De Cycloide.
    """
    checks.positive(radius, "radius")
    return 8.0 * radius
