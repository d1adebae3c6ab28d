"""Polyhedra and varying densities against closed forms and sums of parts; what they refuse."""

import itertools
import math
import re

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay

from rigid_envs.mechanics import bodies
from rigid_envs.mechanics.bodies.densities import Region, from_density
from tests.mechanics.attitudes import EPS, quaternions
from tests.mechanics.bodies.examples import ROUNDING, assert_same_body, matrix, points, sizes
from tests.refusals import refuses

CORNERS = np.array(list(itertools.product([-0.5, 0.5], repeat=3)))


def hull(vertices):
    """The faces of the convex hull, counter-clockwise seen from outside."""
    surface = ConvexHull(vertices)
    a, b, c = np.moveaxis(vertices[surface.simplices], 1, 0)
    inwards = np.sum(np.cross(b - a, c - a) * surface.equations[:, :3], axis=1) < 0.0
    return np.where(inwards[:, None], surface.simplices[:, ::-1], surface.simplices)


CUBE = hull(CORNERS)


# What is inside
@given(sizes, sizes, sizes, sizes, quaternions, points)
def test_the_mesh_of_a_box_is_the_box(density, lx, ly, lz, q, d):
    mesh = bodies.from_mesh(CORNERS * [lx, ly, lz] @ matrix(q).T + d, CUBE, density)
    box = bodies.box(density * lx * ly * lz, lx, ly, lz).rotated(q).translated(d)
    # A corner is rounded by 1e-16 of its largest coordinate, which the thinnest side feels most
    thin = (1.0 + max(lx, ly, lz)) / min(lx, ly, lz)
    assert abs(mesh.mass / box.mass - 1.0) <= thin * ROUNDING
    scale = thin * ROUNDING * np.max(box.inertia)
    np.testing.assert_allclose(mesh.inertia, box.inertia, rtol=0, atol=scale)
    np.testing.assert_allclose(mesh.com, box.com, rtol=0, atol=thin * ROUNDING * thin)


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
    refuses(message, bodies.from_mesh, CORNERS, turned, 1.0)


def test_a_face_that_is_there_twice_is_refused():
    refuses(r"faces \[0, 12\]", bodies.from_mesh, CORNERS, [*CUBE, CUBE[0]], 1.0)


def test_inside_out_is_refused():
    with pytest.raises(ValueError, match=r"^volume = -1.*inside out, pass faces\[:, ::-1\]"):
        bodies.from_mesh(CORNERS, CUBE[:, ::-1], 1.0)


@given(quaternions, st.floats(-1.0, 1.0))
def test_a_flat_mesh_is_refused(q, height):
    flat = CORNERS * [1.0, 2.0, 0.0] @ matrix(q).T
    refuses("expected more than rounding", bodies.from_mesh, flat, CUBE, 1.0)
    refuses("expected more than rounding", bodies.from_mesh, 0.0 * CORNERS, CUBE, 1.0)


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
    refuses(message, bodies.from_mesh, vertices, faces, density)


def test_the_volume_is_exact_for_corners_of_small_integers():
    assert bodies.from_mesh(2.0 * CORNERS, CUBE, 1.0).mass == pytest.approx(8.0, rel=2 * EPS)


