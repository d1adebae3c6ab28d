"""Elasticae near one another: where all of a box of them lead, to first order and how far beside.

Measured from its force, the heading of an elastica is a motion of the pendulum. Along the arc
length s [radii] it is

    Theta(rho (s - middle) + sigma; eps)

with Theta a motion that is at the bottom at the time 0. It turns round, ``Theta'' = -(1 - eps) sin
Theta`` from ``Theta'(0) = 2``, or swings, ``Theta'' = -sin Theta`` from ``Theta'(0) = 2 (1 -
eps)``. So (rho, sigma, eps) choose an elastica but for a turn of the plane and a reflection, in
each of the two families, and near the separatrix, eps = 0, they choose it well. A box is a range of
each. What is said of it holds for all of its elasticae: the heading is that of the middle of the
box, a change that is linear in the numbers, and a remainder that is bounded.

- By eps: the deviation z from the motion of the middle has the equation of the linear one and a
  force of at most ``m/2 |sin| z^2 + |d eps| |z|``. The response to it is an integral with the
  kernel of the linear equation, bounded cell by cell.
- By rho and sigma, which shift the time alone: Taylor's formula.

Headings are compared in axes along the heading at the middle of the path: so the ends deviate
least. The pose then follows by quadrature.
"""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.engine.algebra import Quaternion, Vector, compose, half_turn, rotate_inverse
from rigid_envs.engine.compiler import routine, scalar
from rigid_envs.engine.elementary import atan2, clamp, sincos

N_LANDEN = 12
THETA, RATE, CHANGE, CHANGE_RATE, REST, REST_RATE, SIZE = range(7)
"""Columns of nodes: motion of the middle of a box; its change with eps, times the half range; the
remainders of both; the largest deviation. The last is infinite where nothing is known."""

Z, TURNED, BESIDE, SLOPE, HEADING, Q, X, BY_X, BY_TURN, N_PATH = 0, 3, 4, 5, 8, 9, 13, 15, 21, 30
"""Columns of paths: changes of the heading with the three numbers; remainder and largest
deviation of the heading; slopes of the changes; heading; attitude; position; their changes."""

Phase = tuple[float, float, float, float]

_GAUSS = 0.5 - math.sqrt(3.0) / 6.0
_NEAR, _FAR = 0.25 + math.sqrt(3.0) / 6.0, 0.25 - math.sqrt(3.0) / 6.0


# The pendulum.


@routine
def landen(m1: float, table: Array) -> int:
    """Fill rows 0 and 1 of a table with the arithmetic-geometric mean of 1 and sqrt(m1).

    Returns:
        Index of the last column. The quarter period is pi / 2 over the first row there.
    """
    a, b, c, n = 1.0, math.sqrt(m1), math.sqrt(1.0 - m1), 0
    table[0, 0], table[1, 0] = a, c
    while c > 1e-16 * a and n < N_LANDEN - 1:
        a, b, c = 0.5 * (a + b), math.sqrt(a * b), 0.5 * (a - b)
        n += 1
        table[0, n], table[1, n] = a, c
    return n


@routine
def phase(m1: float, table: Array, n: int, t: float) -> Phase:
    """Amplitude am(t) and the functions sn, cn, dn of Jacobi, of the complementary parameter m1.

    With the table of `landen` (Abramowitz & Stegun 16.4).
    """
    phi = table[0, n] * t * (1 << n)
    for k in range(n, 0, -1):
        sine = clamp(table[1, k] / table[0, k] * sincos(phi)[0], -1.0, 1.0)
        phi = 0.5 * (phi + atan2(sine, math.sqrt(1.0 - sine * sine)))
    sn, cn = sincos(phi)
    return phi, sn, cn, math.sqrt(m1 + (1.0 - m1) * cn * cn)


@scalar
def later(m1: float, a: Phase, b: Phase) -> Phase:
    """The phase of a sum of two times (A&S 16.17); the second is less than half a period."""
    _, s, c, d = a
    _, s1, c1, d1 = b
    m = 1.0 - m1
    over = 1.0 / (1.0 - m * s * s * s1 * s1)
    sn = over * (s * c1 * d1 + c * d * s1)
    cn = over * (c * c1 - s * d * s1 * d1)
    dn = over * (d * d1 - m * s * c * s1 * c1)
    return a[0] + atan2(sn * c - cn * s, cn * c + sn * s), sn, cn, dn


