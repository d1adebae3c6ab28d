"""The shortest path found that rolls a ball from a pose into a set of poses.

The set is that of the poses whose position is within a distance of a point, and whose angle is
within an angle. By the maximum principle a shortest path is an elastica (see `shortest_path`) that
meets the set with its costate (force P, moment M) normal to it, in one of three ways:

- the angle ends within its limit: M is 0, and the path is a straight roll to the edge of the disk;
- the position ends within its limit: P is 0, and the path is an arc of a circle;
- both are at their limits: the position along P, the rotation vector along M.

The first two have closed forms, and all arcs are found. The third has five equations for the five
numbers of an elastica, which Newton's method solves from many guesses: rays of a wavefront that
pass by the pose (`wavefront`), and elasticae fitted to a path that is known. Nothing proves that
there is no shorter path.

All paths are rows of `elastica`, from the set to the pose: turned round, they roll the ball home.

Source: Jurdjevic 1993, "The geometry of the plate-ball problem", doi:10.1007/BF00375605.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import elastica
from rigid_envs.systems.rolling_ball.controllers import difference
from rigid_envs.systems.rolling_ball.shortest_path import sides
from rigid_envs.systems.rolling_ball.wavefront import N_RAYS, Wavefront

_REACHES = (1.0, 0.2, 0.05)  # of Newton's method: each finds some paths that others miss
_FINER = (1.0, 1.25, 1.5, 2.0, 3.0, 4.0)  # polygons, by and by
_DENSITY = 40.0  # of the steps of a path, which lead to its end within 1e-9; see `sides`
_N_KEPT = 32  # of the shortest paths found by coarse polygons
_N_SLOPES = 201  # of arcs, between which the equation of arcs changes its sign once
_N_TURNS = 2  # whole turns of the ball along an arc at most
_N_FITTED = 400  # headings of a known path that an elastica is fitted to
_BEGINS = (0.01, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0)


def least_path(
    target: Array, edge: tuple[float, float], guesses: Array, known: Array | None = None
) -> Array:
    """The shortest path found from a set of poses to a pose, as a row of `elastica`.

    Args:
        target: The pose: turn and displacement [radii] from the middle of the set, shape (6,).
        edge: Largest distance [radii] and largest angle [rad] of the set.
        guesses: Elasticae that Newton's method begins with, shape (n, 5), of any first heading.
        known: Straight rolls of a path from the pose into the set, shape (T, 2) [radii].

    Returns:
        Shape (5,); of length 0 within the set, infinite where no path is found.
    """
    straight = _straight(target, edge)
    if np.isfinite(straight[4]):
        return straight  # nothing is shorter
    guesses, n = guesses.copy(), math.ceil(30.0 + 2.0 * math.hypot(*target[4:]))
    elastica.face_rows(guesses, target, n)
    if known is not None and known.any():
        guesses = np.concatenate([guesses, _fitted(known)])
    found = [straight, *_arcs(target, edge)]
    found += [row for reach in _REACHES for row in _led(guesses, target, edge, reach, n)]
    return min(found, key=lambda row: float(row[4]))


def _led(
    x: Array, target: Array, edge: tuple[float, float], reach: float, n: int
) -> Sequence[Array]:
    """Where Newton's method leads guesses, by finer and finer polygons: the shortest paths."""
    x = x.copy()
    for finer in _FINER:
        elastica.shoot_rows(x, target, edge, reach, math.ceil(finer * n))
        x = x[np.isfinite(x[:, 4]) & (x[:, 4] > 0.0)]
        x = x[np.unique(np.round(x[:, :0:-1], 6), axis=0, return_index=True)[1][:_N_KEPT]]
    for row in x:
        elastica.shoot_rows(row[None], target, edge, reach, sides(row, _DENSITY))
        if math.isfinite(row[4]) and row[4] > 0.0:
            return [row]
    return []


def _straight(target: Array, edge: tuple[float, float]) -> Array:
    """The straight roll to the edge of the disk; infinite where it leaves too large an angle."""
    distance = math.hypot(*target[4:])
    way = max(0.0, distance - edge[0])
    ahead = target[4:] / distance if distance > 0.0 else np.array([1.0, 0.0])
    roll = rotations.exp([-way * ahead[1], way * ahead[0], 0.0])
    within = float(rotations.distance(roll, target[:4])) <= edge[1]
    heading = math.atan2(ahead[1], ahead[0])
    return np.array([heading, 0.0, 0.0, 0.0, way if within else math.inf])