TOLERANCE = 1e-12  # the quadrature has converged beyond 1e-10; sums of 32^3 roundings are left
SOLIDS = {
    "box": (Region.box(0.3, 0.5, 0.7), 0.105, lambda m: bodies.box(m, 0.3, 0.5, 0.7)),
    "ball": (
        Region.ellipsoid(0.4, 0.4, 0.4),
        4 / 3 * np.pi * 0.4**3,
        lambda m: bodies.solid_sphere(m, 0.4),
    ),
    "ellipsoid": (
        Region.ellipsoid(0.4, 0.6, 0.9),
        4 / 3 * np.pi * 0.216,
        lambda m: bodies.ellipsoid(m, 0.4, 0.6, 0.9),
    ),
    "shell": (
        Region.thick_shell(0.3, 0.5),
        4 / 3 * np.pi * (0.5**3 - 0.3**3),
        lambda m: bodies.thick_shell(m, 0.3, 0.5),
    ),
    "hemisphere": (
        Region.hemisphere(0.6),
        2 / 3 * np.pi * 0.6**3,
        lambda m: bodies.hemisphere(m, 0.6),
    ),
    "tube": (
        Region.cylinder(0.2, 0.5, 0.8),
        np.pi * 0.21 * 0.8,
        lambda m: bodies.hollow_cylinder(m, 0.2, 0.5, 0.8),
    ),
    "cone": (Region.cone(0.4, 1.1), np.pi / 3 * 0.16 * 1.1, lambda m: bodies.cone(m, 0.4, 1.1)),
    "torus": (
        Region.torus(0.7, 0.2),
        2 * np.pi**2 * 0.7 * 0.04,
        lambda m: bodies.torus(m, 0.7, 0.2),
    ),
}


def same(found, expected, tolerance=TOLERANCE):
    scale = np.max(np.abs(expected.inertia))
    assert found.mass == pytest.approx(expected.mass, rel=tolerance)
    np.testing.assert_allclose(found.inertia, expected.inertia, rtol=0, atol=tolerance * scale)
    length = math.sqrt(scale / expected.mass)
    np.testing.assert_allclose(found.com, expected.com, rtol=0, atol=tolerance * length)


@pytest.mark.parametrize(("region", "volume", "solid"), SOLIDS.values(), ids=SOLIDS)
def test_a_constant_density_gives_the_homogeneous_solid(region, volume, solid):
    same(from_density(lambda r: 700.0, region), solid(700.0 * volume))
    same(from_density(lambda r: np.full(len(r), 700.0), region), solid(700.0 * volume))


def test_products_of_inertia_follow_a_density_without_symmetry():
    # rho = 1 + x y in the cube of side 2 about the origin: int x y rho = (2 / 3)^2 2
    found = from_density(lambda r: 1.0 + r[:, 0] * r[:, 1], Region.box(2.0, 2.0, 2.0))
    expected = np.diag([16.0, 16.0, 16.0]) / 3.0
    expected[0, 1] = expected[1, 0] = -8.0 / 9.0
    same(found, bodies.Body(8.0, expected))


def test_a_region_of_ones_own_is_its_coordinates_and_their_volume():
    # The paraboloid z = x^2 + y^2 up to z = 1: volume pi / 2, com 2/3, I_z = m / 3.
    bowl = Region(
        ((0.0, 1.0), (0.0, 2.0 * np.pi), (0.0, 1.0)),
        lambda x: (
            np.stack(
                [x[0] * np.sqrt(x[2]) * np.cos(x[1]), x[0] * np.sqrt(x[2]) * np.sin(x[1]), x[2]],
                axis=-1,
            ),
            x[0] * x[2],
        ),
    )
    found = from_density(lambda r: 3.0, bowl)
    assert found.mass == pytest.approx(1.5 * np.pi, rel=TOLERANCE)
    assert found.com[2] == pytest.approx(2.0 / 3.0, rel=TOLERANCE)
    assert found.inertia[2, 2] == pytest.approx(found.mass / 3.0, rel=TOLERANCE)


def test_a_density_that_jumps_is_refused_and_composed_of_its_layers():
    asked = []

    def layers(r):
        asked.append(len(r))
        return np.where(np.linalg.norm(r, axis=1) < 0.3, 8000.0, 1000.0)

    with pytest.raises(
        ValueError, match=r"^change of the integrals .*; expected below 1e-10 .*jump"
    ):
        from_density(layers, Region.ellipsoid(0.5, 0.5, 0.5))
    assert asked == [8**3, 16**3, 32**3, 64**3]
    pose = np.eye(3), np.zeros(3)
    shell, core = Region.thick_shell(0.3, 0.5), Region.thick_shell(0.0, 0.3)
    parts = bodies.compose([(from_density(layers, part), *pose) for part in (core, shell)])
    inner, outer = 4 / 3 * np.pi * 8000 * 0.3**3, 4 / 3 * np.pi * 1000 * (0.5**3 - 0.3**3)
    layered = [bodies.solid_sphere(inner, 0.3), bodies.thick_shell(outer, 0.3, 0.5)]
    same(parts, bodies.compose([(part, *pose) for part in layered]))


