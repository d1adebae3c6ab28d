"""Laws that hold a spin: their Riccati and Lyapunov functions, and from how far they succeed."""

import numpy as np
import pytest

from rigid_envs.control.linear import region_of_attraction, simulate_closed_loop, step_jacobian
from rigid_envs.systems.free_body.controllers import (
    EnergyCasimir,
    SingleTorque,
    SpinRegulator,
    saddle,
)
from rigid_envs.systems.free_body.system import FreeBody
from tests.control.claims import assert_within_limits_row_by_row, rate_along, spinning

BODY, RATE, DT = FreeBody(1.1, 1.7, 2.3), 1.3, 0.1
OMEGA = slice(4, 7)
E2 = np.array([0.0, 1.0, 0.0])
FREE = 1e9  # N m, no limit


def step(law, dt=DT, n_substeps=4):
    return lambda y: law.body.advance(y, law.inputs(law(y)), dt, n_substeps)


def regulator(torque=0.2):
    return SpinRegulator(BODY, RATE, torque, DT)


@pytest.mark.parametrize(
    "law", [regulator(), SingleTorque(BODY, RATE, 0.4), EnergyCasimir(BODY, RATE, 0.2)]
)
def test_actions_stay_within_their_limits_and_rows_are_independent(law):
    y = spinning(np.random.default_rng(0), (3, 5))
    y[0, :, OMEGA] = RATE * E2 + 0.01 * y[0, :, OMEGA]
    assert_within_limits_row_by_row(law, y)
    assert law.inputs(law(y)).shape == (3, 5, 3)


def test_the_sampled_linearisation_is_that_of_the_steps_of_the_body():
    law = regulator(FREE)

    def advance(x, u):
        y = BODY.state(omega_body=x + RATE * E2)
        return BODY.advance(y, u, DT, 8)[..., OMEGA] - RATE * E2

    F, G = step_jacobian(advance, np.zeros(3), 3)
    eigenvalues = np.linalg.eigvals(F - G @ law.regulator.gain)
    assert np.abs(eigenvalues).max() < 0.9
    # the Riccati equation, with the error 1e-10 of the differences and that of the integrator
    K, P = law.regulator
    closed = F - G @ K
    again = np.eye(3) + law.input_weight * K.T @ K + closed.T @ P @ closed
    np.testing.assert_allclose(again, P, rtol=1e-6, atol=1e-7)


def test_the_riccati_value_is_the_sum_of_the_costs_and_decreases():
    law, rng = regulator(FREE), np.random.default_rng(0)
    y = BODY.state(omega_body=RATE * E2 + 1e-6 * rng.normal(size=(20, 3)))
    states = simulate_closed_loop(step(law), y, 200)
    torque = law.inputs(law(states))
    cost = np.sum(law.error(states) ** 2, axis=-1) + law.input_weight * np.sum(torque**2, axis=-1)
    # what is not linear is 1e-6 of the rest, the rounding of omega near 1 1e-10
    np.testing.assert_allclose(cost.sum(axis=0), law.value(y), rtol=1e-5)
    far = simulate_closed_loop(
        step(law), BODY.state(omega_body=RATE * E2 + rng.normal(size=(200, 3))), 30
    )
    value = law.value(far)
    assert (np.diff(value, axis=0) < 0.0)[value[:-1] > 1e-20].all()


def test_one_torque_makes_its_lyapunov_function_decrease_as_stated():
    law, y = SingleTorque(BODY, RATE, FREE), spinning(np.random.default_rng(0), (100,), 2.0)
    found = rate_along(law.lyapunov, y, BODY.rhs(y, law.inputs(law(y))), OMEGA)
    expected = -(BODY.I3 - BODY.I2) * law.k * y[:, 6] ** 2
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(found).max())


def test_one_torque_leads_to_e2_from_all_that_is_certified_and_not_from_all_else():
    law, y = SingleTorque(BODY, RATE, FREE), spinning(np.random.default_rng(0), (200,), 2.0)
    certified = law.certified(y)
    assert 50 < certified.sum() < 180
    states = simulate_closed_loop(step(law, 0.04), y, 1500)
    ahead = (states[..., 5] > 0.0).all(axis=0)
    assert ahead[certified].all()
    assert not ahead[~certified].all()
    left = law.lyapunov(states[-1]) / law.lyapunov(y)
    assert (left[certified] < 1e-3).all()  # the slowest at 0.3 rad/s about e2


