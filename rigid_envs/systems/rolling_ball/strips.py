"""Elasticae of a large force: they stay in a narrow strip along it, and so do not lead everywhere.

With the force along e1 the heading theta of an elastica obeys ``theta'' = -p sin theta``, so
``theta' = w - p y`` for some w, with y measured across. The motions and their numbers are those
of `nearby`: ``theta' = rho Theta'``, ``p = rho^2 m`` (m = 1 where it swings).

From y(0) on the attitude is ``exp(-y e1) A exp(y(0) e1)``, with

    A' = x' (cos y e2 + sin y e3) A.

If y were 0, A would be the straight roll exp(x e2). It is beside that by at most

- the integral of ``|x'| |y|`` (`drift`); or
- where w = 0 (`sway`): with ``f = exp(-x e2) e3``, ``x' y f`` is the rate of ``g = -(sin theta /
  p) f`` but for ``(sin theta / p) f'``, so that the distance is at most

      2 |g| + int (|sin theta x'| / p + |x'| (y^2 / 2 + |y|^3 / 6) + |g| |g'| / 2) ds.

Integrals over a period are bounded cell by cell, for ranges of the parameter of the motion. Both
bounds and the width of the strip fall as rho grows: a pose that is out of reach of the strips of
some rho is so for all that are larger.
"""

import math
from typing import NamedTuple

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.engine.compiler import kernel, routine, scalar
from rigid_envs.engine.elementary import atan2, sincos
from rigid_envs.systems.rolling_ball import nearby

_CELLS = 400  # of half a period
_FINEST = 0.01  # half width of boxes at which a pose is taken to be in reach [radii, rad]
_DEEPEST = 400


class Strips(NamedTuple):
    """Bounds of the strips of some motions, for all rho from a least one.

    Attributes:
        width: Largest abs(y) [radii].
        fixed: Largest distance of A from a straight roll, of any length [rad].
        growth: And more for each period [rad].
        period: Least length of a period [radii].
    """

    width: float
    fixed: float
    growth: float
    period: float


@routine
def drift(rho: float, eps: tuple[float, float]) -> Strips:
    """Strips of turning motions about their mean rate, for eps from a least to a largest one."""
    m_low, m_high = 1.0 - eps[1], 1.0 - eps[0]
    low, high = math.sqrt(1.0 - m_low), math.sqrt(1.0 - m_high)
    total = 0.0
    for k in range(_CELLS):
        a, _ = sincos(0.5 * math.pi * k / _CELLS)
        b, _ = sincos(0.5 * math.pi * (k + 1) / _CELLS)
        a, b = a * a, b * b  # squares of sin(Theta / 2)
        # rho y is the second less the first of two parts, which both grow with m
        first = (1.0 - a) / (math.sqrt(1.0 - m_high * a) + high)
        least = (1.0 - b) / (math.sqrt(1.0 - m_low * b) + low)
        second, least_second = _rest(b, m_high), _rest(a, m_low)
        beside = max(abs(first - least_second), abs(second - least))
        level = max(abs(1.0 - 2.0 * a), abs(1.0 - 2.0 * b))
        total += beside * level / (2.0 * math.sqrt(1.0 - m_high * b))
    total *= 2.0 * math.pi / _CELLS
    width = 1.0 / (rho * (1.0 + high))
    return Strips(width, 0.0, total / rho**2, 2.0 * nearby.quarter_period(False, eps[1]) / rho)


@scalar
def _rest(a: float, m: float) -> float:
    return a / (1.0 + math.sqrt(1.0 - m * a))


@routine
def sway(swings: bool, rho: float, eps: tuple[float, float]) -> Strips:
    """Strips of motions about no rate, for eps from a least to a largest one.

    A half period is run through by an angle from -pi / 2 to pi / 2: half of Theta, or where it
    swings, that whose sine is sin(Theta / 2) / k. Half of Theta' is at most `per` times its rate.
    """
    k_low, k_high = (1.0 - eps[1], 1.0 - eps[0]) if swings else (1.0, 1.0)
    m = 1.0 if swings else 1.0 - eps[1]
    first = second = third = bent = most = 0.0
    h = 0.5 * math.pi / _CELLS
    for i in range(_CELLS):
        (a, c), (b, _) = sincos(h * i), sincos(h * (i + 1))
        a, b = k_low * a, k_high * b
        level = max(abs(1.0 - 2.0 * a * a), abs(1.0 - 2.0 * b * b))
        half_rate = k_high * c if swings else math.sqrt(1.0 - m * a * a)
        per = 1.0
        if swings:
            per = k_high * (min(1.0, c / math.sqrt(1.0 - b * b)) if b < 1.0 else 1.0)
        first += per * level
        second += per * level * half_rate
        third += per * level * half_rate**2
        bent += b * level
        most = max(most, 2.0 * b * math.sqrt(1.0 - a * a))
    first, second, third, bent = 4.0 * h * first, 8.0 * h * second, 16.0 * h * third, 4.0 * h * bent
    y, g = 1.0 / (m * rho), most / (m * rho**2)
    bent *= y / rho**2
    growth = bent + (0.5 * second * y**2 + third * y**3 / 6.0) / rho
    growth += 0.5 * g * (first * y / rho + bent)
    period = 2.0 * nearby.quarter_period(swings, eps[1]) / rho
    return Strips(2.0 * k_high * y, 2.0 * g, growth, period)


