"""Solids, shells and laminae as limits, parts and quadratures of each other; what they refuse."""

import inspect

import numpy as np
import pytest
from hypothesis import given

from rigid_envs.mechanics import bodies
from tests.bodies.examples import ROUNDING, assert_same_body, attitudes, points, sizes

UPRIGHT, ORIGIN = np.eye(3), np.zeros(3)
OVER = np.diag([1.0, -1.0, -1.0])  # a half turn about x
OF_NUMBERS = {
    "annulus": (2.0, 0.5, 1.0),
    "box": (2.0, 1.0, 2.0, 3.0),
    "capsule": (2.0, 1.0, 3.0),
    "cone": (2.0, 1.0, 3.0),
    "conical_shell": (2.0, 1.0, 3.0),
    "cylindrical_shell": (2.0, 1.0, 3.0),
    "disk": (2.0, 1.0),
    "ellipsoid": (2.0, 1.0, 2.0, 3.0),
    "elliptic_lamina": (2.0, 1.0, 2.0),
    "hemisphere": (2.0, 1.0),
    "hollow_cylinder": (2.0, 0.5, 1.0, 3.0),
    "hollow_sphere": (2.0, 1.0),
    "hoop": (2.0, 1.0),
    "rectangular_lamina": (2.0, 1.0, 2.0),
    "rod": (2.0, 1.0),
    "solid_cylinder": (2.0, 1.0, 3.0),
    "solid_sphere": (2.0, 1.0),
    "t_handle": (0.1, 2.0, 0.1, 1.0, 5.0),
    "thick_shell": (2.0, 0.5, 1.0),
    "torus": (2.0, 1.0, 0.3),
}
FLAT = ["annulus", "disk", "elliptic_lamina", "hoop", "rectangular_lamina", "rod"]


def stack(parts):
    """Bodies one over the other: (body, z)."""
    return bodies.compose([(body, UPRIGHT, [0.0, 0.0, z]) for body, z in parts])


# Limits: each formula meets another one


@given(sizes, sizes, sizes)
def test_limits_of_one_shape_are_another(m, r, h):
    for one, other in (
        (bodies.ellipsoid(m, r, r, r), bodies.solid_sphere(m, r)),
        (bodies.elliptic_lamina(m, r, r), bodies.disk(m, r)),
        (bodies.thick_shell(m, 0.0, r), bodies.solid_sphere(m, r)),
        (bodies.thick_shell(m, r * (1.0 - 1e-15), r), bodies.hollow_sphere(m, r)),
        (bodies.hollow_cylinder(m, r, r, h), bodies.cylindrical_shell(m, r, h)),
        (bodies.solid_cylinder(m, r, 1e-9 * r), bodies.disk(m, r)),
        (bodies.cylindrical_shell(m, r, 1e-9 * r), bodies.hoop(m, r)),
        (bodies.solid_cylinder(m, 1e-9 * h, h), bodies.rod(m, h)),
        (bodies.torus(m, r, 1e-9 * r), bodies.hoop(m, r)),
        (bodies.capsule(m, r, 1e-16 * r), bodies.solid_sphere(m, r)),
        (bodies.box(m, r, h, 1e-9 * min(r, h)), bodies.rectangular_lamina(m, r, h)),
    ):
        assert_same_body(one, other)


# Parts: a whole is made of pieces by Steiner's theorem


@given(sizes, sizes, sizes, sizes)
def test_two_half_boxes_are_a_box(m, lx, ly, lz):
    for axis, lengths in enumerate(np.array([lx, ly, lz]) / (np.ones((3, 3)) + np.eye(3))):
        half, shift = bodies.box(m / 2, *lengths), 0.5 * lengths[axis] * np.eye(3)[axis]
        whole = bodies.compose([(half, UPRIGHT, shift), (half, UPRIGHT, -shift)])
        assert_same_body(whole, bodies.box(m, lx, ly, lz))


@given(sizes, sizes)
def test_two_half_balls_are_a_ball(m, r):
    half = bodies.hemisphere(m / 2, r)
    ball = bodies.compose([(half, UPRIGHT, ORIGIN), (half, OVER, ORIGIN)])
    assert_same_body(ball, bodies.solid_sphere(m, r))


