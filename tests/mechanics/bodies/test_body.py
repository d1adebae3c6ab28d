"""What a body is and does: sums over its points, principal axes, kinds, refusals."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_envs.mechanics import bodies
from rigid_envs.mechanics.bodies.body import Body
from tests.mechanics.attitudes import quaternions
from tests.mechanics.bodies.examples import (
    ROUNDING,
    any_body,
    assert_same_body,
    clouds,
    matrix,
    points,
    tensor_about,
)
from tests.refusals import refuses

CENTRE = np.zeros(3)
SIZE = 2.0 * np.sqrt(3.0)  # the largest distance of two of `points`


def near(found, expected, masses):
    """Equal to rounding of sums of m r^2, with r up to SIZE."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUNDING * np.sum(masses) * SIZE**2)


# Moments about points and axes
@given(clouds, points)
def test_the_tensor_about_a_point_is_the_sum_over_points(cloud, point):
    body = bodies.point_masses(*cloud)
    near(body.about(point), tensor_about(point, *cloud), cloud[0])
    near(body.about(body.com), body.inertia, cloud[0])


@given(clouds, points, points.filter(lambda n: np.linalg.norm(n) > 0.1))
def test_the_moment_about_an_axis_is_the_sum_of_squared_distances(cloud, point, n):
    arms = np.cross(cloud[1] - point, n / np.linalg.norm(n))
    moment = np.sum(cloud[0][:, None] * arms**2)
    body = bodies.point_masses(*cloud)
    for length in (1.0, -1e-200, 1e200):
        near(body.about_axis(point, length * n), moment, cloud[0])


# Motion
@given(clouds, quaternions, points)
def test_a_turned_and_moved_body_is_that_of_the_turned_and_moved_points(cloud, q, d):
    masses, positions = cloud
    moved = bodies.point_masses(*cloud).rotated(q).translated(d)
    assert_same_body(moved, bodies.point_masses(masses, positions @ matrix(q).T + d), SIZE)
    assert_same_body(bodies.point_masses(*cloud).rotated(matrix(q)).translated(d), moved, SIZE)


@given(quaternions)
def test_a_lamina_stays_one_under_a_matrix_of_float32(q):
    turned = bodies.rectangular_lamina(1.0, 2.0, 3.0).rotated(matrix(q).astype(np.float32))
    moments = turned.principal().moments
    np.testing.assert_allclose(moments, [1 / 3, 3 / 4, 13 / 12], rtol=0, atol=4 * ROUNDING)


