"""Poses that the elasticae of a box lead to, and whether a given one may be among them.

Poses are compared by what a turn of the plane leaves of them: with the position p and the
quaternion (w, v) as complex numbers p and b = 2 (v_x + i v_y),

    2 w,   2 v_z,   |p|^2,   Re(conj(p) b),   Im(conj(p) b).

Along a box (see `nearby`) these are linear in four numbers from -1 to 1, the three of the elastica
and the place within a step of the length, but for errors that are bounded. So a pose is not met if
a number that the five equations ask for is beyond its range by more than the errors.
"""

import math
from typing import NamedTuple

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.engine.algebra import Quaternion, Row, Vector, compose, cross, dot, scaled
from rigid_envs.engine.compiler import routine, scalar
from rigid_envs.engine.elementary import sincos
from rigid_envs.systems.rolling_ball import nearby
from rigid_envs.systems.rolling_ball.elastica import across
from rigid_envs.systems.rolling_ball.nearby import (
    BY_TURN,
    BY_X,
    CHANGE,
    CHANGE_RATE,
    HEADING,
    RATE,
    REST_RATE,
    SIZE,
    THETA,
    Q,
    X,
)

CENTRE = 1e-4  # more than the error of the middle of a box [rad, radii]
ROUNDING = 1e-6
_COLUMNS = 1e-3  # relative, more than the error of the changes of poses
_SINGULAR = 1e-9  # pivot of dependent equations, relative to the largest
_CURVED = 0.7  # a unit vector v / |v| leaves its tangent by less than this times (dv / v)^2


# Where a box leaves the set.


class Rim(NamedTuple):
    """Corner of the set where the elasticae of a box leave it, in axes along the force.

    Attributes:
        attitude: At the middle of the box.
        ahead: Direction of the position at the middle.
        moved: Its changes with the three numbers; two components each.
        turned: Those of the attitude, rotation vectors, three components each.
        rest: Remainder of the direction.
        angle_rest: That of the attitude [rad].
        angle: Largest change of the attitude [rad].
    """

    attitude: Quaternion
    ahead: tuple[float, float]
    moved: Row
    turned: Row
    rest: float
    angle_rest: float
    angle: float


