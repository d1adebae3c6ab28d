"""What a body is and does, against sums over its points: definitions, not theorems."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rigid_envs.mechanics import bodies
from rigid_envs.mechanics.bodies.body import Body
from tests.bodies.examples import (
    EPS,
    ROUNDING,
    any_body,
    assert_same_body,
    attitudes,
    clouds,
    matrix,
    points,
    tensor_about,
)

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


@given(any_body, points)
def test_no_moment_is_less_than_that_about_the_centre_of_mass(body, point):
    more = np.linalg.eigvalsh(body.about(point) - body.inertia)
    assert more[0] >= -ROUNDING * body.mass * SIZE**2


def test_steiner_starts_from_the_centre_of_mass_only():
    body = bodies.rod(3.0, 2.0).translated([5.0, 0.0, 1.0])  # from z = 0 to 2 at x = 5
    np.testing.assert_allclose(body.about([5.0, 0.0, 0.0])[0, 0], 3.0 * 2.0**2 / 3.0, rtol=4 * EPS)


# Motion


@given(clouds, attitudes, points)
def test_a_turned_and_moved_body_is_that_of_the_turned_and_moved_points(cloud, q, d):
    masses, positions = cloud
    moved = bodies.point_masses(*cloud).rotated(q).translated(d)
    assert_same_body(moved, bodies.point_masses(masses, positions @ matrix(q).T + d), SIZE)
    assert_same_body(bodies.point_masses(*cloud).rotated(matrix(q)).translated(d), moved, SIZE)


@given(any_body, attitudes)
def test_principal_moments_and_kind_do_not_change_with_attitude(body, q):
    before, after = body.principal().moments, body.rotated(q).principal().moments
    np.testing.assert_allclose(after, before, rtol=0, atol=ROUNDING * before[2])


@given(attitudes)
def test_a_lamina_stays_one_under_a_matrix_of_float32(q):
    turned = bodies.rectangular_lamina(1.0, 2.0, 3.0).rotated(matrix(q).astype(np.float32))
    moments = turned.principal().moments
    np.testing.assert_allclose(moments, [1 / 3, 3 / 4, 13 / 12], rtol=0, atol=4 * ROUNDING)


def test_quarter_turns_are_exact():
    body = bodies.cone(1.0, 0.3, 0.7).rotated([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    before = bodies.cone(1.0, 0.3, 0.7)
    assert np.array_equal(np.diag(body.inertia), np.roll(np.diag(before.inertia), 1))
    assert np.count_nonzero(body.inertia) == 3 and body.com.tolist() == [before.com[2], 0.0, 0.0]


# Dynamics


@given(clouds, points)
def test_angular_momentum_and_energy_are_sums_over_points(cloud, omega):
    body = bodies.point_masses(*cloud)
    r = cloud[1] - body.com
    v = np.cross(omega, r)
    near(body.angular_momentum(omega), cloud[0] @ np.cross(r, v), 2 * cloud[0])
    near(body.kinetic_energy(omega), 0.5 * cloud[0] @ np.sum(v**2, axis=1), 2 * cloud[0])


@given(clouds, points, points)
def test_the_angular_acceleration_gives_every_point_its_share_of_the_torque(cloud, omega, tau):
    body = bodies.point_masses(*cloud)
    moments = body.principal().moments
    assume(moments[0] > 1e-3 * moments[2])
    alpha = body.angular_acceleration(omega, tau)
    r = cloud[1] - body.com
    acceleration = np.cross(alpha, r) + np.cross(omega, np.cross(omega, r))
    net = cloud[0] @ np.cross(r, acceleration)  # Newton's law for each point
    scale = np.linalg.norm(tau) + moments[2] * (3.0 + np.linalg.norm(alpha))
    np.testing.assert_allclose(net, tau, rtol=0, atol=4 * ROUNDING * scale)


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
    with pytest.raises(ValueError, match=r"^mass\b.*expected"):
        Body(mass, np.eye(3))


@pytest.mark.parametrize(
    "inertia",
    [1.0, [1.0, 2.0, 3.0], np.eye(4), np.full((3, 3), np.nan), np.full((2, 3, 3), 1.0), "I", None],
)
def test_inertia_is_one_tensor_of_finite_numbers(inertia):
    with pytest.raises(ValueError, match=r"(?s)^inertia\b.*expected"):
        Body(1.0, inertia)


@pytest.mark.parametrize("com", [1.0, [1.0, 2.0], np.eye(3), [0.0, 0.0, np.inf], "com", None])
def test_a_centre_of_mass_is_one_point(com):
    with pytest.raises(ValueError, match=r"(?s)^com\b.*expected"):
        Body(1.0, np.eye(3), com)


@pytest.mark.parametrize(("i", "j"), [(0, 1), (0, 2), (1, 2)])
def test_an_asymmetric_tensor_is_refused_by_entry(i, j):
    tensor = np.diag([1.0, 2.0, 2.5])
    tensor[j, i] = 0.1
    entries = rf"^inertia\[{i}, {j}\] = 0.0; expected inertia\[{j}, {i}\] = 0.1, "
    expected = entries + r".*symmetric.*I \+ I.T"
    with pytest.raises(ValueError, match=expected):
        Body(1.0, tensor)


@pytest.mark.parametrize("q", [(1, 0, 0, 0), (0.1, 0.7, -0.1, 0.7)])
def test_the_moment_that_breaks_the_triangle_is_named_with_the_excess(q):
    R = matrix(np.array(q, dtype=float))
    above = r"^inertia = .*; expected I3 <= I1 \+ I2 .*I3 = 4 is above 1 \+ 2 by 1 kg m\^2: l"
    with pytest.raises(ValueError, match=above):
        Body(1.0, R @ np.diag([4.0, 1.0, 2.0]) @ R.T)
    below = r"^inertia = .*; expected principal moments .*I1 = -0.5 kg m\^2: .*-sum m x y"
    with pytest.raises(ValueError, match=below):
        Body(1.0, R @ np.diag([1.0, 1.0, -0.5]) @ R.T)
    with pytest.raises(ValueError, match=r"I1 = -(1e-08|9.9\d+e-09|1.0\d+e-08) kg"):
        Body(1.0, R @ np.diag([-1e-8, 1.0, 1.0]) @ R.T)


@pytest.mark.parametrize("moments", [(0, 0, 0), (0, 1, 1), (1, 2, 3), (1, 1, 2), (1, 2, 3 + 2e-9)])
def test_points_lines_and_flat_bodies_are_bodies(moments):
    assert np.array_equal(Body(1.0, np.diag(moments)).principal().moments, moments)


@pytest.mark.parametrize("moments", [(0, 0, 1), (0, 1, 1.01), (1, 2, 3 + 1e-8), (-1e-8, 1, 1)])
def test_what_is_hardly_no_body_is_none(moments):
    with pytest.raises(ValueError, match="principal moment"):
        Body(1.0, np.diag(moments))


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
            with pytest.raises(ValueError, match=rf"(?s)^{name}\b.*expected"):
                call(bad)
    with pytest.raises(ValueError, match=r"direction\[1\] = .*not all zero"):
        body.about_axis(CENTRE, [[0, 0, 1], [0, 0, 0]])
    for bad in (1.0, np.ones(3), np.ones((2, 4)), np.eye(2)):
        with pytest.raises(
            ValueError, match=r"^attitude has shape .*; expected \(4,\) or \(3, 3\)"
        ):
            body.rotated(bad)
    with pytest.raises(ValueError, match=r"^attitude = .*length 1"):
        body.rotated([1.0, 0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match=r"^attitude = .*right-handed"):
        body.rotated(-np.eye(3))
    with pytest.raises(ValueError, match=r"^tolerance = -1.0; expected a positive"):
        body.kind(-1.0)