@pytest.mark.parametrize("strength", [0.9, 1.1, 3.0])
def test_one_torque_is_stable_above_its_threshold_and_only_there(strength):
    law = SingleTorque(BODY, RATE, FREE, strength)
    assert law.threshold == pytest.approx(BODY.I2 - BODY.I1, rel=1e-15)

    def rate(x):
        y = BODY.state(omega_body=x + RATE * E2)
        return BODY.rhs(y, law.inputs(law(y)))[..., OMEGA]

    h = 1e-6 * np.eye(3)
    jacobian = (rate(h) - rate(-h)).T / 2e-6
    found = np.linalg.eigvals(jacobian)
    expected = np.append(law.exponents(), 0.0)  # the rate about e2 is not changed
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), atol=1e-9)
    assert (expected.real <= 0.0).all() == (strength > 1.0)


@pytest.mark.parametrize(("strength", "damping"), [(1.1, 0.3), (3.0, 3.0), (2.0, 0.1), (9.0, 1.0)])
def test_the_energy_casimir_function_decreases_everywhere_as_stated(strength, damping):
    law = EnergyCasimir(BODY, RATE, FREE, strength, damping)
    y = spinning(np.random.default_rng(0), (500,), 3.0)
    found = rate_along(law.lyapunov, y, BODY.rhs(y, law.inputs(law(y))), OMEGA)
    np.testing.assert_allclose(found, law.lyapunov_rate(y), atol=1e-12 * np.abs(found).max())
    assert (found < 0.0).all()


def test_the_energy_casimir_law_leads_to_the_spin_from_everywhere_without_limits():
    law, y = EnergyCasimir(BODY, RATE, FREE), spinning(np.random.default_rng(0), (200,), 3.0)
    states = simulate_closed_loop(step(law, 0.01, 2), y, 600)
    value = law.lyapunov(states)
    assert (np.diff(value, axis=0) < 0.0)[value[:-1] > 1e-20].all()
    np.testing.assert_allclose(law.error(states[-1]), 0.0, atol=1e-6)


LIMITED = [
    (SpinRegulator(FreeBody(), 1.0, 0.2, DT), 0.26),
    (EnergyCasimir(FreeBody(), 1.0, 0.2), 0.26),
    (SingleTorque(FreeBody(), 1.0, 0.45), 0.22),
]


def held(law):
    """Whether perturbations are brought back while omega2 stays positive."""

    def succeeds(perturbation):
        y = law.body.state(omega_body=law.rate * E2 + perturbation)
        omega = simulate_closed_loop(step(law), y, 300)[..., OMEGA]
        side = np.hypot(omega[-1, ..., 0], omega[-1, ..., 2])
        return (omega[..., 1] > 0.0).all(axis=0) & (side < 0.05 * omega[-1, ..., 1])

    return succeeds


@pytest.mark.parametrize(("law", "size"), LIMITED)
def test_limited_torque_succeeds_from_where_the_law_says(law, size):
    directions = np.random.default_rng(0).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    found = region_of_attraction(held(law), directions, np.arange(0.02, 0.6, 0.02))
    assert size - 1e-9 < found.min() < size + 0.03  # of 200 directions, in steps of 0.02


@pytest.mark.parametrize(("law", "d"), [(LIMITED[0][0], 0.55), (LIMITED[2][0], 0.46)])
def test_along_the_unstable_direction_a_law_holds_what_can_be_held(law, d):
    r, growth, _ = saddle(law.body.moments)
    first = 1.0 / law.body.I1 if isinstance(law, SpinRegulator) else 0.0
    most = law.torque * (first + r / law.body.I3) / growth
    found = region_of_attraction(
        held(law), [[0.5, 0.0, -0.5 / r], [-0.5, 0.0, 0.5 / r]], np.arange(0.01, 1.0, 0.01)
    )
    np.testing.assert_allclose(found, d, rtol=1e-12)
    np.testing.assert_allclose(found, most, rtol=0.03)  # omega2 changes on the way


def test_bodies_gains_and_numbers_that_make_no_law_are_refused():
    with pytest.raises(ValueError, match=r"expected I1 < I2 < I3: e2 is the intermediate axis"):
        SingleTorque(FreeBody(1.0, 3.0, 2.5), 1.0, 0.2)
    with pytest.raises(ValueError, match=r"^torque = 0\.0; expected a positive finite number"):
        SpinRegulator(BODY, 1.0, 0.0, DT)
    with pytest.raises(ValueError, match=r"^dt = -0\.1; expected a positive finite number \[s\]"):
        SpinRegulator(BODY, 1.0, 0.2, -0.1)
    with pytest.raises(ValueError, match=r"^strength = 1\.0; expected more than 1, the threshold"):
        EnergyCasimir(BODY, 1.0, 0.2, strength=1.0)
    with pytest.raises(ValueError, match="y has shape"):
        regulator()(np.zeros(3))
