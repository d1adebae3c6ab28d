"""Least times of a motion in the plane: regions that no input leaves in so many periods."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array

# Polygons around the origin: star-shaped, vertices in the order of their angles from -pi to pi.

_TOLERANCE = 1e-7  # distance of a vertex from the chord of its neighbours at which it may go
_N_THINNINGS = 10
_ROUNDING = 1e-12  # relative, of what is computed of a polygon
_CORNERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


def sides(x: Array) -> Array:
    """Line segments between successive points of a closed curve (n, 2), shape (n, 2, 2)."""
    return np.stack([x, np.roll(x, -1, axis=0)], axis=1)


def star(segments: Array) -> Array:
    """A star-shaped polygon that no segment enters, shape (k, 2).

    On every ray it ends at the nearest segment. Between the ends of segments that follow one
    another in angle, this is below straight lines, and so contains the chord.

    Args:
        segments: Together around the origin, shape (m, 2, 2).
    """
    a, b = segments[:, 0], segments[:, 1]
    turned = np.atan2(_cross(a, b), (a * b).sum(axis=-1))
    a, b = np.where(turned[:, None] < 0.0, b, a), np.where(turned[:, None] < 0.0, a, b)
    phi = np.unique(np.atan2(segments[..., 1], segments[..., 0]))
    first = np.searchsorted(phi, np.atan2(a[:, 1], a[:, 0]))
    last = np.searchsorted(phi, np.atan2(b[:, 1], b[:, 0]))
    counts = np.where(last < first, len(phi), 0) + last - first + 1
    edge = np.repeat(np.arange(len(a)), counts)
    ray = (first[edge] + np.arange(len(edge)) - (np.cumsum(counts) - counts)[edge]) % len(phi)
    unit = np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    near, far = np.sort(np.linalg.norm([a, b], axis=-1), axis=0)
    steep = _cross(unit[ray], (b - a)[edge])
    with np.errstate(divide="ignore", invalid="ignore"):
        met = _cross(a, b)[edge] / steep
    met = np.where(np.abs(turned[edge]) < _ROUNDING, near[edge], np.minimum(met, far[edge]))
    radius = np.full(len(phi), np.inf)
    np.minimum.at(radius, ray, met)
    return _thinned((1.0 - _ROUNDING) * radius[:, None] * unit)


def gauge(polygon: Array, x: Array) -> Array:
    """By what factor a polygon must grow to reach points x (..., 2), shape (...): 1 on its edge."""
    a, b = sides(polygon).swapaxes(0, 1)
    angles = np.atan2(polygon[:, 1], polygon[:, 0])
    edge = np.searchsorted(angles, np.atan2(x[..., 1], x[..., 0]), side="right") - 1
    return np.asarray(_cross(x, (b - a)[edge]) / _cross(a, b)[edge])


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _thinned(x: Array) -> Array:
    """A polygon of fewer vertices, inside that of vertices x."""
    fewer = x
    for k in range(_N_THINNINGS):
        at = np.arange(1 + k % 2, len(fewer) - 1, 2)
        a, b, c = fewer[at - 1], fewer[at], fewer[at + 1]
        off = np.abs(_cross(b - a, c - a)) / np.linalg.norm(c - a, axis=-1)
        fewer = np.delete(fewer, at[(off <= _TOLERANCE) & (_cross(a, c) > 0.0)], axis=0)
    return np.asarray(fewer * min(1.0, (1.0 - _ROUNDING) * gauge(fewer, x).min()))


def refined(x: Array, weights: npt.ArrayLike, size: float) -> Array:
    """The same closed curve, no side of which is longer than a size.

    Args:
        x: Vertices, shape (n, 2).
        weights: A side d is ``weights . |d|`` long, shape (2,).
        size: Of sides.
    """
    step = np.roll(x, -1, axis=0) - x
    counts = np.maximum(np.ceil(np.abs(step) @ np.asarray(weights) / size), 1.0).astype(int)
    side = np.repeat(np.arange(len(x)), counts)
    part = (np.arange(len(side)) - (np.cumsum(counts) - counts)[side]) / counts[side]
    return np.asarray(x[side] + part[:, None] * step[side])


def turning(x: Array) -> npt.NDArray[np.bool_]:
    """Where a coordinate of a closed curve x (n, 2) changes its direction, shape (n, 2)."""
    return (x - np.roll(x, 1, axis=0)) * (np.roll(x, -1, axis=0) - x) <= 0.0


def eroded(x: Array, half: Array) -> Array:
    """A polygon of points around which boxes are in a polygon.

    What boxes along its sides cover is bounded by the sides moved by the corners of the boxes, and
    by boxes at the vertices where a coordinate turns back.

    Args:
        x: Vertices, shape (n, 2).
        half: Half sides of the box at each, shape (n, 2).
    """
    moved = x + _CORNERS[:, None] * half
    boxes = np.concatenate([sides(moved[:, k]) for k in np.nonzero(turning(x).any(axis=1))[0]])
    return star(np.concatenate([*(sides(each) for each in moved), boxes]))


# Regions from which no input leads out of a polygon in so many periods.

_INPUTS = np.linspace(0.0, 1.0, 17)


class PlanarMotion(NamedTuple):
    """A motion in the plane under one bounded input, which is held for a period; at rest at 0.

    Attributes:
        before: Function of points, shape (n, 2), and of inputs from 0, the least, to 1, the
            largest, shape (m,), to the points a period before, shape (m, n, 2).
        margin: Function of points, shape (n, 2), to half sides of boxes, shape (n, 2). The first
            is above the error of a chord of length `size` for its image, the second above this
            and the change of the second coordinate with the input.
        weights: A chord d is ``weights . |d|`` long, shape (2,).
        size: Length of chords.
    """

    before: Callable[[Array, Array], Array]
    margin: Callable[[Array], Array]
    weights: npt.ArrayLike
    size: float


def regions(wall: Array, motion: PlanarMotion) -> Iterator[Array]:
    """Polygons D_k, from inside which no inputs lead out of the wall D_0 within k periods.

    The complement of the largest D_k+1 is that of the wall, and what comes under some input to the
    complement of D_k. As the input goes from the least to the largest, the place after a period,
    Phi_u(x), runs along a curve that is nearly parallel to the first axis. So that set is bounded
    by what comes to the edge of D_k under the least and under the largest input, and by what comes
    under any input to a point of the edge that such a curve touches from inside. Were all curves
    parallel to the axis, these would be vertices where the second coordinate turns back.

    They are when D_k is first eroded by boxes that are higher than a curve, to E. Let x, with both
    ends of its curve in E, be the first point on its ray for which the curve touches the edge of
    D_k, say from below, at y. The boxes at the ends are in D_k. So the edge rises from y to both
    sides of the curve's range, and has there, no more than a box below y, a lowest vertex; the
    box below it has a lowest vertex V of E, on the curve of x or below it. The curve of the origin
    is a point, and below V. Hence the curve of a point of the ray before x goes through V; but the
    region ends at the first such point.

    Each polygon is star-shaped, which may make it smaller, but never larger. The iteration ends
    where the boxes are as large as a region.

    Args:
        wall: Vertices of a convex polygon about the origin, shape (n, 2).
        motion: The motion.
    """
    region = star(sides(wall))
    while True:
        yield region
        x = refined(region, motion.weights, motion.size)
        half = motion.margin(x)
        if (gauge(region, 2.0 * _CORNERS * half.max(axis=0)) >= 1.0).any():
            return
        inner = refined(eroded(x, half), motion.weights, motion.size)
        least, largest = motion.before(inner, np.array([0.0, 1.0]))
        paths = motion.before(inner[turning(inner)[:, 1]], _INPUTS)
        through = np.stack([paths[:-1], paths[1:]], axis=2).reshape(-1, 2, 2)
        region = star(np.concatenate([sides(least), sides(largest), sides(wall), through]))
