"""A roller in a circular valley: the rolling pendulum, by Jacobi elliptic functions."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import elliptic
from rigid_envs.checks import Array, all_positive, array, non_negative, number

__all__ = ["Swing", "swing", "valley"]


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
    all_positive(curvature=curvature, g=g)
    non_negative(beta, "beta")
    slow = math.sqrt(g * curvature / (1.0 + beta))
    angle, sense = number(s0, "s0") * curvature, math.copysign(1.0, number(v0, "v0"))
    rounds = round(angle / (2.0 * math.pi))
    half = sense * (0.5 * angle - math.pi * rounds)
    sine, cosine = math.sin(half), max(math.cos(half), 0.0)
    climb = abs(v0) * curvature / (2.0 * slow)
    k = math.hypot(sine, climb)
    left = (cosine - climb) * (cosine + climb)  # 1 - k^2
    if left >= 0.0:
        start = elliptic.argument(sine / (k or 1.0), climb / k if k else 1.0, cosine)
        reach = 2.0 * math.atan2(k, math.sqrt(left)) / curvature
        period = 4.0 * elliptic.quarter_period(left) / slow
        return Swing(period, reach, k, left, slow, float(start), sense, float(rounds))
    start, m1 = elliptic.argument(sine, cosine, climb / k), -left / (k * k)
    period = 2.0 * elliptic.quarter_period(m1) / (k * slow)
    return Swing(period, math.inf, k, m1, k * slow, float(start), sense, float(rounds))


def valley(
    t: ArrayLike, s0: float, v0: float, *, curvature: float, beta: float, g: float
) -> tuple[Array, Array]:
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
    u = path.start + path.rate * array(t, "t")
    if math.isfinite(path.reach):
        sn, cn, dn = elliptic.jacobi(u, path.m1)
        half, speed = np.arctan2(path.modulus * sn, dn), path.modulus * path.rate * cn
    else:
        n, v = elliptic.split_half_periods(u, path.m1)
        sn, cn, dn = elliptic.jacobi(v, path.m1)
        half, speed = np.pi * n + np.arctan2(sn, cn), path.rate * dn
    place = 2.0 * (path.sense * half + np.pi * path.rounds) / curvature
    return np.asarray(place), np.asarray(2.0 * path.sense * speed / curvature)