@routine
def corner(swings: bool, mid: Vector, half: Vector, middle: float, n_middle: int, edge: float,
           nodes: Array) -> Rim:  # fmt: skip
    """Where the elasticae of a box leave the set.

    Their axes are along the heading at the middle of the path: they turn with it against the force.

    Args:
        swings: Of the family.
        mid: (rho, sigma, eps) of the middle.
        half: Half ranges.
        middle: Arc length at the middle of the path.
        n_middle: Its node.
        edge: Largest angle of the set [rad].
        nodes: Of `nearby.neighbours`, from the beginning of the path.
    """
    rho, m = mid[0], 1.0 if swings else 1.0 - mid[2]
    rate, force = nodes[0, RATE], 0.0 if swings else half[2]
    s, c = sincos(nodes[0, THETA])
    # turn of the axes, and its remainder
    b1, b2 = nodes[n_middle, RATE] * half[1], nodes[n_middle, CHANGE]
    axes_rest = nearby.rest_of(nodes, n_middle, min(1.0, m + force), half[1])
    axes = abs(b1) + abs(b2) + axes_rest
    (a0, a1, a2, a_rest), (r0, r1, r2, r_rest) = _begin(swings, mid, half, middle, nodes)
    a = abs(a0) + abs(a1) + abs(a2) + a_rest
    # size of the force
    p = m * rho * rho
    p0, p2 = 2.0 * m * rho * half[0], rho * rho * force
    p_rest = m * half[0] * half[0] + (2.0 * rho + half[0]) * half[0] * force
    # moment (-s, c - p, -rho rate) at the middle
    x, y = -s, c - p
    size = math.sqrt(x * x + y * y + rho * rho * rate * rate)
    level = math.sqrt(x * x + y * y)
    rest = a_rest + 0.5 * a * a + p_rest + r_rest
    rest += (axes_rest + 0.5 * axes * axes) * level + axes * (a + p0 + abs(p2) + p_rest)
    v0 = (-c * a0, -s * a0 - p0, -r0)
    v1 = (-c * a1 + b1 * y, -s * a1 - b1 * x, -r1)
    v2 = (-c * a2 + b2 * y, -s * a2 - p2 - b2 * x, -r2)
    change = math.sqrt(dot(v0, v0)) + math.sqrt(dot(v1, v1)) + math.sqrt(dot(v2, v2)) + rest
    # directions of the force and of the moment; without both, anywhere in the set
    ahead, moved = (1.0, 0.0), (0.0, 0.0, 0.0, -b1, 0.0, -b2)
    ahead_rest = axes_rest + 0.5 * axes * axes
    if ahead_rest + axes > 1.0 or m <= half[2] * (not swings):
        ahead, moved, ahead_rest = (0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 1.0
    if change >= 0.5 * size:
        none = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        return Rim((1.0, 0.0, 0.0, 0.0), ahead, moved, none, ahead_rest, edge, 0.0)
    over = 1.0 / size
    axis = (over * x, over * y, -over * rho * rate)
    relative = change / (size - change)
    sine, cosine = sincos(0.5 * edge)
    attitude = (cosine, sine * axis[0], sine * axis[1], sine * axis[2])
    t0, t1 = _turn(axis, v0, over, edge), _turn(axis, v1, over, edge)
    t2 = _turn(axis, v2, over, edge)
    turned = (t0[0], t0[1], t0[2], t1[0], t1[1], t1[2], t2[0], t2[1], t2[2])
    angle_rest = edge * (_CURVED * relative * relative + over * rest)
    return Rim(attitude, ahead, moved, turned, ahead_rest, angle_rest, 1.2 * edge * relative)


@routine
def _begin(swings: bool, mid: Vector, half: Vector, middle: float, nodes: Array) -> tuple[
    tuple[float, float, float, float], tuple[float, float, float, float]
]:  # fmt: skip
    """Changes of the first heading with the three numbers, and remainder; those of its rate."""
    rho, m, force = mid[0], 1.0 if swings else 1.0 - mid[2], 0.0 if swings else half[2]
    most, late = min(1.0, m + force), middle * half[0] + half[1]
    rate, pull = nodes[0, RATE], -m * sincos(nodes[0, THETA])[0]
    bent = nodes[0, REST_RATE] + (most * nodes[0, SIZE] + force) * late + most * late * late
    heading = (
        -rate * middle * half[0],
        rate * half[1],
        nodes[0, CHANGE],
        nearby.rest_of(nodes, 0, most, late),
    )
    return heading, (
        half[0] * (rate - rho * middle * pull),
        rho * pull * half[1],
        rho * nodes[0, CHANGE_RATE],
        (rho + half[0]) * bent + half[0] * (abs(nodes[0, CHANGE_RATE]) + most * late),
    )


@scalar
def _turn(axis: Vector, v: Vector, over: float, angle: float) -> Vector:
    """Rotation vector by which the turn by an angle about an axis changes with the moment."""
    sine, cosine = sincos(angle)
    w = scaled(over, across(axis, v))
    beside = cross(axis, w)
    f = 1.0 - cosine
    return (
        sine * w[0] + f * beside[0],
        sine * w[1] + f * beside[1],
        sine * w[2] + f * beside[2],
    )


# What a box leaves of a step of the length: the five numbers of its poses, see above.

W, V_Z, B_X, B_Y, P_X, P_Y = range(6)
"""Numbers of the pose at the middle of a box: 2 q, in this order, and the position."""

_DOUBLED, _POSITION, _BY_Q, _BY_P, N_PLACE = 6, 7, 8, 24, 32
"""Errors of 2 q and of the position; changes of 2 q and of the position with four numbers."""


@routine
def place(path: Array, j: int, rim: Rim, size: float, half_step: float, most_bent: float,
          integral: float, turned: float, out: Array) -> None:  # fmt: skip
    """Fill what is known of the poses of a box within half a step of a row of its path.

    Args:
        path: See `nearby.poses`.
        j: The row.
        rim: Where the box leaves the set.
        size: Largest deviation of a heading there.
        half_step: Of the length.
        most_bent: Largest curvature.
        integral: Of half the square of the deviation and of its remainder.
        turned: Of the deviation.
        out: Shape (32,); see above.
    """
    q = (path[j, Q], path[j, Q + 1], path[j, Q + 2], path[j, Q + 3])
    whole = compose(q, rim.attitude)
    s, c = sincos(path[j, HEADING])
    off = integral + _COLUMNS * turned + half_step * (size + 0.5 * most_bent * half_step) + CENTRE
    also = turned + rim.angle
    rest = off + rim.angle_rest + 0.25 * turned * turned
    rest += 0.5 * (turned * rim.angle + half_step * also)
    angle = 0.0
    for k in range(4):
        if k < 3:
            i = BY_TURN + 3 * k
            v = (
                path[j, i] + rim.turned[3 * k],
                path[j, i + 1] + rim.turned[3 * k + 1],
                path[j, i + 2] + rim.turned[3 * k + 2],
            )
            change = compose(compose(q, (0.0, v[0], v[1], v[2])), rim.attitude)
            out[_BY_P + 2 * k] = path[j, BY_X + 2 * k]
            out[_BY_P + 2 * k + 1] = path[j, BY_X + 2 * k + 1]
        else:
            v = (-half_step * s, half_step * c, 0.0)
            change = compose((0.0, v[0], v[1], v[2]), whole)
            out[_BY_P + 6], out[_BY_P + 7] = half_step * c, half_step * s
        angle += math.sqrt(dot(v, v))
        i = _BY_Q + 4 * k
        out[i], out[i + 1], out[i + 2], out[i + 3] = change[0], change[3], change[1], change[2]
    angle = min(angle, also + half_step) + rest
    out[W], out[V_Z], out[B_X], out[B_Y] = (
        2.0 * whole[0], 2.0 * whole[3], 2.0 * whole[1], 2.0 * whole[2]
    )  # fmt: skip
    out[P_X], out[P_Y] = path[j, X], path[j, X + 1]
    out[_DOUBLED], out[_POSITION] = 0.25 * angle * angle + rest, off


@routine
def is_near(path: Array, j: int, reach: float, radius: float, edge: float, target: Array,
             sign: float) -> bool:  # fmt: skip
    """Whether a pose may be within reach of a row of a path: a test that costs little.

    What leaves the set at its corner is turned by at most `edge`, and beside by at most the radius.
    Turns of the plane bring two attitudes no nearer than the parts that they change, b, can be.
    """
    near = math.sqrt(path[j, X] ** 2 + path[j, X + 1] ** 2)
    least, most = max(0.0, near - reach - radius), near + reach + radius
    if not least * least <= target[2] <= most * most:
        return False
    w, z, w1, z1 = 0.5 * sign * target[0], 0.5 * sign * target[1], path[j, Q], path[j, Q + 3]
    across = max(0.0, 1.0 - w * w - z * z) * max(0.0, 1.0 - w1 * w1 - z1 * z1)
    nearest = sincos(min(math.pi, 0.5 * (reach + edge)))[1]
    return bool(w * w1 + z * z1 + math.sqrt(across) >= nearest - ROUNDING)


@routine
def is_met(at: Array, rim: Rim, radius: float, target: Array, sign: float, m: Array) -> bool:
    """Whether a pose may be met by a box, within what `place` has filled.

    Args:
        at: Of `place`.
        rim: Where the box leaves the set.
        radius: Largest distance of the set [radii].
        target: Numbers of the pose, of either sign of its quaternion.
        sign: The sign.
        m: Room, shape (5, 6).
    """
    for i in range(2):
        beyond = abs(sign * target[i] - at[i]) - at[_DOUBLED]
        for k in range(4):
            beyond -= abs(at[_BY_Q + 4 * k + i])
        if beyond > 0.0:
            return False
    x, y = at[P_X] + radius * rim.ahead[0], at[P_Y] + radius * rim.ahead[1]
    off, off_q, b_x, b_y = at[_POSITION] + radius * rim.rest, at[_DOUBLED], at[B_X], at[B_Y]
    far = wide = 0.0
    for k in range(4):
        dx, dy = at[_BY_P + 2 * k], at[_BY_P + 2 * k + 1]
        if k < 3:
            dx, dy = dx + radius * rim.moved[2 * k], dy + radius * rim.moved[2 * k + 1]
        i = _BY_Q + 4 * k
        gx, gy = at[i + 2], at[i + 3]
        far += math.sqrt(dx * dx + dy * dy)
        wide += math.sqrt(gx * gx + gy * gy)
        m[0, k], m[1, k] = at[i], at[i + 1]
        m[2, k] = 2.0 * (x * dx + y * dy)
        m[3, k] = dx * b_x + dy * b_y + x * gx + y * gy
        m[4, k] = dx * b_y - dy * b_x + x * gy - y * gx
    distance, b = math.sqrt(x * x + y * y), math.sqrt(b_x * b_x + b_y * b_y)
    m[0, 5] = m[1, 5] = off_q
    m[2, 5] = 2.0 * distance * off + (far + off) ** 2
    m[3, 5] = m[4, 5] = distance * off_q + b * off + (far + off) * (wide + off_q)
    m[0, 4], m[1, 4] = sign * target[0] - at[W], sign * target[1] - at[V_Z]
    m[2, 4] = target[2] - x * x - y * y
    m[3, 4] = sign * target[3] - x * b_x - y * b_y
    m[4, 4] = sign * target[4] - x * b_y + y * b_x
    for i in range(2, 5):
        beyond = abs(m[i, 4]) - m[i, 5]
        for k in range(4):
            beyond -= abs(m[i, k])
        if beyond > 0.0:
            return False
    return not _asks_too_much(m)


@routine
def _asks_too_much(m: Array) -> bool:
    """Whether the five equations ask for a number beyond [-1, 1], whatever their errors are.

    Equations are weighted by their errors; the four numbers that solve them by least squares are
    linear in the right sides, and so are their errors.

    Args:
        m: Coefficients, right side and its error in each row, shape (5, 6); changed.
    """
    normal = np.zeros((4, 9))
    largest = 0.0
    for i in range(5):
        weight = 1.0 / m[i, 5]
        for j in range(5):
            m[i, j] *= weight
    for j in range(4):
        for k in range(4):
            for i in range(5):
                normal[j, k] += m[i, j] * m[i, k]
        for i in range(5):
            normal[j, 4 + i] = m[i, j]
        largest = max(largest, normal[j, j])
    for j in range(4):
        pivot = j
        for k in range(j + 1, 4):
            if abs(normal[k, j]) > abs(normal[pivot, j]):
                pivot = k
        if abs(normal[pivot, j]) < _SINGULAR * largest:
            return False
        scale = 1.0 / normal[pivot, j]
        for i in range(9):
            normal[j, i], normal[pivot, i] = normal[pivot, i], normal[j, i]
            normal[j, i] *= scale
        for k in range(4):
            if k != j:
                factor = normal[k, j]
                for i in range(9):
                    normal[k, i] -= factor * normal[j, i]
    for j in range(4):
        asked = error = 0.0
        for i in range(5):
            asked += normal[j, 4 + i] * m[i, 4]
            error += abs(normal[j, 4 + i])
        if abs(asked) > 1.0 + ROUNDING + error:
            return True
    return False