def test_quarter_turns_are_exact():
    body = bodies.cone(1.0, 0.3, 0.7).rotated([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    before = bodies.cone(1.0, 0.3, 0.7)
    assert np.array_equal(np.diag(body.inertia), np.roll(np.diag(before.inertia), 1))
    assert np.count_nonzero(body.inertia) == 3 and body.com.tolist() == [before.com[2], 0.0, 0.0]


@pytest.mark.parametrize("body", [bodies.rod(1.0, 1.0), bodies.point_masses([1.0], [CENTRE])])
def test_what_has_no_moment_about_an_axis_has_no_angular_acceleration(body):
    with pytest.raises(
        ValueError, match=r"^moments = \[0\.0, .*expected positive principal .*a width"
    ):
        body.rotated([0.5, 0.5, 0.5, 0.5]).angular_acceleration([1.0, 0.0, 0.0], CENTRE)


@given(any_body, st.integers(0, 3))
def test_leading_axes_broadcast_row_by_row(body, n):
    rng = np.random.default_rng(0)
    first, second = rng.normal(size=(n, 1, 3)), rng.normal(size=(2, 3))
    for method in (body.about, body.angular_momentum, body.kinetic_energy):
        rows = method(first)
        assert rows.shape[:2] == (n, 1)
        for i in range(n):
            np.testing.assert_allclose(rows[i, 0], method(first[i, 0]), rtol=1e-12, atol=1e-12)
    assert body.about_axis(first, second).shape == (n, 2)
    solid = bodies.box(1.0, 1.0, 2.0, 3.0)
    assert solid.angular_acceleration(first, second).shape == (n, 2, 3)


# The value
def test_bodies_never_change():
    given_tensor = np.diag([1.0, 2.0, 2.5])
    body = Body(2.0, given_tensor, [1.0, 2.0, 3.0])
    given_tensor[0, 0] = 9.0
    assert body.inertia[0, 0] == 1.0
    for same in (body, copy.deepcopy(body), copy.copy(body), pickle.loads(pickle.dumps(body))):
        assert same == body
        for array in (same.inertia, same.com):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0.0
            with pytest.raises(ValueError, match="WRITEABLE"):
                array.flags.writeable = True
        with pytest.raises(dataclasses.FrozenInstanceError):
            same.mass = 1.0


def test_equal_bodies_have_equal_numbers_and_hashes():
    one, two = bodies.box(1.0, 1.0, 2.0, 3.0), bodies.box(1.0, 1.0, 2.0, 3.0)
    assert one == two and len({one, two}) == 1
    assert len({one, one.translated([0.0, 0.0, 1.0]), bodies.box(1.0, 1.0, 2.0, 3.1)}) == 3
    assert one.translated([-0.0, 0.0, 0.0]) == one and one != "box"
    assert dataclasses.replace(one, mass=2.0).inertia is not one.inertia
    assert "mass=1.0" in repr(one)


def test_asymmetry_of_rounding_is_averaged_away():
    tensor = np.diag([1.0, 2.0, 2.5])
    tensor[0, 1] = 1e-10
    found = Body(1.0, tensor).inertia
    assert found[0, 1] == found[1, 0] == 0.5e-10


# Refusals
@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan, np.inf, [1.0, 2.0], "1", True, None, 1j])
def test_a_mass_is_one_positive_number(mass):
    refuses(r"^mass\b.*expected", Body, mass, np.eye(3))


@pytest.mark.parametrize(
    "inertia",
    [1.0, [1.0, 2.0, 3.0], np.eye(4), np.full((3, 3), np.nan), np.full((2, 3, 3), 1.0), "I", None],
)
def test_inertia_is_one_tensor_of_finite_numbers(inertia):
    refuses(r"(?s)^inertia\b.*expected", Body, 1.0, inertia)


@pytest.mark.parametrize("com", [1.0, [1.0, 2.0], np.eye(3), [0.0, 0.0, np.inf], "com", None])
def test_a_centre_of_mass_is_one_point(com):
    refuses(r"(?s)^com\b.*expected", Body, 1.0, np.eye(3), com)


@pytest.mark.parametrize(("i", "j"), [(0, 1), (0, 2), (1, 2)])
def test_an_asymmetric_tensor_is_refused_by_entry(i, j):
    tensor = np.diag([1.0, 2.0, 2.5])
    tensor[j, i] = 0.1
    entries = rf"^inertia\[{i}, {j}\] = 0.0; expected inertia\[{j}, {i}\] = 0.1, "
    expected = entries + r".*symmetric.*I \+ I.T"
    refuses(expected, Body, 1.0, tensor)


@pytest.mark.parametrize("q", [(1, 0, 0, 0), (0.1, 0.7, -0.1, 0.7)])
def test_the_moment_that_breaks_the_triangle_is_named_with_the_excess(q):
    R = matrix(np.array(q, dtype=float))
    above = r"^inertia = .*; expected I3 <= I1 \+ I2 .*I3 = 4 is above 1 \+ 2 by 1 kg m\^2: l"
    refuses(above, Body, 1.0, R @ np.diag([4.0, 1.0, 2.0]) @ R.T)
    below = r"^inertia = .*; expected principal moments .*I1 = -0.5 kg m\^2: .*-sum m x y"
    refuses(below, Body, 1.0, R @ np.diag([1.0, 1.0, -0.5]) @ R.T)
    with pytest.raises(ValueError, match=r"I1 = -(1e-08|9.9\d+e-09|1.0\d+e-08) kg"):
        Body(1.0, R @ np.diag([-1e-8, 1.0, 1.0]) @ R.T)


@pytest.mark.parametrize("moments", [(0, 0, 0), (0, 1, 1), (1, 2, 3), (1, 1, 2), (1, 2, 3 + 2e-9)])
def test_points_lines_and_flat_bodies_are_bodies(moments):
    assert np.array_equal(Body(1.0, np.diag(moments)).principal().moments, moments)


