"""Attitudes, as the pages speak of them: a unit quaternion (w, x, y, z) or R, body to world."""

import math

import numpy as np

from tests.vectors import cross


def compose(p, q):
    """The rotation q, then p, both in world axes."""
    (a, *u), (b, *v) = np.asarray(p, dtype=float), np.asarray(q, dtype=float)
    vector = a * np.array(v) + b * np.array(u) + cross(u, v)
    return np.array([a * b - np.dot(u, v), *vector])


def inverse(q):
    """The rotation back."""
    return np.asarray(q, dtype=float) * [1.0, -1.0, -1.0, -1.0]


def matrix(q):
    """The rotation matrix R."""
    w, x, y, z = np.asarray(q, dtype=float)
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def of_matrix(R):
    """The longest row of 4 q q^T, whose entries are those of R, at length 1 (Shepperd 1978)."""
    (a, b, c), (d, e, f), (g, h, k) = R
    rows = np.array(
        [
            [1 + a + e + k, h - f, c - g, d - b],
            [h - f, 1 + a - e - k, b + d, c + g],
            [c - g, b + d, 1 - a + e - k, f + h],
            [d - b, c + g, f + h, 1 - a - e + k],
        ]
    )
    row = rows[np.argmax(np.diag(rows))]
    return np.asarray(row / np.linalg.norm(row))


def of_rotation_vector(theta):
    """exp of a rotation vector."""
    theta = np.asarray(theta, dtype=float)
    half = 0.5 * float(np.linalg.norm(theta))
    return np.array([math.cos(half), *(0.5 * np.sinc(half / math.pi) * theta)])


def rotation_vector(q):
    """log R in world axes, with an angle from 0 to pi."""
    q = np.asarray(q, dtype=float)
    w, *v = q if q[0] >= 0.0 else -q
    sine = float(np.linalg.norm(v))
    return np.array(v) * (2.0 * math.atan2(sine, w) / sine if sine > 0.0 else 2.0)


def angle(q):
    """Angle of the rotation, from 0 to pi."""
    return float(np.linalg.norm(rotation_vector(q)))


def quaternion_rate(q, omega):
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


def draw(rng):
    """Uniform on SO(3)."""
    q = rng.normal(size=4)
    return np.asarray(q / np.linalg.norm(q))


def tilted(rng, tilt):
    """An attitude of this tilt [rad], whose direction and phase are uniform."""
    azimuth, phase = rng.uniform(-np.pi, np.pi, 2)
    sine = np.sin(tilt / 2)
    lean = np.array([np.cos(tilt / 2), sine * np.cos(azimuth), sine * np.sin(azimuth), 0.0])
    return compose(lean, np.array([np.cos(phase / 2), 0.0, 0.0, np.sin(phase / 2)]))


def shown(q, rotation):
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


def _wrapped(angle):
    """The same angle in [-pi, pi]."""
    return float(np.arctan2(np.sin(angle), np.cos(angle)))
