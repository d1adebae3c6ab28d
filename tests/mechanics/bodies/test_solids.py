"""Solids, points and named bodies against references; what they refuse."""

import inspect

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from rigid_envs.mechanics import bodies
from rigid_envs.mechanics.bodies.body import Body
from tests.mechanics.attitudes import EPS, quaternions
from tests.mechanics.bodies.examples import ROUNDING, any_body, points, sizes
from tests.reference import cases, every
from tests.refusals import NO_SCALARS, refusal, refuses

# Solids, points and what is composed of them, against references; what they refuse.


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


def solid(case):
    constructor, names = SOLIDS[case["in"]["solid"]]
    return constructor(case["in"]["mass"], *[case["in"]["params"][name] for name in names.split()])


def assert_tensor(found, expected):
    scale = np.max(np.abs(expected))
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUNDING * scale)


def assert_agrees(body, out):
    """Mass, centre, tensor, moments and kind are those of the reference, as far as it has them."""
    assert body.mass == pytest.approx(out.get("mass", body.mass), rel=ROUNDING)
    assert_tensor(body.com, out["com"])
    assert_tensor(body.inertia, out["I_com"])
    assert_tensor(body.principal().moments, out.get("principal", body.principal().moments))
    assert body.kind() == out.get("class", body.kind())


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


@every(cases("inertia_solid"))
def test_solids(case):
    body, out = solid(case), case["out"]
    assert body.mass == case["in"]["mass"]
    assert_agrees(body, out)
    flat = abs(bodies.perpendicular_axis(body)) <= ROUNDING * max(out["principal"])
    assert flat == (case["in"]["solid"] in FLAT_CASES)


@every(cases("inertia_solid"))
def test_solids_about_another_point_another_axis_and_turned(case):
    body, out = solid(case), case["out"]
    point = body.com + case["in"]["d"]  # the data count d from the centre of mass
    assert_tensor(body.about(point), out["I_about_point"])
    moment = body.about_axis(point, case["in"]["n"])
    assert moment == pytest.approx(out["I_axis_through_point"], rel=ROUNDING)
    assert_tensor(body.rotated(case["in"]["q"]).inertia, out["I_com_rotated"])


@every(cases("inertia_cone_apex"))
def test_cone_about_its_apex(case):
    params = case["in"]["params"]
    cone = bodies.cone(case["in"]["mass"], params["r"], params["h"])
    assert_tensor(cone.about([0.0, 0.0, 0.0]), case["out"]["I_apex"])


@every(cases("inertia_t_handle"))
def test_t_handle(case):
    names = "crossbar_radius crossbar_length_x stem_radius stem_length_y density".split()
    assert_agrees(bodies.t_handle(*[case["in"][name] for name in names]), case["out"])


@every(cases("inertia_triangle_lamina"))
def test_triangular_lamina(case):
    body = bodies.triangular_lamina(case["in"]["mass"], case["in"]["vertices"])
    assert_agrees(body, case["out"])
    residual = case["out"]["perpendicular_axis_residual"]
    assert abs(bodies.perpendicular_axis(body) - residual) <= ROUNDING * body.inertia[2, 2]


@every(cases("inertia_tetrahedron"))
def test_tetrahedron(case):
    body = bodies.tetrahedron(case["in"]["mass"], case["in"]["vertices"])
    assert_agrees(body, case["out"])


@every(cases("inertia_mesh"))
def test_mesh(case):
    body = bodies.from_mesh(case["in"]["vertices"], case["in"]["faces"], case["in"]["density"])
    # The corners are rounded to 16 digits: so is the box of which the answers are
    assert_agrees(body, case["out"])


@every(cases("inertia_points"))
def test_points(case):
    body, out = bodies.point_masses(case["in"]["masses"], case["in"]["positions"]), case["out"]
    assert body.mass == pytest.approx(out["mass"], rel=EPS * 4)
    assert_agrees(body, out)
    assert_tensor(body.about([0.0, 0.0, 0.0]), out["I_origin"])
    assert_tensor(body.principal().moments, out["principal_com"])
    assert_same_axes(body, out["principal_axes_rows_up_to_sign"], out["principal_com"])


@every(cases("principal_axes"))
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
@given(q=quaternions, d=points)
def test_flat_bodies_keep_the_perpendicular_axis_theorem_in_any_pose(name, q, d):
    body = getattr(bodies, name)(*OF_NUMBERS[name]).rotated(q).translated(d)
    assert abs(bodies.perpendicular_axis(body)) <= ROUNDING * body.principal().moments[2]


@given(sizes, sizes, sizes, quaternions)
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
    refuses(r"^minor_radius = 2.0; .*major_radius = 1.0 \[m\]: swap", bodies.torus, 1.0, 1.0, 2.0)


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
    refuses(f"^{message}", make)


