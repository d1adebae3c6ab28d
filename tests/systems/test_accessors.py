"""Named quantities of a state, against their definitions in plain NumPy and SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.systems import FreeBody, HeavyTop
from tests.systems.examples import SYSTEMS, name_of, states

BODY, TOP, BALL = SYSTEMS
ATOL = 1e-14  # some ten roundings of numbers near 1 to 10


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=ATOL)


def matrices(y):
    return Rotation.from_quat(y[..., :4].reshape(-1, 4), scalar_first=True).as_matrix()


@pytest.mark.parametrize("system", SYSTEMS, ids=name_of)
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


def test_pivot_and_position_are_plain_entries():
    y = states(TOP, np.random.default_rng(7), 5)
    np.testing.assert_array_equal(TOP.pivot(y), y[:, 7:9])
    np.testing.assert_array_equal(TOP.pivot_velocity(y), y[:, 9:11])
    y = states(BALL, np.random.default_rng(8), 5)
    np.testing.assert_array_equal(BALL.position(y), y[:, 4:6])


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


def test_the_rate_bound_knows_the_turns_that_a_step_is_made_of():
    # A rod along e2: the turn about L goes at norm(L) / I2, far above norm(omega).
    rod = FreeBody(1.0, 0.1, 1.0)
    assert rod.rate_bound(rod.state(omega_body=(2.0, 0.0, 0.0)), np.zeros(3), 0.0) == 20.0
    with pytest.raises(ValueError, match="take n_substeps >= 4"):
        rod.advance(rod.state(omega_body=(2.0, 0.0, 0.0)), None, 0.1)


def test_the_rate_bound_is_attained():
    body = FreeBody()
    assert body.rate_bound(body.state(omega_body=(3.0, 0.0, 0.0)), np.zeros(3), 9.0) == 3.0
    pushed = body.rate_bound(body.state(), np.array([0.5, 0.0, 0.0]), 2.0)
    assert pushed == pytest.approx(1.0, rel=1e-15)