@kernel
def are_out_of_reach(swings: bool, rho: float, eps: tuple[float, float], targets: Array,
                     radii: Array, edge: float, limits: Array, out: Array) -> None:  # fmt: skip
    """Find the poses to which no elastica of a large force leads soon.

    Args:
        swings: Of the family.
        rho: The least one.
        eps: The least and the largest one.
        targets: Poses: turn and displacement [radii] from the middle of the set, shape (n, 6).
        radii: Largest distances of the set [radii], shape (n,).
        edge: Its largest angle [rad].
        limits: Lengths of paths that are asked about, shape (n,).
        out: Written, shape (n,).
    """
    first = sway(swings, rho, eps) if swings or eps[1] < 1.0 else drift(rho, eps)
    second = first if swings else drift(rho, eps)
    boxes = np.empty((_DEEPEST + 2, 6))
    for k in range(len(targets)):
        out[k] = False
        for strips in (first, second):
            periods = limits[k] / strips.period + 1.0
            beside = strips.fixed + strips.growth * periods
            out[k] = out[k] or not _is_in_reach(
                targets[k], radii[k], edge + beside, strips.width, limits[k], boxes
            )


@kernel
def are_beside_straight_rolls(
    bend: float, targets: Array, radii: Array, edge: float, limits: Array, out: Array
) -> None:
    """Find the poses that no path meets which is beside a straight roll by at most a bend.

    Args:
        bend: Largest distance, and largest angle [radii, rad].
        targets: See `are_out_of_reach`.
        radii: The same.
        edge: The same.
        limits: The same.
        out: Written, shape (n,).
    """
    boxes = np.empty((_DEEPEST + 2, 6))
    for k in range(len(targets)):
        out[k] = not _is_in_reach(targets[k], radii[k] + bend, edge + bend, 0.0, limits[k], boxes)


@routine
def _is_in_reach(target: Array, radius: float, edge: float, width: float, length: float,
                 boxes: Array) -> bool:  # fmt: skip
    """Whether a turn of the plane may lead from a strip's poses to within a distance and an angle.

    The poses are ``exp(-y1 e1) exp(x e2) exp(y0 e1)`` at (x, y1 - y0), with abs(x) up to a length.
    Boxes of x, y0 and y1 are halved until none is in reach, or one is that is small.
    """
    boxes[0, 0] = boxes[0, 1] = boxes[0, 2] = 0.0
    boxes[0, 3], boxes[0, 4], boxes[0, 5] = length, width, width
    n = 1
    while n > 0:
        n -= 1
        x, y0, y1, h_x, h_0, h_1 = boxes[n]
        sum_of = h_x + h_0 + h_1
        if not _meets(target, x, y0, y1, radius + sum_of, edge + sum_of):
            continue
        if max(h_x, h_0, h_1) < _FINEST or n + 2 > _DEEPEST:
            return True
        k = 0 if h_x >= max(h_0, h_1) else 1 if h_0 >= h_1 else 2
        for i in range(6):
            boxes[n + 1, i] = boxes[n, i]
        half = 0.5 * boxes[n, 3 + k]
        boxes[n, k] -= half
        boxes[n + 1, k] += half
        boxes[n, 3 + k] = boxes[n + 1, 3 + k] = half
        n += 2
    return False


@routine
def _meets(target: Array, x: float, y0: float, y1: float, radius: float, edge: float) -> bool:
    """Whether a turn of the plane may bring a target within a distance and an angle of a pose."""
    far, near = math.sqrt(target[4] ** 2 + target[5] ** 2), math.sqrt(x * x + (y1 - y0) ** 2)
    if abs(far - near) > radius:
        return False
    most, bearing = math.pi, 0.0  # the target is turned by the bearing and at most this to a side
    if far * near > 0.0:
        share = (radius**2 - (far - near) ** 2) / (4.0 * far * near)
        if share < 1.0:
            most = 2.0 * atan2(math.sqrt(share), math.sqrt(1.0 - share))
        bearing = atan2(y1 - y0, x) - atan2(target[5], target[4])
    (s_x, c_x), (s_0, c_0), (s_1, c_1) = sincos(0.5 * x), sincos(0.5 * y0), sincos(-0.5 * y1)
    # exp(-y1 e1) exp(x e2) exp(y0 e1)
    w, z = c_x * (c_1 * c_0 - s_1 * s_0), s_x * (s_1 * c_0 - c_1 * s_0)
    b_x, b_y = c_x * (c_1 * s_0 + s_1 * c_0), s_x * (c_1 * c_0 + s_1 * s_0)
    upright = target[0] * w + target[3] * z
    level = math.sqrt((target[1] ** 2 + target[2] ** 2) * (b_x * b_x + b_y * b_y))
    turn = atan2(target[2], target[1]) - atan2(b_y, b_x) + bearing
    turn = abs(turn - 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5))
    nearest = sincos(max(0.0, turn - most))[1]
    farthest = sincos(min(math.pi, turn + most))[1]
    cosine = max(upright + level * nearest, -upright - level * farthest)
    return not cosine < sincos(min(math.pi, 0.5 * edge))[1]
