"""Reference cases: inertia of solids, laminae, meshes and points, principal axes, dynamics.

Inputs are the exact doubles, and the answers are sums of products without cancellation, so that a
few dozen roundings of the largest entry (`ROUNDING`) are all that may differ.
"""

from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.mechanics import bodies
from tests.bodies.examples import EPS, ROUNDING
from tests.reference import cases

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
FLAT = {"annulus", "disc", "elliptic_lamina", "hoop", "rect_lamina", "thin_rod_z"}


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
    assert flat == (case["in"]["solid"] in FLAT)


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
