"""Named quantities and contact forces of a state, against their definitions and closed values."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from rigid_envs import systems
from rigid_envs.systems.dynamic_ball import dynamics as dynamic_ball
from rigid_envs.systems.dynamic_ball.dynamics import LEVEL
from tests.refusals import refuses
from tests.systems.examples import (
    BALL,
    BODY,
    COIN,
    DISK,
    EULER,
    PLATE,
    ROLLER,
    SATELLITE,
    SYSTEMS,
    TOP,
    each_turning,
    inputs,
    name_of,
    states,
)

ATOL = 1e-14  # some ten roundings of numbers near 1 to 10
E_Z = np.array([0.0, 0.0, 1.0])


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=ATOL)


def matrices(y):
    return Rotation.from_quat(y[..., :4].reshape(-1, 4), scalar_first=True).as_matrix()


@each_turning
def test_the_attitude_is_read_in_four_ways(system):
    y = states(system, np.random.default_rng(1), 20)
    R = matrices(y)
    close(system.accessors["R"](y), R)
    close(system.accessors["gamma"](y), R[:, 2])
    close(Rotation.from_euler("ZXZ", system.accessors["euler"](y)).as_matrix(), R)
    np.testing.assert_array_equal(system.accessors["q"](y), y[..., :4])


@pytest.mark.parametrize("system", [BODY, TOP], ids=name_of)
def test_angular_velocity_and_momentum_are_turned_into_the_world(system):
    y = states(system, np.random.default_rng(2), 20)
    moments = np.array([system.I1, system.I2, system.I3])
    omega = y[:, 4:7]
    np.testing.assert_array_equal(system.omega_body(y), omega)
    close(system.omega_world(y), np.einsum("nij,nj->ni", matrices(y), omega))
    close(system.L_body(y), moments * omega)
    close(system.L_world(y), np.einsum("nij,nj->ni", matrices(y), moments * omega))


@pytest.mark.parametrize("system", [s for s in SYSTEMS if s is not BALL], ids=name_of)
def test_the_energy_among_the_invariants_is_that_of_the_accessor(system):
    y = states(system, np.random.default_rng(15), 20)
    if system is PLATE:  # which adds energy where it turns or tips
        system, y[:, 11:] = replace(PLATE, turntable_rate=0.0), 0.0
    energy = (system.kinetic_energy if system in (BODY, SATELLITE) else system.energy)(y)
    np.testing.assert_allclose(system.invariants(y)["energy"], energy, rtol=1e-14)


def test_the_tilt_keeps_its_digits_near_both_poles():
    for tilt in (0.0, 1e-12, 1e-6, 1.0, np.pi - 1e-9, np.pi):
        y = TOP.state(q=(np.cos(0.5 * tilt), 0.0, np.sin(0.5 * tilt), 0.0))
        assert TOP.tilt(y) == pytest.approx(tilt, rel=1e-15, abs=2e-16)


def test_the_ball_lies_on_its_plate_and_turns_with_its_spin():
    y = states(PLATE, np.random.default_rng(11), 20)
    P = Rotation.from_euler("XY", y[:, 9:11]).as_matrix()
    close(PLATE.plate(y), P)
    centre = np.concatenate([y[:, 4:6], np.full((20, 1), PLATE.radius)], axis=-1)
    close(PLATE.centre(y), np.einsum("nij,nj->ni", P, centre))
    omega = PLATE.omega_world(y)
    close(np.einsum("nij,nj->ni", P, PLATE.omega_plate(y)), omega)
    close(np.sum(omega * P[:, :, 2], axis=-1), PLATE.spin(y))


def test_the_disk_stands_on_its_lowest_point_and_rolls_over_it():
    y = states(DISK, np.random.default_rng(12), 20)
    R = matrices(y)
    n = DISK.radius_up(y)
    close(np.sum(n * R[:, :, 2], axis=-1), 0.0)
    close(np.sum(n * n, axis=-1), 1.0)
    close(np.cross(R[:, :, 2], n)[:, 2], 0.0)  # the direction of travel is horizontal
    close(np.cos(DISK.tilt(y)), R[:, 2, 2])
    close(n[:, 2], np.sin(DISK.tilt(y)))  # it points up
    foot = np.concatenate([y[:, 7:9], np.zeros((20, 1))], axis=-1)
    close(DISK.centre(y), foot + DISK.radius * n)
    close(DISK.velocity(y), np.cross(DISK.omega_world(y), DISK.radius * n))


def test_the_coin_heads_for_where_its_rim_points():
    phi, psi = np.random.default_rng(13).uniform(-3.0, 3.0, (2, 20))
    y = COIN.state(q=COIN.attitude(phi, psi), steer_rate=0.7, roll_rate=-1.3)
    close(
        matrices(y),
        Rotation.from_euler("ZXZ", np.stack([phi, 0 * phi + np.pi / 2, psi], -1)).as_matrix(),
    )
    close(COIN.heading(y), phi)
    close(COIN.phase(y), psi)
    close(COIN.direction(y), -np.stack([np.cos(phi), np.sin(phi)], axis=-1))
    omega = COIN.omega_world(y)
    close(omega, 0.7 * E_Z - 1.3 * matrices(y)[:, :, 2])
    rolled = np.cross(omega, COIN.radius * E_Z)
    close(rolled[:, 2], 0.0)
    close(COIN.velocity(y), rolled[:, :2])


def test_the_path_of_the_roller_is_the_integral_of_its_descent():
    for s in (-2.0, -1e-9, 0.0, 0.3, 5.0):
        y = ROLLER.state(arc_length=s)
        assert ROLLER.descent(y) == pytest.approx(0.4 - 0.3 * s, abs=1e-15)
        x = quad(lambda w: np.cos(0.4 - 0.3 * w), 0.0, s, epsabs=1e-14)[0]
        z = quad(lambda w: -np.sin(0.4 - 0.3 * w), 0.0, s, epsabs=1e-14)[0]
        np.testing.assert_allclose(ROLLER.place(y), (x, z), rtol=0, atol=1e-14)
        assert ROLLER.turn(y) == pytest.approx(s / 0.7, rel=1e-15)


def test_friction_turns_a_roller_of_larger_ratio_harder():
    y, heavier = states(ROLLER, np.random.default_rng(20), 20), replace(ROLLER, beta=0.8)
    found, expected = ROLLER.contact_force(y, (0.3, 0.35)), heavier.contact_force(y, (0.3, 0.0))
    np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_the_critical_spin_is_the_sleeping_threshold():
    # Goldstein, Poole & Safko, example of section 5.7: I3^2 omega3^2 = 4 I1 m g ell.
    assert systems.HeavyTop().critical_spin == pytest.approx(4.0, rel=1e-15)
    top = systems.HeavyTop(1.2, 1.2, 0.3, m=2.0, g=9.0, ell=0.1)
    assert 0.09 * top.critical_spin**2 == pytest.approx(4.0 * 1.2 * 1.8, rel=1e-15)


@pytest.mark.parametrize("system", [BODY, TOP, DISK, EULER, PLATE, COIN], ids=name_of)
def test_no_rate_exceeds_its_bound_before_the_horizon(system):
    rng = np.random.default_rng(10)
    y0, u = states(system, rng, 30), inputs(system, rng, 30)
    for k in range(len(y0)):
        horizon = min(system.horizon(y0[k], u[k]), 4.0)  # of body and top it is infinite
        motion = system.simulate(y0[k], np.linspace(0.0, horizon, 41), u[k])
        if system is COIN:  # which turns about the vertical and about its axis one after the other
            rates = np.maximum(np.abs(motion["steer_rate"]), np.abs(motion["roll_rate"]))
        else:
            rates = np.linalg.norm(motion["omega_world"], axis=-1)
        assert np.max(rates) <= system.rate_bound(y0[k], u[k], horizon)


def test_no_rate_of_a_roller_exceeds_its_bound_before_the_horizon_however_the_ratio_changes():
    rng, most = np.random.default_rng(21), np.array([0.5, 2.0])
    y0, share = states(ROLLER, rng, 30), 0.0
    for y in y0 * [4.0, 4.0]:
        horizon = ROLLER.horizon(y, most)
        u = most * rng.choice([0.0, 1.0], (10, 2))
        motion = ROLLER.simulate(y, np.linspace(0.0, horizon, 11), u)
        rate, bound = 0.3 * np.max(np.abs(motion["velocity"])), ROLLER.rate_bound(y, most, horizon)
        assert rate <= bound
        share = max(share, rate / bound)
    assert share > 0.5  # nor is the bound far away
    assert ROLLER.horizon(y0, np.array([0.5, 0.0])) == np.inf


def test_the_rate_bound_knows_the_turns_that_a_step_is_made_of():
    # A rod along e2 of a top: the turn about L goes at norm(L) / I2, far above norm(omega). A free
    # body is split about its middle moment, whatever its axis is called.
    top = systems.HeavyTop(1.0, 0.1, 1.0, m=1e-9, g=1e-9, ell=1e-9)
    start = top.state(omega_body=(2.0, 0.0, 0.0))
    assert top.rate_bound(start, np.zeros(8), 0.0) == pytest.approx(20.0)
    refuses("take n_substeps >= 4", top.advance, start, None, 0.1)
    rod = systems.FreeBody(1.0, 0.1, 1.0)
    bound = rod.rate_bound(rod.state(omega_body=(2.0, 0.0, 0.0)), np.zeros(3), 0.0)
    assert bound == pytest.approx(2.0 / np.sqrt(0.1))


def test_the_rate_bound_is_attained():
    body = systems.FreeBody()
    assert body.rate_bound(body.state(omega_body=(3.0, 0.0, 0.0)), np.zeros(3), 9.0) == 3.0
    pushed = body.rate_bound(body.state(), np.array([0.5, 0.0, 0.0]), 2.0)
    assert pushed == pytest.approx(1.0, rel=1e-15)


ROLLING = (DISK, EULER, PLATE, COIN, ROLLER)


def test_the_force_of_a_level_plate_is_that_of_any_plate():
    rng = np.random.default_rng(75)
    y, u = states(PLATE, rng, 50), inputs(PLATE, rng, 50)
    y[:, 9:], u[:, 2:] = 0.0, 0.0
    p = PLATE.parameters
    for row, force, expected in zip(y, u, PLATE.contact_force(y, u), strict=True):
        kinds = (dynamic_ball.State(*row), dynamic_ball.Input(*force), dynamic_ball.Parameters(*p))
        found = LEVEL.force(*kinds)
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("system", (*ROLLING, replace(ROLLER, curvature=-1.0)), ids=name_of)
def test_friction_is_the_part_of_the_contact_force_along_the_ground(system):
    rng = np.random.default_rng(77)
    y, u = states(system, rng, 50), np.abs(inputs(system, rng, 50))
    u[:, 2:] *= 50.0  # of a plate: jerked, so that it falls away from under some balls
    force, needed = system.contact_force(y, u), system.needed_friction(y, u)
    normal, along = force[:, -1], np.linalg.norm(force[:, :-1], axis=-1)
    np.testing.assert_allclose(system.normal_force(y, u), normal, rtol=1e-14)
    np.testing.assert_allclose(needed, np.where(normal > 0.0, along / normal, np.inf), rtol=1e-12)
    np.testing.assert_array_equal(system.slips(y, u, mu=1e9), normal <= 0.0)


@pytest.mark.parametrize("system", ROLLING, ids=name_of)
def test_slip_is_judged_by_the_coefficient_of_the_system(system):
    rng = np.random.default_rng(76)
    y, u = states(system, rng, 20), inputs(system, rng, 20)
    held = np.isfinite(system.needed_friction(y, u))
    y, u = y[held][0], u[held][0]
    needed = float(system.needed_friction(y, u))
    assert not replace(system, mu=1.001 * needed).slips(y, u)
    assert replace(system, mu=0.999 * needed).slips(y, u)
    assert not replace(system, mu=0.0).slips(y, u, mu=2.0 * needed)


@pytest.mark.parametrize("system", ROLLING, ids=name_of)
def test_forces_of_many_states_have_their_shape_and_are_named_quantities(system):
    rng = np.random.default_rng(73)
    y, u = states(system, rng, 3, 2), inputs(system, rng, 3, 2)
    for call in (system.normal_force, system.needed_friction):
        assert call(y, u).shape == (3, 2)
        np.testing.assert_array_equal(system.accessors[call.__name__](y), call(y))
    assert system.slips(y, u, mu=0.5).shape == (3, 2)
    refuses(r"^mu = -0\.1; expected a finite number of at least 0", system.slips, y, u, mu=-0.1)
    assert not hasattr(systems.RollingBall, "needed_friction")