@scalar
def motion(swings: bool, m1: float, a: Phase) -> tuple[float, float]:
    """Angle and rate of a unit pendulum at a phase."""
    phi, sn, cn, dn = a
    modulus = math.sqrt(1.0 - m1)
    if swings:
        return 2.0 * atan2(modulus * sn, dn), 2.0 * modulus * cn
    return 2.0 * phi, 2.0 * dn


@scalar
def between(a: Vector, b: Vector, h: float, t: float) -> float:
    """Value at the fraction t of a step h, from values and two derivatives at both of its ends."""
    d = b[0] - a[0] - h * (a[1] + 0.5 * h * a[2])
    e = h * (b[1] - a[1] - h * a[2])
    f = h * h * (b[2] - a[2])
    c3, c4 = 10.0 * d - 4.0 * e + 0.5 * f, -15.0 * d + 7.0 * e - f
    c5 = 6.0 * d - 3.0 * e + 0.5 * f
    return a[0] + t * (h * a[1] + t * (0.5 * h * h * a[2] + t * (c3 + t * (c4 + t * c5))))


# Motions near one: by eps.

_LONGEST = 0.125  # step of the time, before a path begins
_LARGEST = 3.0  # deviation beyond which nothing is said
_FARTHEST = 1.2  # deviation of headings beyond which a path is not followed
_INEXACT = 1e-3  # relative, more than the error of the linear equation's solutions


@scalar
def response(y: tuple[float, float], h: float, pull: Vector, force: Vector) -> tuple[float, float]:
    """Step h of ``y'' = pull y + force`` by Runge and Kutta, from (y, y'); theirs at 0, h/2, h."""
    v, a = y[1], pull[0] * y[0] + force[0]
    v2, a2 = y[1] + 0.5 * h * a, pull[1] * (y[0] + 0.5 * h * v) + force[1]
    v3, a3 = y[1] + 0.5 * h * a2, pull[1] * (y[0] + 0.5 * h * v2) + force[1]
    v4, a4 = y[1] + h * a3, pull[2] * (y[0] + h * v3) + force[2]
    return (
        y[0] + h / 6.0 * (v + 2.0 * (v2 + v3) + v4),
        y[1] + h / 6.0 * (a + 2.0 * (a2 + a3) + a4),
    )


@routine
def noise(swings: bool, half: float, most: float, sine: float, rate: float, b: float, slope: float,
          h: float) -> float:  # fmt: skip
    """Bound of what drives the remainder, within h of a node.

    Args:
        swings: Of the family.
        half: Half of the range of eps.
        most: Largest coefficient of the sine.
        sine: That of the angle, its size.
        rate: Of the angle, its size.
        b: Largest deviation at the node.
        slope: That of its rate.
        h: Step.
    """
    force = 0.0 if swings else half
    b = (b + h * slope + 0.5 * h * h * force) / (1.0 - 0.5 * h * h)
    sine = min(1.0, sine + h * rate + 0.5 * h * h + b)
    return 0.5 * most * sine * b * b + force * b


@routine
def neighbours(
    swings: bool, eps: float, half: float, base: float, step: float, n: int, table: Array,
    nodes: Array, cells: Array,
) -> None:  # fmt: skip
    """Fill nodes (n + 1, 7), at the times base + k step, with the motions of a range of eps.

    Args:
        swings: Of the family.
        eps: Middle of the range.
        half: Its half.
        base: First time.
        step: Between nodes.
        n: Number of steps.
        table: Room for `landen`, shape (2, 12).
        nodes: Written.
        cells: Room for the cells between 0 and a node, shape (., 3).
    """
    m1 = eps * (2.0 - eps) if swings else eps
    n_landen = landen(m1, table)
    here, ahead = phase(m1, table, n_landen, base), phase(m1, table, n_landen, step)
    for k in range(n + 1):
        nodes[k, THETA], nodes[k, RATE] = motion(swings, m1, here)
        nodes[k, SIZE] = math.inf
        here = later(m1, here, ahead)
    bottom = math.floor(-base / step)  # 0 lies in the step after this node
    for forward in (True, False):
        first = max(0, bottom + 1) if forward else min(n, bottom)
        if first < 0 or first > n:
            continue
        # times of steps of their own lead to the first node, where it is far
        there = base + first * step
        n_before = max(1, math.ceil(abs(there) / _LONGEST))
        _away(swings, eps, half, m1, table, n_landen, there, n_before, step, first,
              n if forward else 0, nodes, cells)  # fmt: skip