@pytest.mark.parametrize("moments", [(0, 0, 1), (0, 1, 1.01), (1, 2, 3 + 1e-8), (-1e-8, 1, 1)])
def test_what_is_hardly_no_body_is_none(moments):
    refuses("principal moment", Body, 1.0, np.diag(moments))


def test_bad_arguments_of_methods_are_refused_by_name():
    body = bodies.box(1.0, 1.0, 2.0, 3.0)
    for bad in (1.0, [1.0, 2.0], [np.nan, 0.0, 0.0], "x", None):
        for name, call in {
            "point": body.about,
            "omega_body": body.kinetic_energy,
            "displacement": body.translated,
            "direction": lambda n: body.about_axis(CENTRE, n),
            "attitude": body.rotated,
            "tau_body": lambda tau: body.angular_acceleration(CENTRE, tau),
        }.items():
            refuses(rf"(?s)^{name}\b.*expected", call, bad)
    refuses(r"direction\[1\] = .*not all zero", body.about_axis, CENTRE, [[0, 0, 1], [0, 0, 0]])
    for bad in (1.0, np.ones(3), np.ones((2, 4)), np.eye(2)):
        refuses(r"^attitude has shape .*; expected \(4,\) or \(3, 3\)", body.rotated, bad)
    refuses(r"^attitude = .*length 1", body.rotated, [1.0, 0.0, 0.0, 1.0])
    refuses(r"^attitude = .*right-handed", body.rotated, -np.eye(3))
    refuses(r"^tolerance = -1.0; expected a positive", body.kind, -1.0)


REPEATED = 2e-12  # equal moments to 1e-12 of the largest are exchanged, and each may differ so


def turned(moments, R):
    return Body(1.0, R @ np.diag(np.asarray(moments, dtype=float)) @ R.T)


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


@given(quaternions, st.floats(-np.pi, np.pi), st.sampled_from([(1, 1, 1.5), (1, 1.5, 1.5)]))
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


@given(quaternions)
def test_a_sphere_has_the_construction_axes_in_any_attitude(q):
    axes = bodies.solid_sphere(1.0, 1.0).rotated(q).principal().axes
    np.testing.assert_allclose(axes, np.eye(3), rtol=0, atol=ROUNDING)


@given(quaternions)
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


@given(clouds, quaternions, st.floats(1e-6, 1.0))
def test_a_tensor_below_the_triangle_inequality_is_refused(cloud, q, lack):
    I1, I2, I3 = bodies.point_masses(*cloud).principal().moments + 0.1
    excess = lack * I3 + (I1 + I2 - I3)
    refuses(r"^inertia = .*; expected I3 <= I1 \+ I2", turned, (I1, I2, I3 + excess), matrix(q))


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
@given(q=quaternions)
def test_the_kind_tells_which_moments_are_equal_in_any_attitude(moments, kind, q):
    assert turned(moments, matrix(q)).kind() == kind


def test_the_tolerance_of_kinds_is_a_part_of_the_largest_moment():
    body = Body(1.0, np.diag([1000.0, 1003.0, 1010.0]))
    assert body.kind() == "asymmetric"
    assert body.kind(0.004) == "symmetric_oblate"
    assert body.kind(0.01) == "spherical"


@given(quaternions)
def test_a_line_has_an_endless_ellipsoid_around_it_in_any_attitude(q):
    rod = bodies.rod(3.0, 2.0).rotated(q)
    semi_axes, axes = rod.inertia_ellipsoid()
    assert np.array_equal(np.isinf(semi_axes), [True, False, False])
    np.testing.assert_allclose(semi_axes[1:], 1.0, rtol=ROUNDING)
    assert abs(axes[:, 0] @ matrix(q)[:, 2]) == pytest.approx(1.0, abs=ROUNDING)


def test_a_point_has_an_ellipsoid_that_is_all_of_space():
    assert np.all(np.isinf(bodies.point_masses([1.0], [[1, 2, 3]]).inertia_ellipsoid().semi_axes))
