"""Principal moments, axes and kinds: what defines them, and one answer where there are many."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_envs.mechanics import bodies
from rigid_envs.mechanics.bodies.body import Body
from tests.bodies.examples import ROUNDING, any_body, attitudes, clouds, matrix, points

REPEATED = 2e-12  # equal moments to 1e-12 of the largest are exchanged, and each may differ so


def turned(moments, R):
    return Body(1.0, R @ np.diag(np.asarray(moments, dtype=float)) @ R.T)


@given(any_body)
def test_moments_and_axes_give_back_the_tensor(body):
    moments, axes = body.principal()
    error = axes @ np.diag(moments) @ axes.T - body.inertia
    assert np.max(np.abs(error)) <= REPEATED * moments[2]
    assert np.all(np.diff(moments) >= 0.0) and moments[0] >= 0.0


@given(any_body)
def test_axes_are_a_proper_rotation_and_a_frame_in_which_nothing_is_left_off_the_diagonal(body):
    moments, axes = body.principal()
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), rtol=0, atol=ROUNDING)
    assert np.linalg.det(axes) == pytest.approx(1.0, abs=ROUNDING)
    straight = body.rotated(axes.T).inertia
    np.testing.assert_allclose(straight, np.diag(moments), rtol=0, atol=REPEATED * moments[2])


@pytest.mark.parametrize("size", [1e-30, 1.0, 1e38])
@pytest.mark.parametrize(
    "moments", [(1, 2, 2.5), (1, 1, 1), (1, 1, 2), (1, 2, 2), (0, 1, 1), (0, 0, 0), (1, 2, 3)]
)
def test_a_diagonal_tensor_in_ascending_order_has_the_construction_axes(moments, size):
    body = Body(1.0, size * np.diag(moments))
    found = body.principal()
    assert np.array_equal(found.axes, np.eye(3))
    assert not np.any(np.signbit(found.axes))
    assert np.array_equal(found.moments, np.diag(body.inertia))


@pytest.mark.parametrize(
    ("moments", "axes"),
    [
        ((2, 3, 1.5), [[0, 1, 0], [0, 0, 1], [1, 0, 0]]),
        ((2, 1, 2.5), [[0, 1, 0], [1, 0, 0], [0, 0, -1]]),
        ((2, 1, 1), [[0, 0, 1], [1, 0, 0], [0, 1, 0]]),
        ((2, 2, 1), [[0, 1, 0], [0, 0, 1], [1, 0, 0]]),
        ((2, 1, 2), [[0, 1, 0], [1, 0, 0], [0, 0, -1]]),
    ],
)
def test_a_diagonal_tensor_in_any_order_has_axes_along_them(moments, axes):
    found = Body(1.0, np.diag(np.array(moments, dtype=float))).principal()
    assert np.array_equal(found.axes, axes) and np.array_equal(found.moments, sorted(moments))
    assert not np.any(np.signbit(found.axes[found.axes == 0.0]))


def test_moments_that_differ_by_more_than_roundings_have_axes_of_their_own():
    R = matrix(np.array([np.cos(0.2), 0.0, 0.0, np.sin(0.2)]))
    axes = turned((1.0, 1.0 + 1e-10, 1.5), R).principal().axes
    # Rounding of the tensor turns them by its size over the gap
    np.testing.assert_allclose(axes[:, 0], R[:, 0], rtol=0, atol=ROUNDING / 1e-10)


@given(attitudes, st.floats(-np.pi, np.pi), st.sampled_from([(1, 1, 1.5), (1, 1.5, 1.5)]))
def test_repeated_moments_have_axes_that_do_not_depend_on_how_the_tensor_came_about(
    q, angle, moments
):
    about = 2 if moments[0] == moments[1] else 0
    around = np.roll(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]],
        about + 1,
        axis=(0, 1),
    )
    first, second = turned(moments, matrix(q)), turned(moments, matrix(q) @ around)
    # The eigenspaces have a gap of 1/3 of the largest moment, and a direction projected on them
    # has a length of 1 / sqrt(3) or more, or, if it is the second one, of 1 / sqrt(2)
    np.testing.assert_allclose(
        first.principal().axes, second.principal().axes, rtol=0, atol=12 * ROUNDING
    )


@given(attitudes)
def test_a_sphere_has_the_construction_axes_in_any_attitude(q):
    axes = bodies.solid_sphere(1.0, 1.0).rotated(q).principal().axes
    np.testing.assert_allclose(axes, np.eye(3), rtol=0, atol=ROUNDING)


@given(attitudes)
def test_the_first_axes_point_to_the_positive_side_of_the_nearest_construction_axis(q):
    axes = turned((1.0, 1.5, 2.0), matrix(q)).principal().axes
    for k in (0, 1):
        assert axes[:, k].max() >= np.abs(axes[:, k]).max() * (1.0 - 2e-9)  # 1e-9 is a tie


# Which tensors are physical


@given(clouds, points)
def test_points_keep_the_triangle_inequality_about_any_point(cloud, point):
    about = bodies.point_masses(*cloud).about(point)
    moments = np.linalg.eigvalsh(about)
    assert moments[2] <= moments[0] + moments[1] + ROUNDING * moments[2]
    Body(1.0, about)  # it is the tensor of these points and a mass that balances them


@given(clouds, attitudes, st.floats(1e-6, 1.0))
def test_a_tensor_below_the_triangle_inequality_is_refused(cloud, q, lack):
    I1, I2, I3 = bodies.point_masses(*cloud).principal().moments + 0.1
    excess = lack * I3 + (I1 + I2 - I3)
    with pytest.raises(ValueError, match=r"^inertia = .*; expected I3 <= I1 \+ I2"):
        turned((I1, I2, I3 + excess), matrix(q))


# Kinds


@pytest.mark.parametrize(
    ("moments", "kind"),
    [
        ((1, 1, 1), "spherical"),
        ((0, 0, 0), "spherical"),
        ((0, 1, 1), "symmetric_prolate"),
        ((1, 2, 2), "symmetric_prolate"),
        ((1, 1, 2), "symmetric_oblate"),
        ((1, 1.5, 2), "asymmetric"),
        ((1, 1 + 1e-8, 2), "asymmetric"),
        ((1, 1 + 1e-10, 2), "symmetric_oblate"),
    ],
)
@given(q=attitudes)
def test_the_kind_tells_which_moments_are_equal_in_any_attitude(moments, kind, q):
    assert turned(moments, matrix(q)).kind() == kind


def test_the_tolerance_of_kinds_is_a_part_of_the_largest_moment():
    body = Body(1.0, np.diag([1000.0, 1003.0, 1010.0]))
    assert body.kind() == "asymmetric"
    assert body.kind(0.004) == "symmetric_oblate"
    assert body.kind(0.01) == "spherical"


# The ellipsoid


@given(attitudes, points.filter(lambda n: np.linalg.norm(n) > 0.1))
def test_the_moment_about_an_axis_is_one_over_the_square_where_it_pierces_the_ellipsoid(q, n):
    body = bodies.ellipsoid(2.0, 1.0, 1.5, 0.4).rotated(q).translated([3.0, 1.0, 2.0])
    semi_axes, axes = body.inertia_ellipsoid()
    n = n / np.linalg.norm(n)
    pierced = 1.0 / np.linalg.norm((axes.T @ n) / semi_axes)
    # the moments are 0.9, 0.46 and 1.3: their ratio is below 3
    moment = body.about_axis(body.com, n)
    assert moment == pytest.approx(1.0 / pierced**2, rel=3 * ROUNDING)


@given(attitudes)
def test_a_line_has_an_endless_ellipsoid_around_it_in_any_attitude(q):
    rod = bodies.rod(3.0, 2.0).rotated(q)
    semi_axes, axes = rod.inertia_ellipsoid()
    assert np.array_equal(np.isinf(semi_axes), [True, False, False])
    np.testing.assert_allclose(semi_axes[1:], 1.0, rtol=ROUNDING)
    assert abs(axes[:, 0] @ matrix(q)[:, 2]) == pytest.approx(1.0, abs=ROUNDING)


def test_a_point_has_an_ellipsoid_that_is_all_of_space():
    assert np.all(np.isinf(bodies.point_masses([1.0], [[1, 2, 3]]).inertia_ellipsoid().semi_axes))
