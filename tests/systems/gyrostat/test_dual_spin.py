"""Out of a flat spin by spinning up a rotor."""

import functools

import numpy as np
import pytest

from rigid_envs.scores.references import reference
from rigid_envs.systems.gyrostat import references
from rigid_envs.systems.gyrostat.controllers import DualSpinTurn
from rigid_envs.systems.gyrostat.system import Gyrostat
from rigid_envs.testing.environments import fresh, vector
from tests.systems.runs import at_random, bound, rows, run, still

SATELLITE = Gyrostat(2.0, 2.5, 3.0, J1=0.5)
A = SATELLITE.carrier_moments
TOLERANCE = 0.03
LAW = DualSpinTurn(SATELLITE, torque=0.03, dt=1.0, tolerance=TOLERANCE)


def constant(*shares):
    """The same torque all along, another one for each row."""
    return lambda envs: np.resize(shares, envs.action_space.shape)


@functools.cache
def ridden():
    """Episodes of the reference."""
    return run("DualSpin", bound(references.ride), 200)


def along_e1(spin):
    """Spin momenta of the rotor as vectors, shape (..., 3)."""
    return np.multiply.outer(spin, [1.0, 0.0, 0.0])


def state_of(L, spin):
    """States of angular momenta L in body axes and spin momenta of the rotor."""
    omega = (L - along_e1(spin)) / A
    wheels = along_e1(spin) / SATELLITE.J1 - omega * [1.0, 0.0, 0.0]
    return SATELLITE.state(omega_body=omega, wheel_rates=wheels)


def energy_of_carrier(L, spin):
    """The part of the energy that depends on where L is in the carrier."""
    return 0.5 * np.sum((L - along_e1(spin)) ** 2 / A, axis=-1)


def test_the_reference_brings_every_satellite_to_rest():
    assert ridden().success.all()
    assert ridden().cost.mean() < 103.0


@pytest.mark.parametrize("frame", ["world", "reduced"])
def test_neither_no_nor_random_torque_brings_a_satellite_to_rest(frame):
    for policy in (still, at_random()):
        assert not run("DualSpin", policy, 100, frame=frame).success.any()


def test_constant_torque_leaves_the_satellite_tumbling():
    shares = np.array([1.0, 0.7, 0.5, 0.35, 0.25, 0.2])
    runs = run("DualSpin", constant(*shares, *-shares), 600)
    assert runs.success.reshape(50, 12).mean(axis=0).max() <= 0.05


def test_the_motor_does_not_change_the_angular_momentum_in_space():
    L = SATELLITE.L_world(run("DualSpin", at_random(), 30).y)
    np.testing.assert_allclose(L, np.broadcast_to(L[0], L.shape), rtol=0, atol=1e-13)


def test_at_the_end_the_rotor_has_all_the_momentum_and_the_carrier_stays_at_rest():
    end = ridden().y[-1]
    L, spins = SATELLITE.L_body(end), SATELLITE.spin_momenta(end)[:, 0]
    size = np.linalg.norm(L, axis=1)
    assert (np.abs(np.abs(spins) - size) <= 1.05 * A[0] * TOLERANCE).all()
    assert (np.abs(L[:, 0]) / size >= np.cos(1.01 * A[2] * TOLERANCE / size)).all()
    later = SATELLITE.simulate(end, np.linspace(0.0, 300.0, 301))
    # what is left is a nutation, whose axes are as sqrt(A2) and sqrt(A3)
    rates = np.linalg.norm(later["omega_body"], axis=-1)
    assert rates.max() <= 1.02 * np.sqrt(A[2] / A[1]) * TOLERANCE


def test_a_carrier_at_rest_stays_so():
    y = state_of(np.array([1.5, 0.0, 0.0]), np.array(1.5))
    np.testing.assert_array_equal(SATELLITE.rhs(y), 0.0)


@pytest.mark.parametrize(
    ("spin", "kind"), [(0.39, "maximum"), (0.41, "saddle"), (0.49, "saddle"), (0.51, "minimum")]
)
def test_e1_along_l_turns_from_a_maximum_of_the_energy_to_a_saddle_and_a_minimum(spin, kind):
    """At l = |L| (1 - A1 / A2), here 0.4 of |L| = 1, and |L| (1 - A1 / A3), here 0.5."""
    c, s = np.cos(1e-3), np.sin(1e-3)
    change = energy_of_carrier(np.array([[c, s, 0.0], [c, 0.0, s]]), np.full(2, spin))
    change -= energy_of_carrier(np.array([1.0, 0.0, 0.0]), np.array(spin))
    assert ("maximum", "saddle", "minimum")[int((change > 0.0).sum())] == kind


