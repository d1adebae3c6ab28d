"""Attitudes to try: hypothesis strategies, and SciPy's Rotation as the independent opinion."""

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

EPS = np.finfo(np.float64).eps
ULPS = 16 * EPS  # a few dozen roundings of numbers up to 1, or a few of angles up to pi

components = st.floats(-1.0, 1.0, allow_subnormal=False)
quaternions = (
    st.lists(components, min_size=4, max_size=4)
    .map(np.array)
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
    .map(lambda q: q / np.linalg.norm(q))
)
vectors = st.lists(components, min_size=3, max_size=3).map(np.array)
angles = st.floats(-np.pi, np.pi, exclude_min=True)


def scipy_of(q):
    return Rotation.from_quat(q, scalar_first=True)


def random_vectors(rng, size, low, high):
    """Directions uniform on the sphere, lengths uniform in the logarithm."""
    v = rng.normal(size=(size, 3))
    length = np.exp(rng.uniform(np.log(low), np.log(high), (size, 1)))
    return v / np.linalg.norm(v, axis=-1, keepdims=True) * length