@routine
def _away(
    swings: bool, eps: float, half: float, m1: float, table: Array, n_landen: int, there: float,
    n_before: int, step: float, first: int, last: int, nodes: Array, cells: Array,
) -> None:  # fmt: skip
    """The part of `neighbours` from the bottom to one side: to the time of the first node, on."""
    m = 1.0 if swings else 1.0 - eps
    most = 1.0 if swings else min(1.0, m + half)
    sign = 1 if last >= first else -1
    c, d, u = (1.0, 0.0), (0.0, 1.0), (0.0, 2.0 if swings else 0.0)
    none = (0.0, 0.0, 0.0)
    here, ahead = (0.0, 0.0, 1.0, 1.0), phase(m1, table, n_landen, there / n_before)
    angle, rate = motion(swings, m1, here)
    rest = rest_rate = 0.0
    for k in range(min(cells.shape[0], n_before + abs(last - first))):
        h = there / n_before if k < n_before else sign * step
        a = (angle, rate, -m * sincos(angle)[0])
        cells[k, 0], cells[k, 1] = c[0], d[0]
        cells[k, 2] = abs(h) / (1.0 - 0.125 * h * h) * noise(
            swings, half, most, abs(sincos(angle)[0]), abs(rate), abs(u[0]) * half + rest,
            abs(u[1]) * half + rest_rate, abs(h))  # fmt: skip
        node = first + sign * (k + 1 - n_before)
        if k + 1 < n_before:
            here = later(m1, here, ahead)
            angle, rate = motion(swings, m1, here)
        else:
            angle, rate = nodes[node, THETA], nodes[node, RATE]
        b = (angle, rate, -m * sincos(angle)[0])
        pull, force = _linear(swings, m, a, b, h)
        c = response(c, h, pull, none)
        d = response(d, h, pull, none)
        u = response(u, h, pull, force)
        rest, rest_rate = _answer(k, c, d, cells)
        rest += _INEXACT * half * abs(u[0])
        rest_rate += _INEXACT * half * abs(u[1])
        size = abs(u[0]) * half + rest
        if not size < _LARGEST:
            return
        if k + 1 >= n_before:
            nodes[node, CHANGE], nodes[node, CHANGE_RATE] = u[0] * half, u[1] * half
            nodes[node, REST], nodes[node, REST_RATE] = rest, rest_rate
            nodes[node, SIZE] = size


@scalar
def _linear(swings: bool, m: float, a: Vector, b: Vector, h: float) -> tuple[Vector, Vector]:
    """Coefficients and forces of the linear equation, at the ends of a step and between."""
    middle = between(a, b, h, 0.5)
    (s1, c1), (s2, c2), (s3, c3) = sincos(a[0]), sincos(middle), sincos(b[0])
    weight = 0.0 if swings else -1.0
    return (-m * c1, -m * c2, -m * c3), (weight * s1, weight * s2, weight * s3)


@routine
def _answer(
    k: int, c: tuple[float, float], d: tuple[float, float], cells: Array
) -> tuple[float, float]:
    """Bounds of the remainder and its rate at the end of cell k: Duhamel's integral.

    Args:
        k: The cell.
        c: Solution of the linear equation from (1, 0), and its rate.
        d: That from (0, 1).
        cells: The solutions at the beginning of each cell, and what drives there, times the step.
    """
    rest = rest_rate = before = 0.0
    before_rate = 1.0
    for i in range(k, -1, -1):
        one = abs(cells[i, 0] * d[0] - cells[i, 1] * c[0])
        one_rate = abs(cells[i, 0] * d[1] - cells[i, 1] * c[1])
        rest += max(one, before) * cells[i, 2]
        rest_rate += max(one_rate, before_rate) * cells[i, 2]
        before, before_rate = one, one_rate
    return rest, rest_rate


# Headings of a box, in axes along the heading at the middle of the path.


