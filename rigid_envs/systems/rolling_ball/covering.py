"""Search of boxes of elasticae for those that are at a pose too soon: a proof, if none is left.

The paths are those of `least_path`, from a set of poses to a pose. By the maximum principle a
shortest one is an elastica that leaves the set at its corner, the position along the force and the
rotation vector along the moment; or an arc of a circle, without a force, or a straight roll,
without a moment. All elasticae are covered by boxes (see `nearby`). A box is done with when none of
its elasticae can be at the pose (see `meeting`) at any length below the bound; else it is halved.
"""

import math
from typing import NamedTuple

import numpy as np

from rigid_envs.base.checks import Array, Bools, Integers
from rigid_envs.engine.algebra import Vector
from rigid_envs.engine.compiler import kernel, routine, scalar
from rigid_envs.engine.elementary import expm1
from rigid_envs.systems.rolling_ball import nearby
from rigid_envs.systems.rolling_ball.meeting import CENTRE, Rim, corner, is_met, is_near, place
from rigid_envs.systems.rolling_ball.nearby import BESIDE, REST, TURNED

_QUADRATURE = 1.1  # integrals of deviations, by trapezoids
_STEP = 0.25  # longest step of the length [radii]
_TURN = 0.5  # largest turn of the heading in a step [rad]
_USELESS = 1.5  # error of a pose beyond which a path is not followed


# A box: which poses it may meet.


class Poses(NamedTuple):
    """Poses that are to be met by no path of a set.

    Attributes:
        numbers: Of each pose and of its mirror image, shape (2n, 5).
        radii: Largest distance of the set [radii of the ball], shape (n,).
        limits: Lengths of paths that none may have, shape (n,).
        bends: Deviations from a straight roll up to which none meets the pose, shape (n,).
        edge: Largest angle of the set [rad].
        middle: Arc length at which the numbers of a box are given.
    """

    numbers: Array
    radii: Array
    limits: Array
    bends: Array
    edge: float
    middle: float


class Room(NamedTuple):
    """Arrays that a box is worked out in: see `nearby` and `meeting`."""

    table: Array
    nodes: Array
    cells: Array
    path: Array
    at: Array
    beside: Array
    m: Array


class Rows(NamedTuple):
    """Rows of the path of a box.

    Attributes:
        wanted: The last one that is asked about.
        last: The last one that is known.
        step: Of the arc length, between rows [radii].
        rho: Of the middle of the box.
        m: Coefficient of the sine there.
        most_bent: Largest curvature of the box.
    """

    wanted: int
    last: int
    step: float
    rho: float
    m: float
    most_bent: float


