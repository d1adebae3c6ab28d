"""Attitudes, as the pages speak of them: a unit quaternion (w, x, y, z) or R, body to world."""

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Array",
    "conjugate",
    "matrix",
    "product",
    "quaternion_rate",
    "random_quaternion",
    "rotation_vector",
    "shown",
    "tilted",
]

Array = NDArray[np.float64]


def product(p: Array, q: Array) -> Array:
    """Hamilton product p q."""
    a, u, b, v = p[0], p[1:], q[0], q[1:]
    return np.array([a * b - u @ v, *(a * v + b * u + np.cross(u, v))])


def conjugate(q: Array) -> Array:
    """Inverse of a unit quaternion."""
    return q * [1.0, -1.0, -1.0, -1.0]


def matrix(q: Array) -> Array:
    """R of a quaternion: its columns are the body axes in the world."""
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_rate(q: Array, omega: Array) -> Array:
    """`q' = q (0, omega) / 2`, omega in body axes."""
    w, x, y, z = q
    a, b, c = omega
    rate = (
        -x * a - y * b - z * c,
        w * a + y * c - z * b,
        w * b + z * a - x * c,
        w * c + x * b - y * a,
    )
    return np.array(rate) / 2


def random_quaternion(rng: np.random.Generator) -> Array:
    """Uniform on SO(3): a direction of R^4."""
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def tilted(rng: np.random.Generator, tilt: float) -> Array:
    """An attitude of this tilt [rad], whose direction and phase are uniform."""
    azimuth, phase = rng.uniform(-np.pi, np.pi, 2)
    sine = np.sin(tilt / 2)
    lean = np.array([np.cos(tilt / 2), sine * np.cos(azimuth), sine * np.sin(azimuth), 0.0])
    return product(lean, np.array([np.cos(phase / 2), 0.0, 0.0, np.sin(phase / 2)]))


def rotation_vector(q: Array) -> Array:
    """Axis times angle, of the rotation by at most pi."""
    q = q if q[0] >= 0 else -q
    sine = np.linalg.norm(q[1:])
    return 2 * q[1:] * (np.arctan2(sine, q[0]) / sine if sine else 1.0)


def shown(q: Array, rotation: str) -> Array:
    """The attitude in an observation, for each value of `rotation`."""
    R = matrix(q)
    w, x, y, z = q
    total, difference = np.arctan2(z, w), np.arctan2(y, x)
    theta = 2 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
    ways = {
        "none": [],
        "matrix": R.ravel(),
        "rot6d": R[:, :2].T.ravel(),
        "quat": -q if w < 0 else q,
        "euler": [_wrapped(total + difference), theta, _wrapped(total - difference)],
    }
    return np.array(ways[rotation], dtype=float)


def _wrapped(angle: float) -> float:
    """The same angle in [-pi, pi]."""
    return float(np.arctan2(np.sin(angle), np.cos(angle)))