@routine
def deviations(swings: bool, mid: Vector, half: Vector, step: float, n_middle: int, n: int,
               nodes: Array, path: Array) -> int:  # fmt: skip
    """Fill the headings of a path, as far as they are known well; see `neighbours`.

    Args:
        swings: Of the family.
        mid: (rho, sigma, eps) of the middle.
        half: Half ranges.
        step: Of the arc length.
        n_middle: The node of the middle of the path.
        n: The last node.
        nodes: Of `neighbours`.
        path: Written.

    Returns:
        The last node that is known. Before the middle, less: -1 where the motion of a node is not
        known, else -2 less the node whose heading is not.
    """
    m = 1.0 if swings else 1.0 - mid[2]
    most = 1.0 if swings else min(1.0, m + half[2])
    if not max(nodes[0, SIZE], nodes[n_middle, SIZE]) < _LARGEST:
        return -1
    here = (0.0, nodes[n_middle, RATE] * half[1], nodes[n_middle, CHANGE])
    rest_here = rest_of(nodes, n_middle, most, half[1])
    for j in range(n + 1):
        known = nodes[j, SIZE] < _LARGEST
        near = False
        if known:
            s = (j - n_middle) * step
            rate, pull = nodes[j, RATE], -m * sincos(nodes[j, THETA])[0]
            path[j, Z] = rate * s * half[0] - here[0]
            path[j, Z + 1] = rate * half[1] - here[1]
            path[j, Z + 2] = nodes[j, CHANGE] - here[2]
            path[j, SLOPE] = half[0] * (mid[0] * pull * s + rate)
            path[j, SLOPE + 1] = half[1] * mid[0] * pull
            path[j, SLOPE + 2] = mid[0] * nodes[j, CHANGE_RATE]
            path[j, HEADING] = nodes[j, THETA]
            late = abs(s) * half[0] + half[1]
            rest = 0.0 if j == n_middle else rest_of(nodes, j, most, late) + rest_here
            path[j, TURNED] = rest
            size = abs(path[j, Z]) + abs(path[j, Z + 1]) + abs(path[j, Z + 2]) + rest
            path[j, BESIDE] = size
            near = size < _FARTHEST
        if not near:
            return j - 1 if j > n_middle else -2 - j if known else -1
    return n


@routine
def rest_of(nodes: Array, j: int, most: float, late: float) -> float:
    """Remainder of an angle, for times up to `late` away from that of a node."""
    bent = min(1.0, abs(sincos(nodes[j, THETA])[0]) + nodes[j, SIZE] + 2.0 * late)
    rate = abs(nodes[j, CHANGE_RATE]) + nodes[j, REST_RATE]
    return float(nodes[j, REST] + rate * late + 0.5 * most * bent * late * late)


# Poses of a box.


@scalar
def rolled(x: float, y: float) -> Quaternion:
    """Turn of a ball that rolls straight by (x, y), less than a quarter turn [radii]."""
    return half_turn((-0.5 * y, 0.5 * x, 0.0))


@scalar
def _cubic(a: float, slope_a: float, b: float, slope_b: float, h: float, t: float) -> float:
    """Hermite's interpolation at the fraction t of a step h."""
    u = 1.0 - t
    return u * u * ((1.0 + 2.0 * t) * a + h * t * slope_a) + t * t * (
        (3.0 - 2.0 * t) * b - h * u * slope_b
    )


