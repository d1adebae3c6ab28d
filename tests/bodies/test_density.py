"""Bodies of varying density against closed forms, and against what is composed of parts."""

import math

import numpy as np
import pytest

from rigid_envs.mechanics import bodies
from rigid_envs.mechanics.bodies.densities import Region, from_density

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


def test_a_ball_that_is_denser_inside_has_its_closed_form():
    # rho = rho0 (1 - r / R): m = pi rho0 R^3 / 3, I = (8 pi / 3) rho0 R^5 / 30
    rho0, R = 900.0, 0.4
    ball = from_density(
        lambda r: rho0 * (1.0 - np.linalg.norm(r, axis=1) / R), Region.ellipsoid(R, R, R)
    )
    moment = 8.0 * np.pi / 90.0 * rho0 * R**5
    same(ball, bodies.Body(np.pi / 3.0 * rho0 * R**3, moment * np.eye(3)))


def test_a_gaussian_star_has_its_closed_form():
    # rho = exp(-r^2 / 2 s^2), out to 1e-22 of the middle: m = (2 pi)^1.5 s^3, I = 2 m s^2
    s = 0.3
    star = from_density(
        lambda r: np.exp(-0.5 * np.sum(r**2, axis=1) / s**2), Region.thick_shell(0.0, 10.0 * s)
    )
    m = (2.0 * np.pi) ** 1.5 * s**3
    same(star, bodies.Body(m, 2.0 * m * s**2 * np.eye(3)), 1e-10)


def test_a_linear_gradient_in_a_box_has_its_closed_form():
    # rho = c (1 + k x): com = k lx^2 / 12, and the moments about it lose m com^2
    lx, ly, lz, c, k = 0.6, 0.4, 0.9, 500.0, 2.5
    found = from_density(lambda r: c * (1.0 + k * r[:, 0]), Region.box(lx, ly, lz))
    box = bodies.box(c * lx * ly * lz, lx, ly, lz)
    com = k * lx**2 / 12.0
    inertia = box.inertia - box.mass * com**2 * np.diag([0.0, 1.0, 1.0])
    same(found, bodies.Body(box.mass, inertia, [com, 0.0, 0.0]))


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
                [
                    x[0] * np.sqrt(x[2]) * np.cos(x[1]),
                    x[0] * np.sqrt(x[2]) * np.sin(x[1]),
                    x[2],
                ],
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
    def layers(r):
        return np.where(np.linalg.norm(r, axis=1) < 0.3, 8000.0, 1000.0)

    with pytest.raises(
        ValueError, match=r"^change of the integrals .*; expected below 1e-10 .*jump"
    ):
        from_density(layers, Region.ellipsoid(0.5, 0.5, 0.5))
    pose = np.eye(3), np.zeros(3)
    shell, core = Region.thick_shell(0.3, 0.5), Region.thick_shell(0.0, 0.3)
    parts = bodies.compose([(from_density(layers, part), *pose) for part in (core, shell)])
    inner, outer = 4 / 3 * np.pi * 8000 * 0.3**3, 4 / 3 * np.pi * 1000 * (0.5**3 - 0.3**3)
    layered = [bodies.solid_sphere(inner, 0.3), bodies.thick_shell(outer, 0.3, 0.5)]
    same(parts, bodies.compose([(part, *pose) for part in layered]))


CUBE = Region.box(1.0, 1.0, 1.0)


def test_a_region_may_be_empty_in_parts():
    # x^10 for x > 0, and for x < 0 nothing: in a box of sides 1, m = (1/2)^11 / 11, and so on
    found = from_density(lambda r: np.maximum(r[:, 0], 0.0) ** 10, CUBE)
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
    with pytest.raises(ValueError, match=message):
        from_density(density, CUBE)


def test_nodes_are_doubled_from_8_to_64_along_each_side():
    counts = []

    def jump(r):
        counts.append(len(r))
        return np.where(r[:, 0] < 0.1, 1.0, 2.0)

    with pytest.raises(ValueError, match="with 64 nodes along each side"):
        from_density(jump, CUBE)
    assert counts == [8**3, 16**3, 32**3, 64**3]


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_a_centre_that_has_not_converged_is_refused_whatever_the_unit_of_mass(scale):
    # The jump is odd: it moves the centre by 1e-4 of a side, of which 64 nodes miss about 1e-4,
    # far more than 1e-10; no node sees it in the mass, and the moments about the centre lose the
    # square of its place, of which as much is missed: 1e-12
    with pytest.raises(ValueError, match=r"^change of the integrals of the density"):
        from_density(lambda r: scale * (1.0 + 1e-4 * np.sign(r[:, 0])), CUBE)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_moments_that_have_not_converged_are_refused_whatever_the_unit_of_mass(scale):
    # What the layer across x adds to the mass, the one across y takes away, and both are even: mass
    # and centre are those of the cube. Moments about x and y change by 2e-6 from 32 to 64 nodes
    def layers(r):
        x, y, _ = np.abs(r.T)
        return scale * (1.0 + 1e-3 * (1.0 * (x < 0.3) - 1.0 * (y < 0.3)))

    with pytest.raises(ValueError, match=r"^change of the integrals of the density"):
        from_density(layers, CUBE)


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
        with pytest.raises(ValueError, match=message):
            make()
