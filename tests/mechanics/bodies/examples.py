"""Bodies to try: hypothesis strategies, and the tensor of points by its definition."""

import numpy as np
from hypothesis import strategies as st

from rigid_envs.mechanics import bodies
from tests.mechanics.attitudes import EPS, quaternions, scipy_of

ROUNDING = 16 * EPS  # of the largest entry: a dozen roundings, none of which cancels

coordinates = st.floats(-1.0, 1.0).map(lambda x: round(x, 6))
points = st.lists(coordinates, min_size=3, max_size=3).map(np.array)
sizes = st.floats(0.1, 10.0)
clouds = st.integers(1, 8).flatmap(
    lambda n: st.tuples(
        st.lists(sizes, min_size=n, max_size=n).map(np.array),
        st.lists(points, min_size=n, max_size=n).map(np.array),
    )
)
any_body = st.builds(
    lambda cloud, q, d: bodies.point_masses(*cloud).rotated(q).translated(d),
    clouds,
    quaternions,
    points,
)


def matrix(q):
    return scipy_of(q).as_matrix()


def tensor_about(point, masses, positions):
    """Sum of m (r^2 1 - r r^T), entry by entry, r from any point."""
    x, y, z = (np.asarray(positions) - point).T
    products = [[y * y + z * z, -x * y, -x * z], [-x * y, z * z + x * x, -y * z]]
    products.append([-x * z, -y * z, x * x + y * y])
    return np.array([[np.sum(masses * entry) for entry in row] for row in products])


def assert_same_body(found, expected, size=0.0):
    """Equal to rounding of the largest entry; `size` [m] is that of coordinates that cancel."""
    scale = np.max(np.abs(expected.inertia)) + expected.mass * size**2
    assert abs(found.mass / expected.mass - 1.0) <= ROUNDING
    np.testing.assert_allclose(found.inertia, expected.inertia, rtol=0, atol=ROUNDING * scale)
    length = np.sqrt(scale / expected.mass) + np.max(np.abs(expected.com))
    np.testing.assert_allclose(found.com, expected.com, rtol=0, atol=ROUNDING * length)