@given(sizes, sizes, sizes)
def test_a_cylinder_and_two_half_balls_of_its_density_are_a_capsule(density, r, ell):
    cylinder = bodies.solid_cylinder(density * np.pi * r**2 * ell, r, ell)
    half = bodies.hemisphere(density * 2 / 3 * np.pi * r**3, r)
    ends = [(half, UPRIGHT, [0, 0, ell / 2]), (half, OVER, [0, 0, -ell / 2])]
    whole = bodies.compose([(cylinder, UPRIGHT, ORIGIN), *ends])
    assert_same_body(whole, bodies.capsule(whole.mass, r, ell))


@given(sizes, sizes, sizes)
def test_what_fills_a_hole_makes_it_whole(m, r, h):
    inner, outer = r, 1.7 * r
    part = (inner / outer) ** 3
    ball = [(bodies.thick_shell(m * (1 - part), inner, outer), 0.0)]
    ball += [(bodies.solid_sphere(m * part, inner), 0.0)]
    assert_same_body(stack(ball), bodies.solid_sphere(m, outer))
    part = (inner / outer) ** 2
    tube = [(bodies.hollow_cylinder(m * (1 - part), inner, outer, h), 0.0)]
    tube += [(bodies.solid_cylinder(m * part, inner, h), 0.0)]
    assert_same_body(stack(tube), bodies.solid_cylinder(m, outer, h))
    plate = [(bodies.annulus(m * (1 - part), inner, outer), 0.0), (bodies.disk(m * part, inner), 0)]
    assert_same_body(stack(plate), bodies.disk(m, outer))


# Quadratures: Gauss's rule of n nodes is exact for polynomials of degree 2 n - 1


