"""Points, simplices and composition, against definitions and equimomental points."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rigid_envs.mechanics import bodies
from rigid_envs.mechanics.rotations import rotate
from tests.bodies.examples import (
    EPS,
    ROUNDING,
    any_body,
    assert_same_body,
    attitudes,
    clouds,
    points,
    sizes,
    tensor_about,
)

UPRIGHT, ORIGIN = np.eye(3), np.zeros(3)
SIZE = 2.0 * np.sqrt(3.0)
poses = st.tuples(any_body, attitudes, points)


@given(clouds)
def test_points_have_their_mean_and_the_sum_of_their_squares(cloud):
    body = bodies.point_masses(*cloud)
    assert body.mass == pytest.approx(np.sum(cloud[0]), rel=4 * EPS)
    mean = np.average(cloud[1], axis=0, weights=cloud[0])
    np.testing.assert_allclose(body.com, mean, rtol=0, atol=ROUNDING)
    scale = body.mass * SIZE**2
    expected = tensor_about(mean, *cloud)
    np.testing.assert_allclose(body.inertia, expected, rtol=0, atol=ROUNDING * scale)


@given(sizes, sizes, points, points)
def test_two_points_are_a_line_with_the_reduced_mass(m1, m2, x1, x2):
    assume(np.linalg.norm(x2 - x1) > 1e-3)
    body = bodies.point_masses([m1, m2], [x1, x2])
    moment = m1 * m2 / (m1 + m2) * np.sum((x2 - x1) ** 2)
    # The centre of mass is rounded to 1e-16 of coordinates up to 1
    lost = ROUNDING * (m1 + m2) * np.linalg.norm(x2 - x1)
    np.testing.assert_allclose(body.principal().moments, [0, moment, moment], rtol=0, atol=lost)
    assert body.kind() == "symmetric_prolate"


def test_points_far_away_keep_their_inertia():
    masses, x = [1.0, 2.0, 3.0, 4.0], np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3.0]])
    near, far = bodies.point_masses(masses, x), bodies.point_masses(masses, x + 2.0**30)
    # The centre of mass is rounded by 2^30 eps, the tensor about it by the square of that
    np.testing.assert_allclose(far.inertia, near.inertia, rtol=0, atol=1e-12)
    np.testing.assert_allclose(far.com - 2.0**30, near.com, rtol=0, atol=2.0**30 * EPS)


def test_points_at_one_place_have_no_inertia_wherever_it_is():
    body = bodies.point_masses([0.1, 0.2, 0.7, 0.3], [[1e8 / 3, 0.1, -3.3]] * 4)
    assert np.array_equal(body.inertia, np.zeros((3, 3)))


@given(sizes, st.lists(points, min_size=3, max_size=3).map(np.array))
def test_a_triangle_moves_like_a_third_of_it_on_the_middle_of_each_side(m, corners):
    assume(np.linalg.matrix_rank(corners[1:] - corners[0]) == 2)
    middles = 0.5 * (corners + np.roll(corners, 1, axis=0))
    alike = bodies.point_masses(np.full(3, m / 3), middles)
    body = bodies.triangular_lamina(m, corners)
    assert_same_body(body, alike, size=SIZE)
    assert abs(bodies.perpendicular_axis(body)) <= ROUNDING * m * SIZE**2


@given(sizes, st.lists(points, min_size=4, max_size=4).map(np.array))
def test_a_tetrahedron_moves_like_a_twentieth_of_it_at_the_corners_and_the_rest_in_the_middle(
    m, corners
):
    assume(np.linalg.matrix_rank(corners[1:] - corners[0]) == 3)
    places = np.vstack([corners, corners.mean(axis=0)])
    alike = bodies.point_masses(m * np.array([0.05, 0.05, 0.05, 0.05, 0.8]), places)
    assert_same_body(bodies.tetrahedron(m, corners), alike, size=SIZE)


# Composition


@given(st.lists(poses, min_size=1, max_size=4))
def test_a_whole_has_the_sums_of_its_parts_about_any_point(parts):
    whole = bodies.compose(parts)
    assert whole.mass == pytest.approx(sum(body.mass for body, _, _ in parts), rel=8 * EPS)
    placed = [body.rotated(q).translated(d) for body, q, d in parts]
    first = sum(body.mass * body.com for body in placed)
    scale = whole.mass * (2.0 * SIZE) ** 2
    np.testing.assert_allclose(whole.mass * whole.com, first, rtol=0, atol=ROUNDING * scale)
    for point in np.eye(3):
        total = sum(body.about(point) for body in placed)
        np.testing.assert_allclose(whole.about(point), total, rtol=0, atol=ROUNDING * scale)


@given(st.lists(st.tuples(clouds, attitudes, points), min_size=1, max_size=3))
def test_joined_points_are_all_the_points(parts):
    masses = np.concatenate([cloud[0] for cloud, _, _ in parts])
    places = np.concatenate([rotate(q, cloud[1]) + d for cloud, q, d in parts])
    whole = bodies.compose([(bodies.point_masses(*cloud), q, d) for cloud, q, d in parts])
    assert_same_body(whole, bodies.point_masses(masses, places), size=2 * SIZE)


@given(any_body, any_body, any_body, attitudes, attitudes, points, points)
def test_it_does_not_matter_what_is_joined_first(a, b, c, p, q, d, e):
    at_once = bodies.compose([(a, UPRIGHT, ORIGIN), (b, p, d), (c, q, e)])
    later = bodies.compose(
        [(c, q, e), (bodies.compose([(b, p, d), (a, UPRIGHT, ORIGIN)]), UPRIGHT, ORIGIN)]
    )
    assert_same_body(later, at_once, size=2 * SIZE)


@given(any_body, attitudes, points)
def test_one_part_is_that_part_moved(body, q, d):
    assert_same_body(bodies.compose([(body, q, d)]), body.rotated(q).translated(d), size=2 * SIZE)


# Refusals


@pytest.mark.parametrize(
    ("masses", "positions", "name"),
    [
        ([1.0], [[0.0, 0.0]], "positions"),
        ([1.0], [0.0, 0.0, 0.0], "positions"),
        ([], np.zeros((0, 3)), "positions"),
        ([1.0], [[0.0, np.nan, 0.0]], "positions"),
        ([1.0], [[0.0, 0.0, 0.0]] * 2, "masses"),
        ([[1.0]], [[0.0, 0.0, 0.0]], "masses"),
        ([np.inf], [[0.0, 0.0, 0.0]], "masses"),
        (["one"], [[0.0, 0.0, 0.0]], "masses"),
    ],
)
def test_points_without_a_mass_or_a_place_are_refused(masses, positions, name):
    with pytest.raises(ValueError, match=rf"(?s)^{name}\b.*expected"):
        bodies.point_masses(masses, positions)


def test_a_mass_that_is_not_positive_is_refused_by_index():
    with pytest.raises(ValueError, match=r"^masses\[1\] = 0.0; expected positive masses"):
        bodies.point_masses([1.0, 0.0], np.eye(3)[:2])


def test_corners_without_an_area_or_a_volume_are_refused():
    line = [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [0.1, 0.2, 0.3]]
    with pytest.raises(ValueError, match=r"^vertices = .*not in line: move one"):
        bodies.triangular_lamina(1.0, line)
    with pytest.raises(ValueError, match=r"^vertices = .*not in a plane: move one"):
        bodies.tetrahedron(1.0, [*line, [0.0, 1.0, 0.0]])
    for make, shape in ((bodies.triangular_lamina, (3, 2)), (bodies.tetrahedron, (3, 3))):
        with pytest.raises(ValueError, match=r"^vertices has shape"):
            make(1.0, np.zeros(shape))
        with pytest.raises(ValueError, match=r"^mass = -1\.0"):
            make(-1.0, np.vstack([np.zeros(3), np.eye(3)])[: 3 + (make is bodies.tetrahedron)])


def test_parts_that_are_nowhere_are_refused_by_index():
    body = bodies.rod(1.0, 1.0)
    with pytest.raises(ValueError, match=r"^parts = \[\]; expected one"):
        bodies.compose([])
    with pytest.raises(ValueError, match=r"^parts\[1\]\.attitude has shape \(2,\)"):
        bodies.compose([(body, UPRIGHT, ORIGIN), (body, [1.0, 0.0], ORIGIN)])
    with pytest.raises(ValueError, match=r"^parts\[0\]\.position has shape \(2,\)"):
        bodies.compose([(body, UPRIGHT, [1.0, 0.0])])
