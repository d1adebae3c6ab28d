"""Lines with a width: ribbons that face the camera."""

import numpy as np
import numpy.typing as npt

__all__ = ["ribbon", "runs"]

Array = npt.NDArray[np.float64]


def runs(points: Array) -> list[Array]:
    """Parts of a line between points that are not finite, each of two points or more."""
    breaks = np.flatnonzero(~np.isfinite(points).all(axis=-1))
    parts = np.split(points, breaks)
    parts = [parts[0], *(part[1:] for part in parts[1:])]
    return [part for part in parts if len(part) > 1]


def ribbon(points: Array, eye: Array, width: float) -> npt.NDArray[np.float32]:
    """Left and right edge of a line that is seen from a point with its full width.

    The edges are moved towards the eye along the lines of sight, by the width: nothing changes in
    the picture, and a line on a surface is not hidden by it.

    Args:
        points: shape (n, 3), n > 1.
        eye: where it is seen from, shape (3,).
        width: of the line.

    Returns:
        Shape (n, 2, 3).
    """
    sight = eye - points
    distance = np.linalg.norm(sight, axis=-1, keepdims=True)
    across = _cross(np.diff(points, axis=0), sight[:-1])
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    across /= np.where(length > 0.0, length, 1.0)
    both = np.concatenate([across[:1], across]) + np.concatenate([across, across[-1:]])
    square = (both * both).sum(axis=-1, keepdims=True)
    half = width * both / np.maximum(square, 1.0)  # mitred corners, cut off where they are sharp
    centre = points + np.minimum(width / np.maximum(distance, 1e-12), 0.5) * sight
    return np.stack([centre - half, centre + half], axis=1).astype(np.float32)


def _cross(a: Array, b: Array) -> Array:
    """Products a x b of rows, shape (n, 3); faster than NumPy's."""
    one, two = (1, 2, 0), (2, 0, 1)
    return np.asarray(a[:, one] * b[:, two] - a[:, two] * b[:, one])