@pytest.mark.parametrize("size", [1.1e100, 1e200, 1e308])
def test_lengths_whose_squares_overflow_are_refused(size):
    for name, good in OF_NUMBERS.items():
        for i, parameter in enumerate(inspect.signature(getattr(bodies, name)).parameters):
            if parameter not in {"mass", "density"}:
                with pytest.raises(ValueError, match=r"^\w+ = .*; expected"):
                    getattr(bodies, name)(*good[:i], size, *good[i + 1 :])


def test_a_length_may_be_as_large_as_a_refusal_says():
    refuses(r"radius = 2e\+100; .* at most 1e\+100 m", bodies.solid_sphere, 1.0, 2e100)
    assert bodies.solid_sphere(1.0, 1e100).inertia[0, 0] == 0.4e200


SIZE = 2.0 * np.sqrt(3.0)
poses = st.tuples(any_body, quaternions, points)


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
    refuses(rf"(?s)^{name}\b.*expected", bodies.point_masses, masses, positions)


def test_a_mass_that_is_not_positive_is_refused_by_index():
    with pytest.raises(ValueError, match=r"^masses\[1\] = 0.0; expected positive masses"):
        bodies.point_masses([1.0, 0.0], np.eye(3)[:2])


def test_corners_without_an_area_or_a_volume_are_refused():
    line = [[0.0, 0.0, 1.0], [1.0, 2.0, 4.0], [2.0, 4.0, 7.0]]
    refuses(r"^vertices = .*not in line: move one", bodies.triangular_lamina, 1.0, line)
    with pytest.raises(ValueError, match=r"^vertices = .*not in a plane: move one"):
        bodies.tetrahedron(1.0, [*line, [0.0, 1.0, 0.0]])
    for make, shape in ((bodies.triangular_lamina, (3, 2)), (bodies.tetrahedron, (3, 3))):
        refuses(r"^vertices has shape", make, 1.0, np.zeros(shape))
        with pytest.raises(ValueError, match=r"^mass = -1\.0"):
            make(-1.0, np.vstack([np.zeros(3), np.eye(3)])[: 3 + (make is bodies.tetrahedron)])


def test_parts_that_are_nowhere_are_refused_by_index():
    body = bodies.rod(1.0, 1.0)
    refuses(r"^parts = \[\]; expected one", bodies.compose, [])
    with pytest.raises(ValueError, match=r"^parts\[1\]\.attitude has shape \(2,\)"):
        bodies.compose([(body, UPRIGHT, ORIGIN), (body, [1.0, 0.0], ORIGIN)])
    with pytest.raises(ValueError, match=r"^parts\[0\]\.position has shape \(2,\)"):
        bodies.compose([(body, UPRIGHT, [1.0, 0.0])])


# Named bodies against published numbers and against what they are known to do.


NAMED = ["american_football", "book", "coin", "earth", "frisbee", "t_handle", "tennis_racket"]


def growth(body, axis):
    """Largest real part of the rates at which a unit spin about a principal axis is left [1/s]."""
    h = 2.0**-10  # the acceleration is quadratic in omega: its central difference is exact
    ahead, behind = (body.angular_acceleration(axis + s * h * np.eye(3)) for s in (1, -1))
    return float(np.max(np.linalg.eigvals((ahead - behind).T / (2 * h)).real))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("american_football", "symmetric_prolate"),
        ("book", "asymmetric"),
        ("coin", "symmetric_oblate"),
        ("earth", "symmetric_oblate"),
        ("frisbee", "symmetric_oblate"),
        ("t_handle", "asymmetric"),
        ("tennis_racket", "asymmetric"),
    ],
)
def test_named_bodies_are_of_their_kind(name, kind):
    assert getattr(bodies, name)().kind() == kind


@pytest.mark.parametrize("name", ["book", "t_handle", "tennis_racket"])
def test_only_a_spin_about_the_intermediate_axis_is_left(name):
    body = getattr(bodies, name)()
    rates = [growth(body, axis) for axis in body.principal().axes.T]
    assert rates[1] > 0.1 and rates[0] < 1e-6 and rates[2] < 1e-6


def test_the_t_handle_turns_over_when_spun_about_its_stem():
    handle = bodies.t_handle()
    assert np.array_equal(np.abs(handle.principal().axes[:, 1]), [0, 1, 0])
    assert handle.com[0] == handle.com[2] == 0.0 < handle.com[1]
    long_stem = bodies.t_handle(stem_length=0.2)
    assert np.array_equal(np.abs(long_stem.principal().axes[:, 0]), [0, 1, 0])


def test_the_t_handle_is_of_aluminium_and_fits_a_hand():
    handle = bodies.t_handle()
    crossbar, stem = (2700.0 * np.pi * 0.006**2 * length for length in (0.1, 0.06))
    assert handle.mass == pytest.approx(crossbar + stem, rel=ROUNDING)
    assert handle.mass * handle.com[1] == pytest.approx(stem * (0.006 + 0.03), rel=4 * ROUNDING)


