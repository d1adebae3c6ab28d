"""Which parameters a body can have: moments about a pivot, rims, and the ends g = 0 and ell = 0."""

import math

import numpy as np
import pytest

from rigid_envs.mechanics import bodies, rotations
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.upright_coin.system import UprightCoin

EPS = np.finfo(np.float64).eps
CALM = {"q": rotations.exp([0.4, -0.3, 0.2]), "omega_body": [0.7, -0.4, 1.1]}


def about_its_end(body, ell, g=9.81):
    """The top that is this body with its pivot at the distance ell below the centre of mass."""
    I1, I2, I3 = np.diag(body.about(body.com - [0.0, 0.0, ell])).tolist()
    return HeavyTop(I1, I2, I3, body.mass, g, ell)


def test_moments_about_the_pivot_that_leave_none_about_the_centre_of_mass_are_refused():
    for I1, I2, I3, m, ell in [
        (1.0, 1.0, 0.5, 1.0, 2.0),  # I1 - m ell^2 = -3
        (1.0, 1.0, 0.5, 1.0, 0.9),  # 0.19, 0.19, 0.5: no triangle
        (2.0, 1.0, 1.0, 1.0, 1.1),  # 0.79, -0.21, 1.0
    ]:
        longest = math.sqrt((I1 + I2 - I3) / (2.0 * m))
        message = rf"^ell = {ell}; expected at most sqrt.* = {longest:.9g} m: .* about the pivot"
        with pytest.raises(ValueError, match=message):
            HeavyTop(I1, I2, I3, m, ell=ell)
    with pytest.raises(ValueError, match=r"^ell = 1e\+200; expected at most"):
        HeavyTop(ell=1e200)


@pytest.mark.parametrize("m", [1e-9, 0.7, 1e6])
def test_every_body_is_accepted_at_every_distance_also_a_lamina_and_a_thin_rod(m):
    rng = np.random.default_rng(0)
    for ell in (0.0, 1e-6, 0.3, 1e3):  # far away the moments of the body are lost in rounding
        about_its_end(bodies.disk(m, 0.2), ell)
        about_its_end(bodies.elliptic_lamina(m, 0.2, 0.5), ell)
        about_its_end(bodies.solid_cylinder(m, 1e-4, 0.6), ell)
        for _ in range(50):
            r = rng.normal(size=(5, 3))
            cloud = bodies.point_masses(np.full(5, m / 5.0), r - r.mean(axis=0))
            about_its_end(bodies.Body(m, np.diag(cloud.principal().moments)), ell)


def test_points_along_and_across_the_axis_show_that_the_limit_is_sharp():
    # A ring around e3 at the height ell has exactly the largest I3 for its moments at the pivot.
    ring, ell = bodies.hoop(2.0, 0.5), 0.3
    top = about_its_end(ring, ell)
    assert top.I3 == pytest.approx(top.I1 + top.I2 - 2.0 * top.m * ell**2, rel=1e-15)
    with pytest.raises(ValueError, match=r"^ell = "):
        HeavyTop(top.I1, top.I2, top.I3, top.m, ell=top.ell * (1.0 + 1e-6))


def test_what_rolls_on_its_rim_has_no_mass_beyond_it():
    m, radius = 2.0, 0.5
    RollingDisk(m, radius, I1=0.25, I3=m * radius**2)  # a hoop
    with pytest.raises(ValueError, match=r"^I3 = 0\.51; expected at most m radius\^2 = 0\.5 kg"):
        RollingDisk(m, radius, I1=0.3, I3=0.51)
    with pytest.raises(ValueError, match=r": RollingDisk.uniform and RollingDisk.hoop fit the "):
        RollingDisk(radius=0.3)
    UprightCoin(radius=0.3)  # of a coin that is steered and driven often the radius alone is given


@pytest.mark.parametrize("top", [HeavyTop(1.3, 1.1, 0.6, g=0.0), HeavyTop(1.3, 1.1, 0.6, ell=0.0)])
def test_a_top_without_weight_or_lever_moves_like_the_free_body(top):
    free, t = FreeBody(1.3, 1.1, 0.6), np.linspace(0.0, 20.0, 41)
    start, u = top.state(**CALM), [0.1, -0.2, 0.05]
    for torque in (None, u):
        given = None if torque is None else [*torque, 0.0, 0.0, 0.0, 0.0, 0.0]
        moved = top.simulate(start, t, given, max_step=0.01)
        alone = free.simulate(free.state(**CALM), t, torque, max_step=0.01)
        # 2000 steps of the same map; kicks of nothing may round
        np.testing.assert_allclose(moved.y[:, :7], alone.y, rtol=0, atol=2000 * 8 * EPS)
        for name in ("L_world", "omega_world"):
            np.testing.assert_allclose(moved[name], alone[name], rtol=0, atol=2000 * 16 * EPS)
    A, B = top.linearize(start)
    assert np.isfinite(A).all()
    assert np.isfinite(B).all()
    assert top.critical_spin == 0.0
    kinetic = free.kinetic_energy(free.state(**CALM))
    np.testing.assert_allclose(top.energy(start), kinetic, rtol=4 * EPS)


def test_a_top_at_rest_without_weight_stays_where_it_is():
    for top in (HeavyTop(g=0.0), HeavyTop(ell=0.0)):
        y = top.state(q=CALM["q"])
        np.testing.assert_array_equal(top.simulate(y, [0.0, 1.0, 50.0]).y[-1], y)
        np.testing.assert_array_equal(top.advance(y, None, 10.0), y)


def test_without_weight_an_accelerated_pivot_is_gravity_along_the_acceleration():
    pulled, heavy = HeavyTop(1.3, 1.1, 0.6, g=0.0), HeavyTop(1.3, 1.1, 0.6, g=7.0)
    turn = rotations.exp([0.0, 0.5 * np.pi, 0.0])  # takes e_z to e_x
    t, y = np.linspace(0.0, 3.0, 7), heavy.state(**CALM)
    sideways = pulled.state(q=rotations.multiply(turn, CALM["q"]), omega_body=CALM["omega_body"])
    fallen = pulled.simulate(sideways, t, [0.0] * 6 + [7.0, 0.0])["R"]
    expected = rotations.matrix_from_quaternion(turn) @ heavy.simulate(y, t)["R"]
    # default steps: near 1e-10 per radian, some 10 radians
    np.testing.assert_allclose(fallen, expected, rtol=0, atol=1e-9)
