"""Rolling along Euler's elasticae, and a shooting method for those that end at a given pose.

Lengths are in radii of the ball, angles from the first heading. The centre runs along (cos a, sin
a), a the angle of a pendulum, ``a'' = Y cos a - X sin a``, and rolling turns the ball. With the arc
length divided by the length L as parameter t, five numbers define a path: the row

    x = (first heading [rad], a'(0), X, Y, L),   ' = d/dt,   0 <= t <= 1.

A step is split: the heading drifts for half a step, the ball rolls straight while (X, Y) changes
a', the heading drifts for half a step. So the path is a polygon of fourth order, along which the
ball turns by exact rotations. The derivatives by x are those of the polygon itself, so that
Newton's method converges quadratically for any number of sides.

Source: Jurdjevic 1993, "The geometry of the plate-ball problem", doi:10.1007/BF00375605.
"""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.engine.algebra import (
    SUZUKI,
    Row,
    Vector,
    compose,
    cross,
    dot,
    log_rotation,
    normalize_near_unit,
    rotate,
    rotate_inverse,
    scaled,
)
from rigid_envs.engine.compiler import kernel, routine, scalar
from rigid_envs.engine.elementary import atan2, fma, sincos

Columns = tuple[Row, Row, Row, Row]

_CONSTANT = (0.0,) * 7  # a derivative of (a, a', position, turn in body axes)
_UNITS = (1.0, 3.0, 10.0, 10.0, 0.2)  # scales of a Newton step in x, the last relative to L
_N_ROUNDS = 30
_EXACT = 1e-12  # radii and rad; largest residual of an accepted path
_DEPENDENT = 1e-24  # squared norm below which an equation is dependent


@scalar
def vary(
    d: Row, g: float, slope: float, kick: float, roll: float, per_heading: Row, per_roll: Row
) -> Row:
    """Derivative d after a step; that of a' changes by `slope` times that of a, plus `kick`."""
    a = fma(0.5 * g, d[1], d[0])
    rate = d[1] + fma(slope, a, kick)
    return (
        fma(0.5 * g, rate, a),
        rate,
        fma(a, per_heading[0], fma(roll, per_roll[0], d[2])),
        fma(a, per_heading[1], fma(roll, per_roll[1], d[3])),
        fma(a, per_heading[2], fma(roll, per_roll[2], d[4])),
        fma(a, per_heading[3], fma(roll, per_roll[3], d[5])),
        fma(a, per_heading[4], fma(roll, per_roll[4], d[6])),
    )


@scalar
def step(y: Row, d: Columns, x: Row, g: float) -> tuple[Row, Columns]:
    """Step of y = (a, a', q, position) by the fraction g of the path; d are derivatives by x[1:].

    A roll r along u = (c, s, 0) turns the ball by r about (-s, c, 0). A change da of the heading
    changes this rotation by da (-sin r u + (1 - cos r) e_z).
    """
    a = fma(0.5 * g, y[1], y[0])
    s, c = sincos(a)
    rate = fma(g, fma(c, x[3], -s * x[2]), y[1])
    slope = -g * fma(s, x[3], c * x[2])
    r = g * x[4]
    sine, cosine = sincos(0.5 * r)
    q = compose((cosine, -sine * s, sine * c, 0.0), (y[2], y[3], y[4], y[5]))
    back = -2.0 * sine * cosine
    per_heading = (-r * s, r * c, *rotate_inverse(q, (back * c, back * s, 2.0 * sine * sine)))
    per_roll = (c, s, *rotate_inverse(q, (-s, c, 0.0)))
    d = (
        vary(d[0], g, slope, 0.0, 0.0, per_heading, per_roll),
        vary(d[1], g, slope, -g * s, 0.0, per_heading, per_roll),
        vary(d[2], g, slope, g * c, 0.0, per_heading, per_roll),
        vary(d[3], g, slope, 0.0, g, per_heading, per_roll),
    )
    return (fma(0.5 * g, rate, a), rate, *q, fma(r, c, y[6]), fma(r, s, y[7])), d


@routine
def follow(y: Row, d: Columns, x: Row, part: float, n: int) -> tuple[Row, Columns]:
    """Advance by a fraction of the path in n steps."""
    for _ in range(n):
        for weight in SUZUKI:
            y, d = step(y, d, x, weight * part / n)
        w, i, j, k = normalize_near_unit((y[2], y[3], y[4], y[5]))
        y = (y[0], y[1], w, i, j, k, y[6], y[7])
    return y, d


