"""Solids, points and what is composed of them, against references; what they refuse."""

import inspect
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_envs.mechanics import bodies
from tests.mechanics.bodies.examples import (
    EPS,
    ROUNDING,
    any_body,
    attitudes,
    points,
    sizes,
)
from tests.reference import cases
from tests.refusals import NO_SCALARS, refusal

SOLIDS = {  # the name in the data: the constructor, and the name of each parameter
    "annulus": (bodies.annulus, "r_in r_out"),
    "box": (bodies.box, "lx ly lz"),
    "capsule": (bodies.capsule, "r h"),
    "disc": (bodies.disk, "r"),
    "ellipsoid": (bodies.ellipsoid, "a b c"),
    "elliptic_lamina": (bodies.elliptic_lamina, "a b"),
    "hollow_cone_no_base": (bodies.conical_shell, "r h"),
    "hoop": (bodies.hoop, "r"),
    "rect_lamina": (bodies.rectangular_lamina, "lx ly"),
    "solid_cone": (bodies.cone, "r h"),
    "solid_cylinder": (bodies.solid_cylinder, "r h"),
    "solid_hemisphere": (bodies.hemisphere, "r"),
    "solid_sphere": (bodies.solid_sphere, "r"),
    "thick_hollow_cylinder": (bodies.hollow_cylinder, "r_in r_out h"),
    "thick_hollow_sphere": (bodies.thick_shell, "r_in r_out"),
    "thin_cylindrical_shell": (bodies.cylindrical_shell, "r h"),
    "thin_rod_z": (bodies.rod, "l"),
    "thin_spherical_shell": (bodies.hollow_sphere, "r"),
    "torus": (bodies.torus, "R r"),
}
FLAT_CASES = {"annulus", "disc", "elliptic_lamina", "hoop", "rect_lamina", "thin_rod_z"}


def every(kind):
    return pytest.mark.parametrize("case", cases(kind), ids=itemgetter("id"))


def solid(case):
    constructor, names = SOLIDS[case["in"]["solid"]]
    return constructor(case["in"]["mass"], *[case["in"]["params"][name] for name in names.split()])


def assert_tensor(found, expected):
    scale = np.max(np.abs(expected))
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUNDING * scale)


def assert_same_axes(body, rows, moments):
    """Eigenvectors of moments that are not repeated, up to sign, as well as their gaps allow."""
    axes = body.principal().axes
    for k in range(3):
        gap = np.min(np.abs(np.delete(moments, k) - moments[k])) / max(moments)
        if gap > 1e-9:
            sign = np.sign(axes[:, k] @ rows[k])
            np.testing.assert_allclose(axes[:, k] * sign, rows[k], rtol=0, atol=ROUNDING / gap)


def test_every_solid_of_the_data_has_a_constructor():
    assert {case["in"]["solid"] for case in cases("inertia_solid")} == set(SOLIDS)


@every("inertia_solid")
def test_solids(case):
    body, out = solid(case), case["out"]
    assert body.mass == case["in"]["mass"]
    assert_tensor(body.com, out["com"])
    assert_tensor(body.inertia, out["I_com"])
    assert_tensor(body.principal().moments, out["principal"])
    assert body.kind() == out["class"]
    flat = abs(bodies.perpendicular_axis(body)) <= ROUNDING * max(out["principal"])
    assert flat == (case["in"]["solid"] in FLAT_CASES)


@every("inertia_solid")
def test_solids_about_another_point_another_axis_and_turned(case):
    body, out = solid(case), case["out"]
    point = body.com + case["in"]["d"]  # the data count d from the centre of mass
    assert_tensor(body.about(point), out["I_about_point"])
    moment = body.about_axis(point, case["in"]["n"])
    assert moment == pytest.approx(out["I_axis_through_point"], rel=ROUNDING)
    assert_tensor(body.rotated(case["in"]["q"]).inertia, out["I_com_rotated"])


@every("inertia_cone_apex")
def test_cone_about_its_apex(case):
    params = case["in"]["params"]
    cone = bodies.cone(case["in"]["mass"], params["r"], params["h"])
    assert_tensor(cone.about([0.0, 0.0, 0.0]), case["out"]["I_apex"])


