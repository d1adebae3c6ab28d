"""The least length of a path that rolls a ball from a pose into a set of poses.

The set has a position within a tolerance and an angle within a tolerance. By the maximum principle
a shortest path into it is an elastica (see `shortest_path`) that meets the edge with its costate
normal to it: the force P along the last position, the moment M along the last rotation vector.
So, run backwards, the paths leave the set as the rays of a wavefront: three numbers choose one,
and its length is the fourth; the poses but for a turn of the plane have four dimensions too.
Rays are spread over all of them, and Newton's method leads those that pass by a pose to it.
"""

import math

import numpy as np
from scipy.spatial import cKDTree

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import elastica
from rigid_envs.systems.rolling_ball.controllers import difference

N_RAYS = 200_000
_N_PARTS = 40  # of a ray, each a guess but for the first ones, which shorter rays have too
_FIRST_PART = 12
_FARTHEST = 6.3  # radii by which a path is longer than the way; more than any shortest path
_N_NEAR = 2000  # points of rays near a pose
_N_GUESSES = 400  # rays that they are of
_N_KEPT = 16  # of the shortest paths found by coarse polygons
_NEARER = 20.0  # radii of length that a guess may be longer where it is one nearer
_REACH = 0.2  # of Newton's method: a fifth of the steps that are good for an exact pose
_STAGES = ((1.0, 0.1), (1.25, 0.04), (1.5, 0.016), (2.0, 6e-3), (3.0, 2.5e-3), (4.0, 1e-3))
"""Sides of the polygons over those of the first, and the smoothing of the edge (`elastica`)."""


def _evenly(n: int, dimensions: int) -> Array:
    """Points of the unit cube, spread evenly: powers of the root of ``g^(d + 1) = g + 1``."""
    g = 1.5
    for _ in range(100):
        g = (1.0 + g) ** (1.0 / (dimensions + 1))
    powers = g ** -np.arange(1.0, dimensions + 1.0)
    return np.asarray((0.5 + np.arange(1.0, n + 1.0)[:, None] * powers) % 1.0)


def _bent(n: int) -> Array:
    """Rows of `elastica` that bend in all ways."""
    u = _evenly(n, 4)
    length = 1.5 * 8.0 ** u[:, 3]
    rate = 1.0 + (np.maximum(14.0, 2.0 * length) - 1.0) * u[:, 1]
    swing = np.maximum(16.0, 3.0 * length) * (2.0 * u[:, 0] - 1.0)
    angle = 2.0 * math.pi * u[:, 2]
    columns = np.zeros(n), swing, rate**2 * np.cos(angle), rate**2 * np.sin(angle), length
    return np.stack(columns, axis=-1)


def _passing(n: int) -> Array:
    """Rows that are straight for a while: the pendulum passes its unstable equilibrium.

    They depend so much on how they begin that those of `_bent` are too few: they are begun in the
    middle, run back, and run forward from there.
    """
    u = _evenly(n, 5)
    half, pull, longer = 0.4 + 2.6 * u[:, 0], 0.3 * 100.0 ** u[:, 1], 1.5 + 2.0 * u[:, 4]
    v = 2.0 * u[:, 2:4] - 1.0
    off, turning = (1.5 * np.sign(v) * 10.0 ** (-3.5 * np.abs(v))).T
    along, across = -(half**2) * pull * np.array([np.cos(off), np.sin(off)])
    x = np.stack([np.zeros(n), np.sqrt(pull) * turning * half, along, across, half], axis=-1)
    ends = _traced(x, 1)[:, 1]
    a, rate = ends[:, 0], ends[:, 1]
    c, s = longer**2 * np.cos(a), longer**2 * np.sin(a)
    columns = 0.0 * a, -longer * rate, -c * along - s * across, s * along - c * across
    return np.stack([*columns, longer * half], axis=-1)


def _traced(x: Array, parts: int) -> Array:
    """Values of `elastica.trace` along each row, shape (n, parts + 1, 8)."""
    out = np.empty((len(x), parts + 1, 8))
    for row, y in zip(x, out, strict=True):
        elastica.trace(row, _N_PARTS // parts, y)
    return out


def _edge(x: Array, edge: tuple[float, float]) -> tuple[Array, Array]:
    """Attitude and position where rays leave the set, in axes along their first heading."""
    pull = x[:, 2:4] / x[:, 4:] ** 2
    moment = np.stack([pull[:, 1], 1.0 - pull[:, 0], -x[:, 1] / x[:, 4]], axis=-1)
    ahead, axis = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (pull, moment))
    return rotations.exp(edge[1] * axis), edge[0] * ahead


def _invariants(q: Array, p: Array) -> Array:
    """What turns about the vertical leave of poses, shape (..., 5), with distances nearly kept.

    A turn multiplies the complex numbers p and 2 (q_x + i q_y) by the same phase.
    """
    a, b = p[..., 0] + 1j * p[..., 1], 2.0 * (q[..., 1] + 1j * q[..., 2])
    square_a, square_b = np.abs(a) ** 2, np.abs(b) ** 2
    size = np.sqrt(square_a + square_b)
    size = np.where(size > 0.0, size, 1.0)
    both = 2.0 * a * np.conj(b) / size
    columns = 2.0 * q[..., 0], 2.0 * q[..., 3], (square_a - square_b) / size, both.real, both.imag
    return np.stack(columns, axis=-1)