@pytest.mark.parametrize("spin", [0.0, 0.2, 0.4, 0.499])
def test_the_flat_spin_leans_over_as_the_rotor_takes_up_momentum(spin):
    """The carrier turns about L at L1 = l A3 / (A3 - A1), which is |L| at l = |L| (1 - A1 / A3)."""
    L1 = spin * A[2] / (A[2] - A[0])
    L = np.array([L1, 0.0, np.sqrt(1.0 - L1**2)])
    omega = SATELLITE.omega_body(state_of(L, np.array(spin)))
    np.testing.assert_allclose(np.cross(L, omega), 0.0, atol=1e-15)


def test_latitude_and_longitude_of_l_move_as_the_page_says():
    rng, h = np.random.default_rng(0), 1e-4
    L, spin, u = rng.normal(size=(200, 3)), rng.normal(size=200), np.zeros((200, 6))
    u[:, 0] = rng.normal(size=200)
    before, after = (SATELLITE.advance(state_of(L, spin), u, time, 1) for time in (-h, h))
    phi, size = np.arctan2(L[:, 2], L[:, 1]), np.linalg.norm(L, axis=1)
    rate = -0.5 * size * (1.0 / A[1] - 1.0 / A[2]) * np.sin(2.0 * phi)
    found = (LAW.latitude(after) - LAW.latitude(before)) / (2.0 * h)
    np.testing.assert_allclose(found, rate, atol=1e-5)
    first, last = (np.arctan2(x[:, 2], x[:, 1]) for x in map(SATELLITE.L_body, (before, after)))
    turned = np.remainder(last - first + np.pi, 2.0 * np.pi) - np.pi
    mean = np.cos(phi) ** 2 / A[1] + np.sin(phi) ** 2 / A[2]
    omega1 = (L[:, 0] - spin) / A[0]
    np.testing.assert_allclose(turned / (2.0 * h), L[:, 0] * mean - omega1, atol=1e-5)


def test_no_reference_is_faster_than_the_bound():
    envs = fresh(vector("RigidEnvs/DualSpin-v0", 200), 0)
    least = references.DUAL_SPIN_TIME.values(envs)
    assert (least < ridden().cost).all() and (least > 0.5 * ridden().cost).all()


def test_nothing_turns_faster_than_the_largest_rate():
    task = vector("RigidEnvs/DualSpin-v0", 1).task
    fastest = 0.0
    for policy in (constant(1.0), constant(-1.0), at_random()):
        y = run("DualSpin", policy, 100).y
        omega, sphere = SATELLITE.omega_body(y), SATELLITE.L_body(y) / A[1]
        for rates in (omega, sphere, omega - sphere):
            fastest = max(fastest, np.linalg.norm(rates, axis=-1).max())
    assert 0.3 * task.largest_rate(np.inf) < fastest <= task.largest_rate(np.inf)


def test_the_controller_finds_states_in_observations():
    envs = fresh(vector("RigidEnvs/DualSpin-v0", 50), 0)
    agent, rng = reference("RigidEnvs/DualSpin-v0"), np.random.default_rng(0)
    for _ in range(20):
        seen, *_ = envs.step(rng.uniform(-1.0, 1.0, (50, 1)).astype(np.float32))
    np.testing.assert_allclose(agent.decode(seen).y[:, 4:], envs.y[:, 4:], atol=2e-5)


def test_half_turns_take_the_controller_to_the_other_end():
    envs = rows("gyrostat.tasks:DualSpin", 300)
    y, other = envs.y, envs.y
    other[:, [4, 6, 7, 9]] *= -1.0  # about e2
    np.testing.assert_array_equal(LAW.side(other), -LAW.side(y))
    np.testing.assert_allclose(LAW(other), -LAW(y), atol=1e-12)
    other = envs.y
    other[:, [5, 6, 8, 9]] *= -1.0  # about e1
    np.testing.assert_allclose(LAW(other), LAW(y), atol=1e-12)


@pytest.mark.parametrize("satellite", [Gyrostat(), Gyrostat(2.5, 2.0, 3.0, J1=0.1)])
def test_satellites_that_are_not_led_by_the_ride_are_refused(satellite):
    with pytest.raises(ValueError, match="satellite"):
        DualSpinTurn(satellite, 0.03, 1.0, TOLERANCE)