@scalar
def first(x: Row) -> tuple[Row, Columns]:
    """State y and derivatives d at the start of the path."""
    by_rate = (0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    y = (0.0, x[1], 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return y, (by_rate, _CONSTANT, _CONSTANT, _CONSTANT)


@scalar
def seen_from(heading: float, pose: Row) -> Row:
    """Pose (q, position) in axes turned about the vertical by a heading."""
    s, c = sincos(heading)
    w, x, y, z, px, py = pose
    return (w, fma(c, x, s * y), fma(c, y, -s * x), z, fma(c, px, s * py), fma(c, py, -s * px))


@scalar
def toward(v: Vector, smooth: float) -> tuple[Vector, float]:
    """``v / s`` and 1 / s with ``s = sqrt(|v|^2 + smooth^2)``: a direction, that of 0 is 0."""
    square = fma(smooth, smooth, dot(v, v))
    inverse = 1.0 / math.sqrt(square) if square > 0.0 else 0.0
    return scaled(inverse, v), inverse


@scalar
def across(direction: Vector, v: Vector) -> Vector:
    """Part of a vector across a direction."""
    along = dot(direction, v)
    return (
        fma(-along, direction[0], v[0]),
        fma(-along, direction[1], v[1]),
        fma(-along, direction[2], v[2]),
    )


@scalar
def costates(x: Row) -> tuple[Vector, Vector]:
    """Costate of the first pose: force P and moment M, in axes along the first heading.

    The switching vector ``P + (M_y, -M_x)`` is (1, 0), and a' = -L M_z.
    """
    scale = 1.0 / x[4]
    px, py = scale * scale * x[2], scale * scale * x[3]
    return (px, py, 0.0), (py, 1.0 - px, -scale * x[1])


@scalar
def costate_changes(x: Row, k: int) -> tuple[Vector, Vector]:
    """Derivatives of `costates` by x[k + 1]."""
    scale = 1.0 / x[4]
    square = scale * scale
    if k == 0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, -scale)
    if k == 1:
        return (square, 0.0, 0.0), (0.0, -square, 0.0)
    if k == 2:
        return (0.0, square, 0.0), (square, 0.0, 0.0)
    px, py = -2.0 * scale * square * x[2], -2.0 * scale * square * x[3]
    return (px, py, 0.0), (py, -px, square * x[1])


@routine
def linearise(x: Row, target: Row, edge: Vector, n: int, m: Array) -> float:
    """Fill m, (5, 6), with Jacobian and residual of the end pose; returns the largest residual.

    The path begins at the edge of the set of poses (q, p) with |p| <= edge[0] [radii] and an angle
    of at most edge[1]: as the maximum principle asks, p is along the force and the rotation vector
    along the moment of the costate, out of the set.

    Rows are position and rotation vector in axes along the first heading: a rotation of the path is
    represented by the opposite rotation of the target.
    """
    force, moment = costates(x)
    ahead, over_force = toward(force, edge[2])
    axis, over_moment = toward(moment, 0.0)
    sine, cosine = sincos(0.5 * edge[1])
    y, d = first(x)
    y, d = follow(y, d, x, 1.0, n)
    w, gx, gy, gz, px, py = seen_from(x[0], target)
    path, goal = (y[2], y[3], y[4], y[5]), (w, gx, gy, gz)
    q = compose(path, (cosine, sine * axis[0], sine * axis[1], sine * axis[2]))
    up = rotate(goal, (0.0, 0.0, 1.0))
    m[0, 0], m[1, 0], m[2, 0], m[3, 0], m[4, 0] = -py, px, -up[0], -up[1], 1.0 - up[2]
    for k in range(4):
        by_force, by_moment = costate_changes(x, k)
        shift = scaled(edge[0] * over_force, across(ahead, by_force))
        v = scaled(2.0 * sine * over_moment, across(axis, by_moment))
        beside = cross(axis, v)
        # a change of the axis turns by (sin b) change + (1 - cos b) axis x change, b the angle
        turned = rotate(
            path,
            (
                fma(cosine, v[0], fma(sine, beside[0], d[k][4])),
                fma(cosine, v[1], fma(sine, beside[1], d[k][5])),
                fma(cosine, v[2], fma(sine, beside[2], d[k][6])),
            ),
        )
        m[0, k + 1], m[1, k + 1] = d[k][2] + shift[0], d[k][3] + shift[1]
        m[2, k + 1], m[3, k + 1], m[4, k + 1] = turned
    m[0, 5] = px - y[6] - edge[0] * ahead[0]
    m[1, 5] = py - y[7] - edge[0] * ahead[1]
    m[2, 5], m[3, 5], m[4, 5] = log_rotation(compose(goal, (q[0], -q[1], -q[2], -q[3])))
    missed = 0.0
    for i in range(5):
        missed = max(missed, abs(m[i, 5]))
    return missed


@routine
def solve(m: Array, step: Array) -> None:
    """Fill `step` with the least-norm solution of m[:, :5] step = m[:, 5], each part clipped.

    Equations are orthogonalised by Gram-Schmidt with pivoting on the largest, and the step along
    each is clipped to [-1, 1]. Dependent equations are left out: there is one where a rotation of
    the whole path has no effect.
    """
    step[:] = 0.0
    for k in range(5):
        largest, size = k, -1.0
        for i in range(k, 5):
            square = 0.0
            for j in range(5):
                square += m[i, j] * m[i, j]
            if square > size:
                largest, size = i, square
        if size < _DEPENDENT:
            return
        scale = 1.0 / math.sqrt(size)
        for j in range(6):
            m[k, j], m[largest, j] = m[largest, j], m[k, j]
            m[k, j] *= scale
        asked = max(-1.0, min(1.0, m[k, 5]))
        for j in range(5):
            step[j] += asked * m[k, j]
        for i in range(k + 1, 5):
            part = 0.0
            for j in range(5):
                part += m[i, j] * m[k, j]
            for j in range(6):
                m[i, j] -= part * m[k, j]


@routine
def shoot(x: Array, target: Row, edge: Vector, reach: float, n: int, m: Array, step: Array) -> None:
    """Newton's method from x, shape (5,), in place; an infinite length marks failure."""
    for _ in range(_N_ROUNDS):
        if linearise((x[0], x[1], x[2], x[3], x[4]), target, edge, n, m) <= _EXACT:
            return
        for j in range(5):
            unit = reach * _UNITS[j] * (x[4] if j == 4 else 1.0)
            for i in range(5):
                m[i, j] *= unit
        solve(m, step)
        for j in range(5):
            x[j] += reach * step[j] * _UNITS[j] * (x[4] if j == 4 else 1.0)
    x[4] = math.inf


@kernel
def shoot_rows(x: Array, target: Array, edge: Vector, reach: float, n: int) -> None:
    """Newton's method from each row of x, shape (N, 5), for a path to the target, in place.

    The target is a pose (q, X, Y), the first pose at the edge of a set (see `linearise`); paths are
    polygons of n steps. An infinite length marks failure.
    """
    goal = (target[0], target[1], target[2], target[3], target[4], target[5])
    m, step = np.empty((5, 6)), np.empty(5)
    for i in range(x.shape[0]):
        shoot(x[i], goal, edge, reach, n, m, step)


@kernel
def face_rows(x: Array, target: Array, n: int) -> None:
    """Set the first heading of each path so that its end is nearest to the target.

    In complex numbers the rotation by the angle of P / p brings the final position p nearest to the
    target P; the same holds for x + i y of the quaternions, with either sign. The sum of the
    squares of distance and (to first order) angle is minimal.
    """
    for i in range(x.shape[0]):
        row = (0.0, x[i, 1], x[i, 2], x[i, 3], x[i, 4])
        y, d = first(row)
        y, d = follow(y, d, row, 1.0, n)
        best = -math.inf
        for weight in (4.0, -4.0):
            re = fma(y[6], target[4], y[7] * target[5])
            im = fma(y[6], target[5], -y[7] * target[4])
            re = fma(weight, fma(y[3], target[1], y[4] * target[2]), re)
            im = fma(weight, fma(y[3], target[2], -y[4] * target[1]), im)
            same = weight * fma(y[2], target[0], y[5] * target[3])
            match = same + math.sqrt(re * re + im * im)
            if match > best:
                best, x[i, 0] = match, atan2(im, re)


@kernel
def trace(x: Array, n: int, out: Array) -> None:
    """Fill out, (M + 1, 8), with (a, a', q, position) at equal intervals of n steps each."""
    row = (x[0], x[1], x[2], x[3], x[4])
    y, d = first(row)
    for i in range(out.shape[0]):
        for j in range(8):
            out[i, j] = y[j]
        y, d = follow(y, d, row, 1.0 / (out.shape[0] - 1), n)