class Wavefront:
    """Rays that leave a set of poses, and least lengths into such sets.

    Args:
        position_tolerance: Largest distance of the set that the rays leave [radii].
        angle_tolerance: Its largest angle [rad]. Other sets take the rays as first guesses.
        n_rays: Their number.
    """

    def __init__(
        self, position_tolerance: float, angle_tolerance: float, n_rays: int = N_RAYS
    ) -> None:
        """Trace the rays."""
        x = np.concatenate([_bent(n_rays // 2), _passing(n_rays - n_rays // 2)])
        y = _traced(x, _N_PARTS)[:, _FIRST_PART:]
        q, p = _edge(x, (position_tolerance, angle_tolerance))
        q, p = rotations.multiply(y[..., 2:6], q[:, None]), y[..., 6:8] + p[:, None]
        t = np.arange(_FIRST_PART, _N_PARTS + 1)[:, None] / _N_PARTS
        rows = x[:, None] * np.concatenate([0.0 * t, t, t**2, t**2, t], axis=-1)
        near = rows[..., 4] < np.linalg.norm(p, axis=-1) + _FARTHEST
        self._rows, self._rays = rows[near], np.nonzero(near)[0]
        self._tree = cKDTree(_invariants(q, p)[near])

    def least_length(
        self, target: Array, position_tolerance: float, angle_tolerance: float
    ) -> float:
        """Length of the shortest path found between a pose and the set [radii].

        Args:
            target: Turn and displacement [radii] from the middle of the set, shape (6,).
            position_tolerance: Largest distance of the set [radii].
            angle_tolerance: Its largest angle [rad].

        Returns:
            The length: 0 within the set, infinite where no path is found.
        """
        distance, angle = math.hypot(*target[4:]), 2.0 * math.acos(min(1.0, abs(target[0])))
        if distance <= position_tolerance and angle <= angle_tolerance:
            return 0.0
        way = distance - position_tolerance
        if way > 0.0 and _turned_by_roll(target, way) <= angle_tolerance:
            return way
        x, n = self._guesses(target), math.ceil(30.0 + 2.0 * distance)
        elastica.face_rows(x, target, n)
        for finer, smooth in _STAGES:
            edge = position_tolerance, angle_tolerance, smooth
            elastica.shoot_rows(x, target, edge, _REACH, math.ceil(finer * n))
            x = x[np.isfinite(x[:, 4]) & (x[:, 4] > 0.0)]
            _, different = np.unique(np.round(x[:, 4], 4), return_index=True)
            x = x[different[:_N_KEPT]]
        for row in x:
            elastica.shoot_rows(row[None], target, edge, _REACH, _sides(row))
            if math.isfinite(row[4]) and row[4] > 0.0:
                return float(row[4])
        return math.inf

    def _guesses(self, target: Array) -> Array:
        """Rays cut where they pass by a pose, each once, the nearest and shortest first."""
        q = np.stack([target[:4], -target[:4]])
        distances, points = self._tree.query(_invariants(q, target[4:]), k=_N_NEAR)
        points = points[np.isfinite(distances)]
        distances = distances[np.isfinite(distances)]
        order = np.argsort(self._rows[points, 4] + _NEARER * distances, kind="stable")
        points = points[order]
        _, first = np.unique(self._rays[points], return_index=True)
        return np.asarray(self._rows[points[np.sort(first)[:_N_GUESSES]]])


def _turned_by_roll(target: Array, way: float) -> float:
    """Angle that is left by a straight roll of some radii towards the middle [rad]."""
    x, y = -way * target[4:] / math.hypot(*target[4:])
    return float(rotations.distance(rotations.exp([-y, x, 0.0]), rotations.conjugate(target[:4])))


def _sides(x: Array) -> int:
    """Steps that lead to the end of a path within 1e-9; see `shortest_path`."""
    rate = math.sqrt(x[1] ** 2 + 4.0 * math.hypot(x[2], x[3]) + x[4] ** 2)
    return math.ceil(40.0 * rate) + 1


def least_lengths(
    starts: Array,
    goals: Array,
    radii: Array,
    position_tolerance: float,
    angle_tolerance: float,
    n_rays: int = N_RAYS,
) -> Array:
    """Lengths of the shortest paths found from states to within tolerance of goals [m].

    Nothing proves that there is no shorter one: Newton's method finds what its guesses lead to.

    Args:
        starts: States (w, x, y, z, X, Y) of `RollingBall`, shape (n, 6).
        goals: The same.
        radii: Of the balls, shape (n,) [m].
        position_tolerance: Largest distance from the goal [m].
        angle_tolerance: Largest angle from the goal [rad].
        n_rays: Number of rays that guesses are taken from.

    Returns:
        Shape (n,); infinite where no path was found.

    Source: Jurdjevic 1993, "The geometry of the plate-ball problem", doi:10.1007/BF00375605.
    """
    targets = np.concatenate(difference(goals, starts, radii), axis=-1)
    front = Wavefront(position_tolerance / float(np.median(radii)), angle_tolerance, n_rays)
    return np.array(
        [
            radius * front.least_length(target, position_tolerance / radius, angle_tolerance)
            for target, radius in zip(targets, radii, strict=True)
        ]
    )