def _arcs(target: Array, edge: tuple[float, float]) -> list[Array]:
    """All arcs to a pose, from poses whose angle is at its limit and whose position is within.

    Along an arc with da/ds = k = tan f the ball turns about n = (0, cos f, -sin f) in axes that
    turn with the heading a, and the moment is along n. So turning by the angle b at the edge first
    only prolongs the turn: with u = s / cos f + b, the turn and the heading are

        exp(k s e_z) exp(u n).

    Its horizontal part has the size ``|sin(u / 2)| cos f``, which gives u for each f. What is left
    is the phase of w + i z: one equation for f.
    """
    w, x, y, z = target[:4]
    across = math.hypot(x, y)
    most = math.acos(min(1.0, across))
    slopes = most * np.linspace(-1.0, 1.0, _N_SLOPES)

    def sheet(f: Array, whole: int) -> tuple[Array, Array, Array]:
        """Length, phase k s / 2, and half the angle u."""
        half = np.arcsin(np.minimum(1.0, across / np.cos(f)))
        half = np.pi * (whole // 2 + whole % 2) + (-half if whole % 2 else half)
        length = np.cos(f) * (2.0 * half - edge[1])
        return length, 0.5 * np.tan(f) * length, half

    def amiss(f: Array, whole: int) -> Array:
        _, phase, half = sheet(f, whole)
        turn = np.exp(1j * phase) * (np.cos(half) - 1j * np.sin(half) * np.sin(f))
        return np.asarray((turn * complex(w, -z)).imag)

    found = []
    for whole in range(2 * _N_TURNS):
        values = amiss(slopes, whole)
        for k in np.flatnonzero(values[:-1] * values[1:] <= 0.0):
            f = np.array(brentq(amiss, slopes[k], slopes[k + 1], (whole,), xtol=1e-15))
            length, phase, half = (float(v) for v in sheet(f, whole))
            if length <= 0.0:
                continue
            turn = np.exp(1j * phase) * (np.cos(half) - 1j * np.sin(half) * np.sin(f))
            tilt = 1j * np.exp(1j * phase) * np.sin(half) * np.cos(f)
            heading = np.angle(complex(x, y) / tilt * (turn * complex(w, -z)).real)
            ahead = length * np.sinc(phase / np.pi) * np.exp(1j * (heading + phase))
            if abs(complex(*target[4:]) - ahead) <= edge[0]:
                found.append(np.array([heading, 2.0 * phase, 0.0, 0.0, length]))
    return found


def _fitted(rolls: Array) -> Array:
    """Elasticae near a path of straight rolls, shape (n, 5), as rows from its end to its beginning.

    Twice integrated, the equation of an elastica is linear in its numbers, if the headings a are
    known: least squares give them. A motion that passes an unstable equilibrium depends so much on
    its beginning that it is begun at several places, and traced back from there.
    """
    back = -rolls[::-1].astype(np.float64)
    size = np.hypot(*back.T)
    back, size = back[size > 0.0], size[size > 0.0]
    length, middle = size.sum(), np.cumsum(size) - 0.5 * size
    t = (np.arange(_N_FITTED) + 0.5) / _N_FITTED
    a = np.interp(t * length, middle, np.unwrap(np.arctan2(back[:, 1], back[:, 0])))
    bends = np.stack([-np.sin(a), np.cos(a)], axis=-1) / _N_FITTED
    rates = np.cumsum(bends, axis=0)
    columns = np.stack([np.ones_like(t), t, *np.cumsum(rates, axis=0).T / _N_FITTED], axis=-1)
    x: Array = np.linalg.lstsq(columns, a, rcond=None)[0]
    headings, turning = columns @ x, x[1] + rates @ x[2:]
    rows = []
    for begin in _BEGINS:
        k = min(int(begin * _N_FITTED), _N_FITTED - 1)
        past, ends = t[k], np.empty((2, 8))
        pull = _seen(x[2:], headings[k])
        elastica.trace(np.array([0.0, -past * turning[k], *past**2 * pull, length]), 50, ends)
        first = headings[k] + ends[1, 0]
        rows.append([first, -ends[1, 1] / past, *_seen(x[2:], first), length])
    return np.array(rows)


def _seen(v: Array, heading: float) -> Array:
    """A vector of the plane in axes along a heading."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c * v[0] + s * v[1], c * v[1] - s * v[0]])


def rolls_along(x: Array, n: int) -> Array:
    """Chords of n equal parts of a path, from its end to its beginning, shape (n, 2) [radii].

    Args:
        x: Row of `elastica`, shape (5,).
        n: Number of parts.
    """
    y = np.empty((n + 1, 8))
    elastica.trace(x, math.ceil(sides(x, _DENSITY) / n), y)
    return np.diff(_seen(y[::-1, 6:].T, -x[0]).T, axis=0)


def least_paths(
    starts: Array,
    goals: Array,
    radii: Array,
    position_tolerance: float,
    angle_tolerance: float,
    known: Array | None = None,
    n_rays: int = N_RAYS,
) -> Array:
    """The shortest paths found from states to within tolerance of goals, as rows of `elastica`.

    Args:
        starts: States (w, x, y, z, X, Y) of `RollingBall`, shape (n, 6).
        goals: The same.
        radii: Of the balls, shape (n,) [m].
        position_tolerance: Largest distance from the goal [m].
        angle_tolerance: Largest angle from the goal [rad].
        known: Straight rolls of paths that are known, shape (T, n, 2) [radii]; zeros of none.
        n_rays: Number of rays that guesses are taken from.

    Returns:
        Shape (n, 5), from the goals to the starts, lengths in radii; infinite where none was found.
    """
    targets = np.concatenate(difference(goals, starts, radii), axis=-1)
    front = Wavefront(position_tolerance / float(np.median(radii)), angle_tolerance, n_rays)
    rows = []
    for k, (target, radius) in enumerate(zip(targets, radii, strict=True)):
        edge = position_tolerance / radius, angle_tolerance
        plan = None if known is None else known[:, k]
        rows.append(least_path(target, edge, front.passing(target), plan))
    return np.array(rows)
