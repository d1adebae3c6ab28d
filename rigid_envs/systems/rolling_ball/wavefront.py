"""Rays of the wavefront that leaves a set of poses of a rolling ball: guesses of shortest paths.

The set and its edge are those of `least_path`: run backwards, shortest paths leave it as the rays
of a wavefront. Three numbers choose one, and its length is the fourth; the poses but for a turn of
the plane have four dimensions too. Rays are spread over all of them; those that pass by a pose are
guesses of the paths that lead to it.
"""

import math

import numpy as np
from scipy.spatial import cKDTree

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import elastica
from rigid_envs.systems.rolling_ball.shortest_path import evenly

N_RAYS = 200_000
_N_PARTS = 40  # of a ray, each a guess but for the first ones, which shorter rays have too
_FIRST_PART = 12
_FARTHEST = 6.3  # radii by which a path is longer than the way; more than any shortest path
_N_NEAR = 600  # points of rays near a pose
_N_GUESSES = 120  # rays that they are of
_NEARER = 20.0  # radii of length that a guess may be longer where it is one nearer


def _bent(n: int) -> Array:
    """Rows of `elastica` that bend in all ways."""
    u = evenly(n, 4)
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
    u = evenly(n, 5)
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
    both = np.array([elastica.costates(tuple(row)) for row in x])  # (n, 2, 3)
    force, axis = (both / np.linalg.norm(both, axis=-1, keepdims=True)).swapaxes(0, 1)
    return rotations.exp(edge[1] * axis), edge[0] * force[:, :2]


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
    """Rays that leave a set of poses.

    Args:
        position_tolerance: Largest distance of the set that the rays leave [radii].
        angle_tolerance: Its largest angle [rad]. For other sets they are guesses too.
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

    def passing(self, target: Array) -> Array:
        """Rays cut where they pass by a pose, each once, the nearest and shortest first.

        Args:
            target: The pose: turn and displacement [radii] from the middle of the set, shape (6,).

        Returns:
            Rows of `elastica`, shape (n, 5), of any first heading.
        """
        q = np.stack([target[:4], -target[:4]])
        distances, points = self._tree.query(_invariants(q, target[4:]), k=_N_NEAR)
        points = points[np.isfinite(distances)]
        distances = distances[np.isfinite(distances)]
        order = np.argsort(self._rows[points, 4] + _NEARER * distances, kind="stable")
        points = points[order]
        _, first = np.unique(self._rays[points], return_index=True)
        return np.asarray(self._rows[points[np.sort(first)[:_N_GUESSES]]])