UNIT_CUBE = Region.box(1.0, 1.0, 1.0)


def test_a_region_may_be_empty_in_parts():
    # x^10 for x > 0, and for x < 0 nothing: in a box of sides 1, m = (1/2)^11 / 11, and so on
    found = from_density(lambda r: np.maximum(r[:, 0], 0.0) ** 10, UNIT_CUBE)
    np.testing.assert_allclose(found.mass, 0.5**11 / 11, rtol=1e-9)
    np.testing.assert_allclose(found.com, [0.5 * 11 / 12, 0.0, 0.0], rtol=1e-9, atol=1e-14)
    square = 0.25 * 11 / 13  # the mean of x^2, that of y^2 and of z^2 is 1/12
    about_com = square - (0.5 * 11 / 12) ** 2 + 1 / 12
    moments = found.mass * np.array([1 / 6, about_com, about_com])
    np.testing.assert_allclose(found.inertia, np.diag(moments), rtol=1e-8, atol=1e-15)


@pytest.mark.parametrize(
    ("density", "message"),
    [
        (700.0, r"^density = 700\.0; expected a function of points"),
        (lambda r: None, r"^density\(points\) = None; expected real numbers"),
        (lambda r: r, r"^density\(points\) has shape \(512, 3\); expected \(512,\)"),
        (lambda r: r[:, 0], r"^density\(points\)\[0\] = -0\.\d+; expected densities of at least 0"),
        (lambda r: 0.0, r"^density\(points\) = 0\.0; expected more than 0 somewhere"),
        (lambda r: np.nan, r"^density\(points\) = nan; expected finite"),
    ],
)
def test_densities_that_are_none_are_refused(density, message):
    refuses(message, from_density, density, UNIT_CUBE)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_a_centre_that_has_not_converged_is_refused_whatever_the_units(scale):
    # The jump is odd: it moves the centre by 1e-4 of a side, of which 64 nodes miss about 1e-4,
    # far more than 1e-10; no node sees it in the mass, and the moments about the centre lose the
    # square of its place, of which as much is missed: 1e-12
    with pytest.raises(ValueError, match=r"^change of the integrals of the density"):
        from_density(lambda r: scale * (1.0 + 1e-4 * np.sign(r[:, 0])), Region.box(*3 * [scale]))


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_moments_that_have_not_converged_are_refused_whatever_the_units(scale):
    # What the layer across x adds to the mass, the one across y takes away, and both are even: mass
    # and centre are those of the cube. Moments about x and y change by 2e-6 from 32 to 64 nodes
    def layers(r):
        x, y, _ = np.abs(r.T) / scale
        return scale * (1.0 + 1e-3 * (1.0 * (x < 0.3) - 1.0 * (y < 0.3)))

    with pytest.raises(ValueError, match=r"^change of the integrals of the density"):
        from_density(layers, Region.box(*3 * [scale]))


def test_regions_without_volume_are_refused():
    for make, message in (
        (
            lambda: Region.thick_shell(0.5, 0.5),
            r"^inner_radius = 0\.5; expected below outer_radius",
        ),
        (lambda: Region.cylinder(0.5, 0.5, 1.0), r"^inner_radius = 0\.5; expected below"),
        (lambda: Region.box(1.0, 0.0, 1.0), r"^ly = 0\.0; expected a positive"),
        (lambda: Region.torus(0.2, 0.5), r"^minor_radius = 0\.5; expected at most major"),
    ):
        refuses(message, make)
    assert Region.torus(0.5, 0.5).sides[0] == (0.0, 0.5)  # without a hole
