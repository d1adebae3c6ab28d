"""Named quantities of a state, against their definitions in plain NumPy and SciPy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.systems.examples import (
    BODY,
    COIN,
    DISK,
    PLATE,
    ROLLER,
    SYSTEMS,
    TOP,
    TURNING,
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


@pytest.mark.parametrize("system", TURNING, ids=name_of)
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


def test_energies_are_the_textbook_ones():
    y = states(BODY, np.random.default_rng(3), 20)
    kinetic = 0.5 * (1.1 * y[:, 4] ** 2 + 1.7 * y[:, 5] ** 2 + 2.3 * y[:, 6] ** 2)
    close(BODY.kinetic_energy(y), kinetic)
    close(BODY.invariants(y)["energy"], kinetic)
    y = states(TOP, np.random.default_rng(4), 20)
    kinetic = 0.5 * (1.3 * y[:, 4] ** 2 + 1.1 * y[:, 5] ** 2 + 0.6 * y[:, 6] ** 2)
    potential = 0.8 * 9.5 * 0.13 * matrices(y)[:, 2, 2]
    close(TOP.energy(y), kinetic + potential)
    close(TOP.invariants(y)["energy"], kinetic + potential)


def test_momenta_among_the_invariants_are_those_of_the_accessors():
    y = states(BODY, np.random.default_rng(5), 20)
    found, L = BODY.invariants(y), BODY.L_world(y)
    close(found["L_squared"], np.sum(BODY.L_body(y) ** 2, axis=-1))
    close(np.stack([found[f"L_world_{k}"] for k in "xyz"], axis=-1), L)
    y = states(TOP, np.random.default_rng(6), 20)
    found = TOP.invariants(y)
    close(found["L_vertical"], TOP.L_world(y)[:, 2])
    close(found["L_spin"], TOP.L_body(y)[:, 2])


def test_the_tilt_keeps_its_digits_near_both_poles():
    for tilt in (0.0, 1e-12, 1e-6, 1.0, np.pi - 1e-9, np.pi):
        y = TOP.state(q=(np.cos(0.5 * tilt), 0.0, np.sin(0.5 * tilt), 0.0))
        assert TOP.tilt(y) == pytest.approx(tilt, rel=1e-15, abs=2e-16)


@pytest.mark.parametrize("system", SYSTEMS, ids=name_of)
def test_components_are_plain_entries(system):
    y = states(system, np.random.default_rng(7), 5)
    for name, where in system.components.items():
        found = getattr(system, name, system.accessors[name])(y)
        np.testing.assert_array_equal(found.reshape(5, -1), y[:, where])


def test_the_ball_lies_on_its_plate_and_rolls_with_its_surface():
    y = states(PLATE, np.random.default_rng(11), 20)
    P = Rotation.from_euler("XY", y[:, 9:11]).as_matrix()
    close(PLATE.plate(y), P)
    centre = np.concatenate([y[:, 4:6], np.full((20, 1), PLATE.radius)], axis=-1)
    close(PLATE.centre(y), np.einsum("nij,nj->ni", P, centre))
    omega = PLATE.omega_world(y)
    close(np.einsum("nij,nj->ni", P, PLATE.omega_plate(y)), omega)
    close(np.sum(omega * P[:, :, 2], axis=-1), PLATE.spin(y))
    # What the plate's own matrix says of its rate: P' = [w] P, by central differences.
    h = 1e-5
    ahead, behind = y.copy(), y.copy()
    ahead[:, 9:11] += h * y[:, 11:13]
    behind[:, 9:11] -= h * y[:, 11:13]
    turned = (PLATE.plate(ahead) - PLATE.plate(behind)) / (2.0 * h) @ np.swapaxes(P, -1, -2)
    w = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=-1)
    n = P[:, :, 2]
    foot = PLATE.centre(y) - PLATE.radius * n
    surface = np.cross(w + PLATE.turntable_rate * n, foot)
    contact = PLATE.velocity_world(y) - PLATE.radius * np.cross(omega, n)
    np.testing.assert_allclose(contact, surface, rtol=0, atol=1e-9)  # h^2, and eps / h


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


@pytest.mark.parametrize("system", [DISK, PLATE, COIN], ids=name_of)
def test_angular_velocities_are_those_of_the_quaternion(system):
    rng = np.random.default_rng(14)
    y = states(system, rng, 20)
    q, rate = y[:, :4], system.rhs(y, inputs(system, rng, 20))[:, :4]
    # (0, omega_world) = 2 q' conj(q).
    w, v = q[:, :1], q[:, 1:]
    omega = 2.0 * (w * rate[:, 1:] - rate[:, :1] * v + np.cross(v, rate[:, 1:]))
    close(system.omega_world(y), omega)


def test_energies_of_what_rolls_are_those_of_centre_and_rotation():
    y = states(PLATE, np.random.default_rng(15), 20)
    speed, turn = PLATE.velocity_world(y), PLATE.omega_world(y)
    kinetic = 0.6 * np.sum(speed**2, axis=-1) + 0.6 * 0.55 * 0.64 * np.sum(turn**2, axis=-1)
    np.testing.assert_allclose(
        PLATE.energy(y), kinetic + 1.2 * 9.6 * PLATE.centre(y)[:, 2], rtol=1e-14
    )
    y = states(DISK, np.random.default_rng(16), 20)
    speed, turn = DISK.velocity(y), DISK.omega_body(y)
    kinetic = 2.5 * np.sum(speed**2, axis=-1) + 0.5 * np.sum([1.4, 1.4, 2.0] * turn**2, axis=-1)
    energy = kinetic + 5.0 * 2.5 * DISK.centre(y)[:, 2]
    np.testing.assert_allclose(DISK.energy(y), energy, rtol=1e-14)
    np.testing.assert_allclose(DISK.invariants(y)["energy"], energy, rtol=1e-14)
    y = states(COIN, np.random.default_rng(17), 20)
    kinetic = 0.15 * y[:, 6] ** 2 + 0.5 * (0.4 + 1.1 * 0.49) * y[:, 7] ** 2
    energy = kinetic - 1.1 * 9.5 * np.sin(0.3) * y[:, 4]
    close(COIN.energy(y), energy)
    close(COIN.invariants(y)["energy"], energy)
    y = states(ROLLER, np.random.default_rng(18), 20)
    energy = 0.5 * 1.45 * 1.1 * y[:, 1] ** 2 + 1.1 * 9.5 * ROLLER.place(y)[:, 1]
    close(ROLLER.energy(y), energy)
    close(ROLLER.invariants(y)["energy"], energy)


def test_the_balls_invariant_is_its_energy_where_the_plate_stands_still():
    still = type(PLATE)(m=1.2, radius=0.8, beta=0.55, g=9.6)
    y = states(still, np.random.default_rng(19), 20)
    y[:, :4], y[:, 11:] = still.state()[:4], 0.0
    found = still.invariants(y)
    np.testing.assert_allclose(found["energy"], still.energy(y), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(found["spin"], y[:, 8])


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
    assert HeavyTop().critical_spin == pytest.approx(4.0, rel=1e-15)
    top = HeavyTop(1.2, 1.2, 0.3, m=2.0, g=9.0, ell=0.1)
    assert 0.09 * top.critical_spin**2 == pytest.approx(4.0 * 1.2 * 1.8, rel=1e-15)


@pytest.mark.parametrize("system", [BODY, TOP], ids=name_of)
def test_no_rate_exceeds_its_bound(system):
    rng = np.random.default_rng(9)
    y0 = states(system, rng, 30)
    u = rng.uniform(-1.0, 1.0, (30, len(system.input_entries)))
    t = np.linspace(0.0, 4.0, 41)
    for k in range(len(y0)):
        omega = system.simulate(y0[k], t, u[k])["omega_body"]
        rates = np.linalg.norm(omega, axis=-1)
        assert rates.max() <= system.rate_bound(y0[k], u[k], 4.0)


@pytest.mark.parametrize("system", [DISK, PLATE, COIN], ids=name_of)
def test_no_rate_exceeds_its_bound_before_the_horizon(system):
    rng = np.random.default_rng(10)
    y0, u = states(system, rng, 30), inputs(system, rng, 30)
    for k in range(len(y0)):
        horizon = system.horizon(y0[k], u[k])
        motion = system.simulate(y0[k], np.linspace(0.0, horizon, 11), u[k])
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
    top = HeavyTop(1.0, 0.1, 1.0, m=1e-9, g=1e-9, ell=1e-9)
    start = top.state(omega_body=(2.0, 0.0, 0.0))
    assert top.rate_bound(start, np.zeros(8), 0.0) == pytest.approx(20.0)
    with pytest.raises(ValueError, match="take n_substeps >= 4"):
        top.advance(start, None, 0.1)
    rod = FreeBody(1.0, 0.1, 1.0)
    bound = rod.rate_bound(rod.state(omega_body=(2.0, 0.0, 0.0)), np.zeros(3), 0.0)
    assert bound == pytest.approx(2.0 / np.sqrt(0.1))


def test_the_rate_bound_is_attained():
    body = FreeBody()
    assert body.rate_bound(body.state(omega_body=(3.0, 0.0, 0.0)), np.zeros(3), 9.0) == 3.0
    pushed = body.rate_bound(body.state(), np.array([0.5, 0.0, 0.0]), 2.0)
    assert pushed == pytest.approx(1.0, rel=1e-15)