def slices(m, h, weight, piece):
    """Pieces at the nodes of a rule on 0 <= z <= h, of masses in proportion to weight(z)."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    z = 0.5 * h * (1.0 + nodes)
    masses = weights * weight(z)
    return stack([(piece(m * dm / masses.sum(), x), x) for dm, x in zip(masses, z, strict=True)])


@given(sizes, sizes, sizes)
def test_disks_and_hoops_of_growing_radius_are_cones(m, r, h):
    cone = slices(m, h, lambda z: z**2, lambda dm, z: bodies.disk(dm, r * z / h))
    assert_same_body(cone, bodies.cone(m, r, h))
    shell = slices(m, h, lambda z: z, lambda dm, z: bodies.hoop(dm, r * z / h))
    assert_same_body(shell, bodies.conical_shell(m, r, h))


@given(sizes, sizes)
def test_round_slices_of_falling_radius_are_half_a_ball_and_all_of_a_shell(m, r):
    half = slices(m, r, lambda z: r**2 - z**2, lambda dm, z: bodies.disk(dm, np.sqrt(r**2 - z**2)))
    assert_same_body(half, bodies.hemisphere(m, r))
    zone = slices(m / 2, r, np.ones_like, lambda dm, z: bodies.hoop(dm, np.sqrt(r**2 - z**2)))
    shell = bodies.compose([(zone, UPRIGHT, ORIGIN), (zone, OVER, ORIGIN)])
    assert_same_body(shell, bodies.hollow_sphere(m, r))  # Archimedes: equal zones, equal areas


@pytest.mark.parametrize("thickness", [0.3, 1.0])  # of a ring with a hole, of one that just closes
@given(sizes, sizes)
def test_hoops_around_the_section_of_a_ring_are_a_torus(thickness, m, r):
    # On a circle of r / sqrt(2) points have the second moments of the full section. Mass goes as
    # the distance x from the axis, so I_z as x^3: no even moment of the section beyond these.
    R, turn = r / thickness, 2 * np.pi * np.arange(8) / 8
    x, z = R + r * np.sqrt(0.5) * np.cos(turn), r * np.sqrt(0.5) * np.sin(turn)
    masses = m * x / x.sum()
    rings = stack([(bodies.hoop(*part), h) for *part, h in zip(masses, x, z, strict=True)])
    assert_same_body(rings, bodies.torus(m, R, r))


# Flat bodies


@pytest.mark.parametrize("name", FLAT)
@given(q=attitudes, d=points)
def test_flat_bodies_keep_the_perpendicular_axis_theorem_in_any_pose(name, q, d):
    body = getattr(bodies, name)(*OF_NUMBERS[name]).rotated(q).translated(d)
    assert abs(bodies.perpendicular_axis(body)) <= ROUNDING * body.principal().moments[2]


@given(sizes, sizes, sizes, attitudes)
def test_the_residual_of_other_bodies_is_minus_twice_what_their_thickness_adds(m, lx, ly, q):
    lz = 0.9 * min(lx, ly)
    residual = bodies.perpendicular_axis(bodies.box(m, lx, ly, lz).rotated(q))
    I3 = m * (lx**2 + ly**2) / 12
    assert residual == pytest.approx(-m * lz**2 / 6, abs=ROUNDING * I3)


# Refusals


REFUSALS = [
    pytest.param(name, good, i, parameter, id=f"{name}-{parameter}")
    for name, good in OF_NUMBERS.items()
    for i, parameter in enumerate(inspect.signature(getattr(bodies, name)).parameters)
]


def test_the_table_has_every_constructor_that_takes_numbers():
    mine = {*OF_NUMBERS, "Body", "InertiaEllipsoid", "Kind", "PrincipalAxes"}
    mine |= {"Region", "compose", "from_density", "from_mesh", "perpendicular_axis", "point_masses"}
    mine |= {"tetrahedron", "triangular_lamina"}
    mine |= {"american_football", "book", "coin", "earth", "frisbee", "tennis_racket"}
    assert mine == set(bodies.__all__)


@pytest.mark.parametrize(("name", "good", "i", "parameter"), REFUSALS)
def test_sizes_that_are_not_positive_numbers_are_refused_by_name(name, good, i, parameter):
    bad = [-1.0, np.nan, np.inf, "1", None, True, [1.0, 2.0], 1j]
    bad += [] if parameter == "inner_radius" else [0.0]
    for value in bad:
        with pytest.raises(ValueError, match=rf"(?s)^{parameter}\b.*expected"):
            getattr(bodies, name)(*good[:i], value, *good[i + 1 :])


def test_radii_in_the_wrong_order_are_refused():
    for name in ("annulus", "thick_shell"):
        with pytest.raises(ValueError, match=r"^inner_radius = 2.0; .*outer_radius = 1.0 \[m\]"):
            getattr(bodies, name)(1.0, 2.0, 1.0)
    with pytest.raises(ValueError, match=r"^inner_radius = 2.0; .*outer_radius = 1.0 \[m\]"):
        bodies.hollow_cylinder(1.0, 2.0, 1.0, 3.0)
    with pytest.raises(ValueError, match=r"^minor_radius = 2.0; .*major_radius = 1.0 \[m\]: swap"):
        bodies.torus(1.0, 1.0, 2.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: bodies.box(1.0, 1.0, 2.0, 0.0), "lz = 0.0; .* or for 0 a rectangular_lamina"),
        (lambda: bodies.solid_cylinder(1.0, 0.0, 1.0), "radius = 0.0; .* or for 0 a rod"),
        (lambda: bodies.solid_cylinder(1.0, 1.0, 0.0), "height = 0.0; .* or for 0 a disk"),
        (lambda: bodies.capsule(1.0, 1.0, 0.0), "length = 0.0; .* or for 0 a solid_sphere"),
        (lambda: bodies.torus(1.0, 1.0, 0.0), "minor_radius = 0.0; .* or for 0 a hoop"),
    ],
)
def test_a_length_of_0_is_refused_by_the_name_of_the_body_that_is_left(make, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        make()


@pytest.mark.parametrize("size", [1.1e100, 1e200, 1e308])
def test_lengths_whose_squares_overflow_are_refused(size):
    for name, good in OF_NUMBERS.items():
        for i, parameter in enumerate(inspect.signature(getattr(bodies, name)).parameters):
            if parameter not in {"mass", "density"}:
                with pytest.raises(ValueError, match=r"^\w+ = .*; expected"):
                    getattr(bodies, name)(*good[:i], size, *good[i + 1 :])