@every("inertia_t_handle")
def test_t_handle(case):
    names = "crossbar_radius crossbar_length_x stem_radius stem_length_y density".split()
    body, out = bodies.t_handle(*[case["in"][name] for name in names]), case["out"]
    assert body.mass == pytest.approx(out["mass"], rel=ROUNDING)
    assert_tensor(body.com, out["com"])
    assert_tensor(body.inertia, out["I_com"])
    assert_tensor(body.principal().moments, out["principal"])
    assert body.kind() == out["class"]


@every("inertia_triangle_lamina")
def test_triangular_lamina(case):
    body = bodies.triangular_lamina(case["in"]["mass"], case["in"]["vertices"])
    assert_tensor(body.com, case["out"]["com"])
    assert_tensor(body.inertia, case["out"]["I_com"])
    residual = case["out"]["perpendicular_axis_residual"]
    assert abs(bodies.perpendicular_axis(body) - residual) <= ROUNDING * body.inertia[2, 2]


@every("inertia_tetrahedron")
def test_tetrahedron(case):
    body = bodies.tetrahedron(case["in"]["mass"], case["in"]["vertices"])
    assert_tensor(body.com, case["out"]["com"])
    assert_tensor(body.inertia, case["out"]["I_com"])
    assert_tensor(body.principal().moments, case["out"]["principal"])


@every("inertia_mesh")
def test_mesh(case):
    body = bodies.from_mesh(case["in"]["vertices"], case["in"]["faces"], case["in"]["density"])
    # The corners are rounded to 16 digits: so is the box of which the answers are
    assert body.mass == pytest.approx(case["out"]["mass"], rel=ROUNDING)
    assert_tensor(body.com, case["out"]["com"])
    assert_tensor(body.inertia, case["out"]["I_com"])


@every("inertia_points")
def test_points(case):
    body, out = bodies.point_masses(case["in"]["masses"], case["in"]["positions"]), case["out"]
    assert body.mass == pytest.approx(out["mass"], rel=EPS * 4)
    assert_tensor(body.com, out["com"])
    assert_tensor(body.inertia, out["I_com"])
    assert_tensor(body.about([0.0, 0.0, 0.0]), out["I_origin"])
    assert_tensor(body.principal().moments, out["principal_com"])
    assert body.kind() == out["class"]
    assert_same_axes(body, out["principal_axes_rows_up_to_sign"], out["principal_com"])


@every("principal_axes")
def test_principal_axes_ellipsoid_and_dynamics(case):
    body, out = bodies.Body(1.0, case["in"]["I"]), case["out"]
    omega, tau = case["in"]["w"], case["in"]["tau"]
    assert_tensor(body.principal().moments, out["principal"])
    assert body.kind() == out["class"]
    assert_same_axes(body, out["axes_rows_up_to_sign_and_degeneracy"], out["principal"])
    assert_tensor(body.inertia_ellipsoid().semi_axes, out["ellipsoid_semi_axes"])
    assert_tensor(body.angular_momentum(omega), out["L"])
    assert body.kinetic_energy(omega) == pytest.approx(out["kinetic_energy"], rel=ROUNDING)
    lost = out["principal"][2] / out["principal"][0] * ROUNDING * max(map(abs, out["wdot"]))
    found = body.angular_acceleration(omega, tau)  # the tensor is inverted
    np.testing.assert_allclose(found, out["wdot"], rtol=0, atol=lost)


UPRIGHT, ORIGIN = np.eye(3), np.zeros(3)
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
    for bad in [*NO_SCALARS, -1.0, *([] if parameter == "inner_radius" else [0.0])]:
        text = refusal(getattr(bodies, name), *good[:i], bad, *good[i + 1 :])
        assert text.startswith(f"{parameter} = "), text


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


SIZE = 2.0 * np.sqrt(3.0)
poses = st.tuples(any_body, attitudes, points)


def test_points_far_away_keep_their_inertia():
    masses, x = [1.0, 2.0, 3.0, 4.0], np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3.0]])
    near, far = bodies.point_masses(masses, x), bodies.point_masses(masses, x + 2.0**30)
    # The centre of mass is rounded by 2^30 eps, the tensor about it by the square of that
    np.testing.assert_allclose(far.inertia, near.inertia, rtol=0, atol=1e-12)
    np.testing.assert_allclose(far.com - 2.0**30, near.com, rtol=0, atol=2.0**30 * EPS)


def test_points_at_one_place_have_no_inertia_wherever_it_is():
    body = bodies.point_masses([0.1, 0.2, 0.7, 0.3], [[1e8 / 3, 0.1, -3.3]] * 4)
    assert np.array_equal(body.inertia, np.zeros((3, 3)))


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