@routine
def poses(step: float, last: int, nodes: Array, path: Array, rho: float, m: float) -> None:
    """Fill the poses along the middle of a box, and their changes, by Gauss's two points a step.

    Attitudes and positions are from the first node on. The change of an attitude q is ``q v / 2``,
    with v in the columns from `BY_TURN`.
    """
    path[0, Q:N_PATH] = 0.0
    path[0, Q] = 1.0
    h = step
    for j in range(last):
        q = (path[j, Q], path[j, Q + 1], path[j, Q + 2], path[j, Q + 3])
        a = (nodes[j, THETA], nodes[j, RATE], -m * sincos(nodes[j, THETA])[0])
        b = (nodes[j + 1, THETA], nodes[j + 1, RATE], -m * sincos(nodes[j + 1, THETA])[0])
        s1, c1 = sincos(between(a, b, rho * h, _GAUSS))
        s2, c2 = sincos(between(a, b, rho * h, 1.0 - _GAUSS))
        turn = rolled(h * (_NEAR * c1 + _FAR * c2), h * (_NEAR * s1 + _FAR * s2))
        then = rolled(h * (_FAR * c1 + _NEAR * c2), h * (_FAR * s1 + _NEAR * s2))
        end = compose(then, compose(turn, q))
        v1 = rotate_inverse(compose(rolled(_GAUSS * h * c1, _GAUSS * h * s1), q), (-c1, -s1, 0.0))
        v2 = rotate_inverse(
            compose(rolled(-_GAUSS * h * c2, -_GAUSS * h * s2), end), (-c2, -s2, 0.0)
        )
        w = 0.5 * h
        path[j + 1, X] = path[j, X] + w * (c1 + c2)
        path[j + 1, X + 1] = path[j, X + 1] + w * (s1 + s2)
        path[j + 1, Q], path[j + 1, Q + 1], path[j + 1, Q + 2], path[j + 1, Q + 3] = end
        for k in range(3):
            z, slope = path[j, k], path[j, SLOPE + k]
            later, then_slope = path[j + 1, k], path[j + 1, SLOPE + k]
            z1 = _cubic(z, slope, later, then_slope, h, _GAUSS)
            z2 = _cubic(z, slope, later, then_slope, h, 1.0 - _GAUSS)
            path[j + 1, BY_X + 2 * k] = path[j, BY_X + 2 * k] - w * (s1 * z1 + s2 * z2)
            path[j + 1, BY_X + 2 * k + 1] = path[j, BY_X + 2 * k + 1] + w * (c1 * z1 + c2 * z2)
            for i in range(3):
                change = w * (v1[i] * z1 + v2[i] * z2)
                path[j + 1, BY_TURN + 3 * k + i] = path[j, BY_TURN + 3 * k + i] + change


@routine
def go_on(j: int, ahead: float, step: float, last: int, rho: float, m: float, nodes: Array,
          path: Array) -> None:  # fmt: skip
    """Fill the last row of a path with what is known at an arc length beside that of row j.

    Changes of the pose are continued straight: the error is of the order of the deviation times
    the square of the distance.

    Args:
        j: The row.
        ahead: By how much the arc length is larger, at most half a step.
        step: Between rows.
        last: The last row that is known.
        rho: Of the middle of the box.
        m: Coefficient of the sine there.
        nodes: Of `neighbours`.
        path: Changed.
    """
    out = path.shape[0] - 1
    side = 1 if (ahead > 0.0 and j < last) or j == 0 else -1
    a = (nodes[j, THETA], nodes[j, RATE], -m * sincos(nodes[j, THETA])[0])
    b = (nodes[j + side, THETA], nodes[j + side, RATE], -m * sincos(nodes[j + side, THETA])[0])
    h, t = side * rho * step, ahead / (side * step)
    s1, c1 = sincos(between(a, b, h, t * _GAUSS))
    s2, c2 = sincos(between(a, b, h, t * (1.0 - _GAUSS)))
    x, y = 0.5 * ahead * (c1 + c2), 0.5 * ahead * (s1 + s2)
    q = (path[j, Q], path[j, Q + 1], path[j, Q + 2], path[j, Q + 3])
    s, c = sincos(path[j, HEADING])
    v = rotate_inverse(q, (-c, -s, 0.0))
    path[out] = path[j]
    path[out, HEADING] = between(a, b, h, t)
    path[out, Q], path[out, Q + 1], path[out, Q + 2], path[out, Q + 3] = compose(rolled(x, y), q)
    path[out, X] += x
    path[out, X + 1] += y
    for k in range(3):
        z = ahead * path[j, k]
        path[out, BY_X + 2 * k] -= s * z
        path[out, BY_X + 2 * k + 1] += c * z
        for i in range(3):
            path[out, BY_TURN + 3 * k + i] += v[i] * z


@routine
def quarter_period(swings: bool, eps: float) -> float:
    """That of the motion of the unit pendulum [its time]; infinite on the separatrix."""
    m1 = eps * (2.0 - eps) if swings else eps
    if m1 <= 0.0:
        return math.inf
    table = np.empty((2, N_LANDEN))
    return float(0.5 * math.pi / table[0, landen(m1, table)])