def test_the_racket_balances_and_swings_like_those_that_are_measured():
    racket = bodies.tennis_racket()
    assert racket.mass == pytest.approx(0.32, rel=ROUNDING)
    assert racket.com[1] == pytest.approx(0.33, abs=0.005)
    assert racket.about_axis([0.0, 0.1, 0.0], [1.0, 0.0, 0.0]) == pytest.approx(0.030, abs=5e-4)
    assert racket.inertia[1, 1] == pytest.approx(0.0013, abs=5e-5)
    assert 0.022 < racket.about_axis([0.0, 0.1, 0.0], [1.0, 0.0, 0.0]) < 0.038  # Spurr et al.
    assert abs(bodies.perpendicular_axis(racket)) <= ROUNDING * racket.inertia[2, 2]
    assert np.array_equal(np.abs(racket.principal().axes[:, 1]), [1, 0, 0])


def test_the_football_is_a_uniform_skin():
    ball, a, c = bodies.american_football(), 0.5366 / (2 * np.pi), 0.1413

    def over_the_skin(f):  # adaptive quadrature in z, another variable than that of the hoops
        def ring(z):
            rho = a * np.sqrt(1.0 - (z / c) ** 2)
            return f(rho, z) * np.hypot(rho, a**2 * z / c**2)

        return quad(ring, -c, c, epsabs=0.0, epsrel=1e-12)[0]

    area = over_the_skin(lambda rho, z: 1.0)
    axial = ball.mass / area * over_the_skin(lambda rho, z: rho**2)
    across = ball.mass / area * over_the_skin(lambda rho, z: 0.5 * rho**2 + z**2)
    np.testing.assert_allclose(np.diag(ball.inertia), [across, across, axial], rtol=1e-12)
    np.testing.assert_allclose(ball.com, 0.0, atol=ROUNDING)
    assert ball.mass == pytest.approx(0.411, rel=ROUNDING)


def test_book_and_coin_have_the_sizes_that_they_are_described_by():
    book, coin = bodies.book(), bodies.coin()
    # A box has I_x = m (b^2 + c^2) / 12, so I_y + I_z - I_x = m a^2 / 6; the thinnest side is left
    # of differences of the squares of others, 64 times its own
    moments = np.diag(book.inertia)
    sides = np.sqrt(6.0 * (moments.sum() - 2.0 * moments) / book.mass)
    np.testing.assert_allclose([book.mass, *sides], [0.9, 0.16, 0.24, 0.03], rtol=64 * ROUNDING)
    # A cylinder has C = m r^2 / 2 and A = C / 2 + m h^2 / 12
    A, _, C = np.diag(coin.inertia)
    width, height = 2.0 * np.sqrt(2.0 * C / coin.mass), np.sqrt((12.0 * A - 6.0 * C) / coin.mass)
    # the height is left of a difference of its size: (r / h)^2 = 25 roundings
    np.testing.assert_allclose(
        [coin.mass, width, height], [0.0075, 0.02325, 0.00233], rtol=25 * ROUNDING
    )


def test_the_frisbee_has_the_mass_of_the_rules_and_its_measured_moments():
    disk = bodies.frisbee()
    assert disk.mass == 0.175
    np.testing.assert_allclose(np.diag(disk.inertia), [1.219e-3, 1.219e-3, 2.352e-3], rtol=ROUNDING)


def test_the_frisbee_is_nearly_flat():
    disk = bodies.frisbee()
    thickness = np.sqrt(-0.5 * bodies.perpendicular_axis(disk) / disk.mass)
    assert 0.01 < thickness < 0.03  # [m] rms: a disk for Ultimate is some 3 cm deep


def test_the_earth_has_its_published_moments():
    earth = bodies.earth()
    A, _, C = np.diag(earth.inertia)
    # Groten, J. Geodesy 77 (2004) 724: A = 8.0101, B = 8.0103, C = 8.0365 (2) in 1e37 kg m^2, of a
    # mass of 5.9737e24 kg by an older constant of gravitation, 2.5e-4 more than ours
    np.testing.assert_allclose([A, C], [8.0102e37, 8.0365e37], rtol=4e-4)
    assert C / (earth.mass * 6378136.6**2) == pytest.approx(0.330698, abs=1e-6)
    assert (C - A) / C == pytest.approx(3273795e-9, rel=1e-12)
    assert A / (C - A) == pytest.approx(304.456, abs=1e-3)


@every(cases("chandler"))
def test_the_rate_of_the_pole_is_that_of_the_reference(case):
    A, C, spin = (case["in"][name] for name in ("Iperp", "I3", "w3"))
    acceleration = Body(1.0, np.diag([A, A, C])).angular_acceleration([1e-6 * spin, 0.0, spin])
    rate = acceleration[1] / (1e-6 * spin)
    # C - A cancels: eps C / (C - A)
    assert rate == pytest.approx(case["out"]["Omega"], rel=C / (C - A) * ROUNDING)


@pytest.mark.parametrize("name", NAMED)
def test_named_bodies_have_their_centre_where_they_say(name):
    com = getattr(bodies, name)().com
    if name in ("t_handle", "tennis_racket"):
        assert com[0] == com[2] == 0.0 < com[1]
    else:
        np.testing.assert_allclose(com, 0.0, atol=ROUNDING)