@routine
def meets(swings: bool, mid: Vector, half: Vector, poses: Poses, alive: Integers, n_alive: int,
          met: Integers, room: Room) -> tuple[int, int]:  # fmt: skip
    """Which of some poses a box may meet.

    Args:
        swings: Of the family.
        mid: (rho, sigma, eps) of the middle of the box.
        half: Half ranges.
        poses: All poses.
        alive: Which are asked for, four for each pose: of either sign, and of its mirror image.
        n_alive: Number of these.
        met: Written: those that may be met.
        room: Arrays to work in.

    Returns:
        Number of poses that may be met, and the number that should be halved.
    """
    longest = 0.0
    for k in range(n_alive):
        longest = max(longest, poses.limits[alive[k] // 4])
    most_bent = 2.0 * (mid[0] + half[0])
    if _are_straight(_bend(mid, half, poses.middle, longest), poses, alive, n_alive):
        return 0, 0
    middle = math.ceil(poses.middle / min(_STEP, _TURN / most_bent))
    step = poses.middle / middle
    wanted = middle + max(0, math.ceil((longest - poses.middle) / step))
    if wanted >= room.nodes.shape[0]:
        return _all(alive, n_alive, met), 0
    begin = mid[1] - mid[0] * poses.middle
    nearby.neighbours(swings, mid[2], half[2], begin, mid[0] * step, wanted, room.table,
                      room.nodes, room.cells)  # fmt: skip
    last = nearby.deviations(swings, mid, half, step, middle, wanted, room.nodes, room.path)
    if last < 0:
        row = -2 - last
        axis = _largest_share(room, half, step, middle, row, row) if row >= 0 else 2
        return _all(alive, n_alive, met), axis
    rows = Rows(wanted, last, step, mid[0], 1.0 if swings else 1.0 - mid[2], most_bent)
    axis = _largest_share(room, half, step, middle, 0, last)
    nearby.poses(step, last, room.nodes, room.path, rows.rho, rows.m)
    rim = corner(swings, mid, half, poses.middle, middle, poses.edge, room.nodes)
    return _met_along(rows, rim, poses, alive, n_alive, met, room), axis


@routine
def _all(alive: Integers, n_alive: int, met: Integers) -> int:
    """Nothing is known: all may be met."""
    for k in range(n_alive):
        met[k] = alive[k]
    return n_alive


@scalar
def _bend(mid: Vector, half: Vector, middle: float, longest: float) -> float:
    """Largest deviation of the paths of a box from straight rolls [radii, rad].

    They bend little where the force is small, and where motions stay near the top: a time t from
    the bottom the angle from there is at most ``4 atan exp(-t)``, as on the separatrix, where a
    motion falls least.
    """
    rho = mid[0] + half[0]
    late = abs(mid[1]) - half[1] - rho * max(middle, longest - middle)
    bend = rho * longest
    return longest * (min(bend, 4.0 * (expm1(-late) + 1.0)) if late > 0.0 else bend)


@routine
def _are_straight(bend: float, poses: Poses, alive: Integers, n_alive: int) -> bool:
    """Whether what is beside straight rolls by a bend meets no pose."""
    for k in range(n_alive):
        if bend > poses.bends[alive[k] // 4]:
            return False
    return True


@routine
def _largest_share(
    room: Room, half: Vector, step: float, n_middle: int, first: int, last: int
) -> int:
    """Which of the three numbers contributes most to what is not known of the headings."""
    a = b = c = 0.0
    for j in range(first, last + 1):
        late = (j - n_middle) * step * half[0]
        a += abs(room.path[j, 0]) + 0.5 * late * late
        b += abs(room.path[j, 1]) + 0.5 * half[1] * half[1]
        c += abs(room.path[j, 2]) + room.nodes[j, REST] + room.nodes[n_middle, REST]
    return 2 if c >= max(a, b) else 0 if a >= b else 1


@routine
def _met_along(rows: Rows, rim: Rim, poses: Poses, alive: Integers, n_alive: int, met: Integers,
               room: Room) -> int:  # fmt: skip
    """Poses that a box may meet: near the rows that are known, and all that come later."""
    path, half_step = room.path, 0.5 * rows.step
    integral = turned = 0.0
    # near the last row that is known, deviations are if the next one is known or not asked for
    n_met, known = 0, rows.last if rows.last == rows.wanted else rows.last - 1
    found = room.cells[:n_alive, 0]
    found[:] = 0.0
    for j in range(known + 1):
        if j > 0:
            here = 0.5 * path[j, BESIDE] ** 2 + path[j, TURNED]
            there = 0.5 * path[j - 1, BESIDE] ** 2 + path[j - 1, TURNED]
            integral += _QUADRATURE * half_step * (here + there)
            turned += _QUADRATURE * half_step * (path[j, BESIDE] + path[j - 1, BESIDE])
        if integral > _USELESS:
            known = j - 1
            break
        placed = False
        for k in range(n_alive):
            i, variant = alive[k] // 4, alive[k] % 4
            if found[k] > 0.0 or j * rows.step - half_step > poses.limits[i]:
                continue
            sign, numbers = 1.0 - 2.0 * (variant % 2), poses.numbers[2 * i + variant // 2]
            reach = turned + half_step + CENTRE
            if not is_near(path, j, reach, poses.radii[i], poses.edge, numbers, sign):
                continue
            if not placed:
                size = _around(path, BESIDE, j, rows.last)
                place(path, j, rim, size, half_step, rows.most_bent, integral, turned, room.at)
                placed = True
            if is_met(room.at, rim, poses.radii[i], numbers, sign, room.m) and _met_closely(
                j, integral, turned, rows, rim, poses.radii[i], poses.limits[i], numbers, sign, room
            ):
                found[k] = 1.0
    for k in range(n_alive):
        late = known < rows.wanted and poses.limits[alive[k] // 4] >= (known + 0.5) * rows.step
        if found[k] > 0.0 or late:
            met[n_met] = alive[k]
            n_met += 1
    return n_met


@routine
def _around(path: Array, column: int, j: int, last: int) -> float:
    """Largest value in the row j and those beside it."""
    a, b, c = path[max(0, j - 1), column], path[j, column], path[min(last, j + 1), column]
    return float(max(a, b, c))


@routine
def _met_closely(
    j: int, integral: float, turned: float, rows: Rows, rim: Rim, radius: float, limit: float,
    numbers: Array, sign: float, room: Room,
) -> bool:  # fmt: skip
    """Whether a pose may be met near a row, by parts of the step that fit the other errors."""
    path, step, half_step = room.path, rows.step, 0.5 * rows.step
    size, rest = _around(path, BESIDE, j, rows.last), _around(path, TURNED, j, rows.last)
    other = integral + 0.25 * turned * turned + rim.angle_rest + CENTRE
    n = math.ceil(half_step * math.sqrt(1.5 * rows.most_bent / other))
    if n <= 1:
        return True
    integral += half_step * (0.5 * size * size + rest) + 0.5 * rows.most_bent * size * step * step
    turned += half_step * size
    for i in range(n):
        ahead = step * ((i + 0.5) / n - 0.5)
        if j * step + ahead + half_step / n < 0.0:
            continue
        if j * step + ahead - half_step / n > limit:
            return False
        nearby.go_on(j, ahead, step, rows.last, rows.rho, rows.m, room.nodes, path)
        place(path, path.shape[0] - 1, rim, size, half_step / n, rows.most_bent, integral, turned,
              room.beside)  # fmt: skip
        if is_met(room.beside, rim, radius, numbers, sign, room.m):
            return True
    return False


# The search.

_DEEPEST = 60  # halvings, after which a pose that may be met is taken to be unproven


@kernel
def leftover(swings: bool, low: Array, high: Array, poses: Poses, alive: Integers, most: int,
             room: Room, unproven: Bools) -> None:  # fmt: skip
    """Halve a box until no elastica of it can meet poses too soon.

    Args:
        swings: Of the family.
        low: Least (rho, sigma, eps), shape (3,).
        high: Largest.
        poses: All poses.
        alive: Numbers of those that are asked for.
        most: Boxes that may meet a pose, before it is given up.
        room: Arrays to work in.
        unproven: Set to True for poses that are given up, or may be met in the end, shape (n,).
    """
    stack = np.empty((_DEEPEST + 2, 8))  # least and largest numbers, depth, number of poses
    lists = np.empty((_DEEPEST + 2, 4 * len(alive)), np.int64)  # of poses, by depth
    for k in range(len(alive)):
        for variant in range(4):
            lists[0, 4 * k + variant] = 4 * alive[k] + variant
    for i in range(3):  # an assigned slice that does not fit would print its shape, by log10
        stack[0, i], stack[0, 3 + i] = low[i], high[i]
    stack[0, 6], stack[0, 7] = 0, 4 * len(alive)
    tried = np.zeros(len(unproven), np.int64)
    n = 1
    while n > 0:
        n -= 1
        # bottoms of one motion are two quarter periods apart: the nearest is within one
        if max(0.0, stack[n, 1], -stack[n, 4]) > nearby.quarter_period(swings, stack[n, 2]):
            continue
        mid = (0.5 * (stack[n, 0] + stack[n, 3]), 0.5 * (stack[n, 1] + stack[n, 4]),
               0.5 * (stack[n, 2] + stack[n, 5]))  # fmt: skip
        half = (0.5 * (stack[n, 3] - stack[n, 0]), 0.5 * (stack[n, 4] - stack[n, 1]),
                0.5 * (stack[n, 5] - stack[n, 2]))  # fmt: skip
        depth = int(stack[n, 6])
        met = lists[depth + 1]
        n_met, axis = meets(swings, mid, half, poses, lists[depth], int(stack[n, 7]), met, room)
        left = 0
        for k in range(n_met):
            pose = met[k] // 4
            tried[pose] += 1
            if depth == _DEEPEST or tried[pose] > most:
                unproven[pose] = True
            if not unproven[pose]:
                met[left] = met[k]
                left += 1
        if left == 0:
            continue
        cut = _cut(axis, stack[n, axis], stack[n, 3 + axis])
        stack[n, 6], stack[n, 7] = depth + 1, left
        for i in range(8):
            stack[n + 1, i] = stack[n, i]
        stack[n, 3 + axis] = stack[n + 1, axis] = cut
        n += 2


@scalar
def _cut(axis: int, low: float, high: float) -> float:
    """Where a range is halved: that of eps by its logarithm, which decides near the separatrix."""
    if axis < 2 or high < 4.0 * low:
        return 0.5 * (low + high)
    return math.sqrt(low * high) if low > 0.0 else 0.0625 * high
