"""Polyhedra against closed forms, sums of tetrahedra and a sphere; meshes that are none."""

import itertools
import re

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay

from rigid_envs.mechanics import bodies
from tests.bodies.examples import EPS, ROUNDING, assert_same_body, attitudes, matrix, points, sizes

GOLDEN = (1.0 + 5.0**0.5) / 2.0
CORNERS = np.array(list(itertools.product([-0.5, 0.5], repeat=3)))


def hull(vertices):
    """The faces of the convex hull, counter-clockwise seen from outside."""
    surface = ConvexHull(vertices)
    a, b, c = np.moveaxis(vertices[surface.simplices], 1, 0)
    inwards = np.sum(np.cross(b - a, c - a) * surface.equations[:, :3], axis=1) < 0.0
    return np.where(inwards[:, None], surface.simplices[:, ::-1], surface.simplices)


CUBE = hull(CORNERS)


def icosahedron():
    ones = np.array([[0, y, z * GOLDEN] for y in (-1, 1) for z in (-1, 1)])
    vertices = np.concatenate([np.roll(ones, k, axis=1) for k in range(3)])
    return vertices, hull(vertices)


def subdivided(vertices, faces):
    """Each triangle in four, the new corners on the unit sphere."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    unique, index = np.unique(edges, axis=0, return_inverse=True)
    middles = vertices[unique].mean(axis=1)
    ab, bc, ca = np.reshape(index, (3, -1)) + len(vertices)
    a, b, c = faces.T
    corners = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    new = np.concatenate([np.stack(corner, axis=1) for corner in corners])
    return np.vstack([vertices, middles / np.linalg.norm(middles, axis=1, keepdims=True)]), new


# What is inside


@given(sizes, sizes, sizes, sizes, attitudes, points)
def test_the_mesh_of_a_box_is_the_box(density, lx, ly, lz, q, d):
    mesh = bodies.from_mesh(CORNERS * [lx, ly, lz] @ matrix(q).T + d, CUBE, density)
    box = bodies.box(density * lx * ly * lz, lx, ly, lz).rotated(q).translated(d)
    # A corner is rounded by 1e-16 of its largest coordinate, which the thinnest side feels most
    thin = (1.0 + max(lx, ly, lz)) / min(lx, ly, lz)
    assert abs(mesh.mass / box.mass - 1.0) <= thin * ROUNDING
    scale = thin * ROUNDING * np.max(box.inertia)
    np.testing.assert_allclose(mesh.inertia, box.inertia, rtol=0, atol=scale)
    np.testing.assert_allclose(mesh.com, box.com, rtol=0, atol=thin * ROUNDING * thin)


@pytest.mark.parametrize(
    ("vertices", "volume", "moment"),
    [  # per edge^3, and per mass and edge^2; edges are sqrt(8), sqrt(2) and 2 long
        (np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]), 0.5**0.5 / 6, 1 / 20),
        (np.vstack([np.eye(3), -np.eye(3)]), 2**0.5 / 3, 1 / 10),
        (icosahedron()[0], 5 / 12 * (3 + 5**0.5), GOLDEN**2 / 10),
    ],
    ids=["tetrahedron", "octahedron", "icosahedron"],
)
def test_regular_polyhedra_have_their_known_moments(vertices, volume, moment):
    edge = np.min(np.linalg.norm(vertices[1:] - vertices[0], axis=1))
    body = bodies.from_mesh(vertices, hull(vertices), 2.0)
    assert body.mass == pytest.approx(2.0 * volume * edge**3, rel=ROUNDING)
    expected = moment * body.mass * edge**2 * np.eye(3)
    np.testing.assert_allclose(body.inertia, expected, rtol=0, atol=ROUNDING * body.mass * edge**2)
    assert body.kind() == "spherical"


def test_a_tessellated_sphere_tends_to_the_ball_with_second_order():
    vertices, faces = icosahedron()
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    ball = bodies.solid_sphere(4.0 / 3.0 * np.pi, 1.0)
    errors = []
    for _ in range(5):
        vertices, faces = subdivided(vertices, faces)
        mesh = bodies.from_mesh(vertices, faces, 1.0)
        spread = mesh.principal().moments
        assert spread[2] - spread[0] <= ROUNDING * spread[2]  # symmetry keeps it spherical
        errors.append([1.0 - mesh.mass / ball.mass, 1.0 - spread[0] / ball.inertia[0, 0]])
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    # The next term is of fourth order, and edges of the last mesh but one are 0.07 long
    np.testing.assert_allclose(order[-1], 2.0, atol=0.07**2)
    assert errors[-1][1] == pytest.approx(5 / 3 * errors[-1][0], rel=1e-2)  # volume goes as r^3


@given(st.lists(points, min_size=5, max_size=9).map(np.array))
def test_a_polyhedron_is_all_the_tetrahedra_in_it(vertices):
    assume(np.linalg.matrix_rank(vertices[1:] - vertices[0]) == 3)
    assume(ConvexHull(vertices, qhull_options="QJ").volume > 1e-2)
    surface = ConvexHull(vertices)
    cells = Delaunay(vertices).simplices
    whole = bodies.from_mesh(vertices, hull(vertices), 1.0)
    volumes = np.abs(np.linalg.det(vertices[cells[:, 1:]] - vertices[cells[:, :1]])) / 6.0
    solid = volumes > 1e-12  # Qhull makes cells of points in a plane
    pose = np.eye(3), np.zeros(3)
    parts = [
        (bodies.tetrahedron(volume, vertices[cell]), *pose)
        for volume, cell in zip(volumes[solid], cells[solid], strict=True)
    ]
    assume(abs(volumes[solid].sum() - surface.volume) <= 1e-11)
    assert whole.mass == pytest.approx(surface.volume, rel=1e-10)
    together = bodies.compose(parts)
    np.testing.assert_allclose(whole.inertia, together.inertia, rtol=0, atol=1e-10)
    np.testing.assert_allclose(whole.com, together.com, rtol=0, atol=1e-8)


def test_a_cavity_is_a_surface_that_looks_inwards():
    vertices = np.vstack([2.0 * CORNERS, CORNERS])
    hollow = bodies.from_mesh(vertices, np.vstack([CUBE, CUBE[:, ::-1] + 8]), 1.0)
    assert hollow.mass == pytest.approx(7.0, rel=ROUNDING)
    filled = [(hollow, np.eye(3), np.zeros(3)), (bodies.box(1.0, 1, 1, 1), np.eye(3), np.zeros(3))]
    assert_same_body(bodies.compose(filled), bodies.box(8.0, 2.0, 2.0, 2.0))


def test_a_mesh_far_away_keeps_its_inertia():
    far = bodies.from_mesh(CORNERS + 2.0**20, CUBE, 6.0)
    assert_same_body(far, bodies.box(6.0, 1.0, 1.0, 1.0).translated([2.0**20] * 3))


@pytest.mark.parametrize("stray", [1e5, -1e12, 1e300])
def test_a_vertex_that_no_face_has_does_not_count(stray):
    # Its mean with the others as origin would lose 10 digits of the inertia at 1e5.
    vertices = np.vstack([[stray, 0.3, -stray], CORNERS])
    found = bodies.from_mesh(vertices, CUBE + 1, 6.0)
    assert_same_body(found, bodies.box(6.0, 1.0, 1.0, 1.0))


def test_parts_that_overlap_count_for_each_of_them():
    vertices = np.vstack([CORNERS, CORNERS + 0.5 * np.eye(3)[0]])
    found = bodies.from_mesh(vertices, np.vstack([CUBE, CUBE + 8]), 1.0)
    part = bodies.box(1.0, 1.0, 1.0, 1.0)
    pair = bodies.compose([(part, np.eye(3), [x, 0.0, 0.0]) for x in (0.0, 0.5)])
    assert_same_body(found, pair)


def test_the_order_of_faces_and_where_each_begins_do_not_matter():
    rng = np.random.default_rng(0)
    mixed = [np.roll(face, rng.integers(3)) for face in rng.permutation(CUBE)]
    assert_same_body(bodies.from_mesh(CORNERS, mixed, 1.0), bodies.box(1.0, 1.0, 1.0, 1.0))


# Refusals


def test_a_hole_is_refused_by_its_edge_and_the_face_beside_it():
    with pytest.raises(
        ValueError, match=r"^faces\[\d+\] = .*; expected a second face .*close the hole"
    ) as refusal:
        bodies.from_mesh(CORNERS, CUBE[1:], 1.0)
    face, *_, start, end = map(int, re.findall(r"\d+", str(refusal.value)))
    assert {start, end} <= set(CUBE[0]) and {start, end} <= set(CUBE[1 + face])


def test_a_face_that_looks_the_other_way_is_refused_by_its_edge_and_faces():
    turned = CUBE.copy()
    turned[4] = turned[4, ::-1]
    message = r"^faces\[\d+\] = .*; expected its edge \[\d, \d\] .*faces \[.*\b4\b.*\] .*reverse"
    with pytest.raises(ValueError, match=message):
        bodies.from_mesh(CORNERS, turned, 1.0)


def test_a_face_that_is_there_twice_is_refused():
    with pytest.raises(ValueError, match=r"faces \[0, 12\]"):
        bodies.from_mesh(CORNERS, [*CUBE, CUBE[0]], 1.0)


def test_inside_out_is_refused():
    with pytest.raises(ValueError, match=r"^volume = -1.*inside out, pass faces\[:, ::-1\]"):
        bodies.from_mesh(CORNERS, CUBE[:, ::-1], 1.0)


@given(attitudes, st.floats(-1.0, 1.0))
def test_a_flat_mesh_is_refused(q, height):
    flat = CORNERS * [1.0, 2.0, 0.0] @ matrix(q).T
    with pytest.raises(ValueError, match="expected more than rounding"):
        bodies.from_mesh(flat, CUBE, 1.0)


def test_a_plate_that_is_thin_but_not_flat_to_rounding_is_taken():
    # 16 eps of its tetrahedra are a volume of 2.5e-15
    plate = bodies.from_mesh(CORNERS * [1.0, 1.0, 2e-14], CUBE, 1.0)
    assert plate.mass == pytest.approx(2e-14, rel=ROUNDING)


@pytest.mark.parametrize(
    ("vertices", "faces", "density", "message"),
    [
        (CORNERS[:, :2], CUBE, 1.0, "^vertices has shape"),
        (CORNERS[0], CUBE, 1.0, "^vertices has shape"),
        (CORNERS * np.nan, CUBE, 1.0, "^vertices.*finite"),
        (CORNERS, CUBE[:, :2], 1.0, "^faces has shape"),
        (CORNERS, CUBE[0], 1.0, "^faces has shape"),
        (CORNERS, np.zeros((0, 3)), 1.0, "^faces has shape"),
        (CORNERS, CUBE + 1, 1.0, r"^faces\[\d+, \d\] = 8.0; expected.*8 vertices, counted from 0"),
        (CORNERS, CUBE - 1, 1.0, r"^faces\[\d+, \d\] = -1.0; expected"),
        (CORNERS, CUBE + 0.5, 1.0, r"^faces\[0, 0\] = .*\.5; expected the index"),
        (CORNERS, [*CUBE, [1, 2, 1]], 1.0, r"^faces\[12\] = \[1, 2, 1\]; expected three different"),
        (CORNERS, CUBE, 0.0, "^density = 0.0; expected a positive"),
        (CORNERS, CUBE, None, "^density"),
    ],
)
def test_what_is_no_mesh_is_refused_by_name(vertices, faces, density, message):
    with pytest.raises(ValueError, match=message):
        bodies.from_mesh(vertices, faces, density)


def test_the_volume_is_exact_for_corners_of_small_integers():
    assert bodies.from_mesh(2.0 * CORNERS, CUBE, 1.0).mass == pytest.approx(8.0, rel=2 * EPS)
