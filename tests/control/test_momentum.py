"""Impulses against the angular momentum: the exact Riccati law, and the least time."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from rigid_envs.control.linear import simulate_closed_loop
from rigid_envs.systems.free_body.controllers import MomentumBrake, MomentumRegulator
from rigid_envs.systems.free_body.system import FreeBody
from tests.control.claims import assert_within_limits_row_by_row, spinning

BODY, IMPULSE = FreeBody(1.1, 1.7, 2.3), 0.5
WEIGHTS = [(1.0, 1.0), (0.02, 3.0), (5.0, 0.1), (1e-12, 1.0)]


def regulator(a=0.1, b=4.0):
    return MomentumRegulator(BODY, IMPULSE, a, b)


def step(law):
    return lambda y: BODY.advance(law.after(y, law(y)), None, 0.1, 5)


def sizes(law, states):
    return np.linalg.norm(law.momentum(states), axis=-1)


@pytest.mark.parametrize("law", [regulator(), MomentumBrake(BODY, IMPULSE)])
def test_impulses_stay_in_their_ball_and_rows_are_independent(law):
    y = spinning(np.random.default_rng(0), (3, 5), 2.0)
    y[0, :, 4:7] *= 0.01
    assert_within_limits_row_by_row(law, y, ball=True)


@pytest.mark.parametrize(("a", "b"), WEIGHTS)
def test_gain_and_value_in_closed_form_are_those_of_the_riccati_equation(a, b):
    law, one = regulator(a, b), np.eye(1)
    if a > 1e-9:  # SciPy knows P there; x+ = x + u at the cost a (x + u)^2 + b u^2
        P = solve_discrete_are(one, one, a * one, (a + b) * one, s=a * one)[0, 0]
        assert law.riccati == pytest.approx(P, rel=1e-12)
    P, g = law.riccati, law.gain
    assert b * (a + P) / (a + b + P) == pytest.approx(P, rel=1e-14)
    assert (a + P) / (a + b + P) == pytest.approx(g, rel=1e-14)


def test_the_value_is_the_sum_of_the_costs_and_other_gains_cost_more():
    law, y = regulator(), spinning(np.random.default_rng(0), (50,), 0.3)
    y = y[sizes(law, y) < law.reach]
    states = simulate_closed_loop(step(law), y, 100)
    taken = IMPULSE * np.linalg.norm(law(states[:-1]), axis=-1)
    costs = law.weight_momentum * sizes(law, states[1:]) ** 2 + law.weight_impulse * taken**2
    # |L| is kept to rounding in each of 100 steps of 5 substeps
    np.testing.assert_allclose(costs.sum(axis=0), law.value(y) - law.value(states[-1]), rtol=1e-12)
    np.testing.assert_allclose(costs, -np.diff(law.value(states), axis=0), rtol=1e-9, atol=1e-15)
    x = sizes(law, y)
    for g in (0.8 * law.gain, 1.2 * law.gain):
        # sums of (1 - g)^(2 k) in closed form
        cost = (law.weight_momentum * (1 - g) ** 2 + law.weight_impulse * g**2) / (1 - (1 - g) ** 2)
        assert (cost * x**2 > law.value(y) * 1.01).all()


def test_the_regulator_is_limited_beyond_its_reach_only():
    law = regulator()
    for factor, largest in ((0.999, False), (1.001, True)):
        y = BODY.state(omega_body=[0.0, 0.0, factor * law.reach / BODY.I3])
        assert (np.linalg.norm(law(y)) > 1.0 - 1e-9) == largest


def test_the_brake_needs_one_step_less_after_every_step():
    law, y = MomentumBrake(BODY, IMPULSE), spinning(np.random.default_rng(0), (50,))
    states = simulate_closed_loop(step(law), y, 12)
    n = law.n_steps(np.where(sizes(law, states)[..., None] > 1e-12, states, BODY.state()))
    assert n[0].min() < 4 < 8 < n[0].max()
    np.testing.assert_array_equal(n, np.maximum(n[0] - np.arange(13)[:, None], 0.0))


def test_no_impulse_takes_more_than_its_size():
    law, rng = MomentumBrake(BODY, IMPULSE), np.random.default_rng(0)
    y, action = spinning(rng, (500,)), rng.normal(size=(500, 3))
    action /= np.linalg.norm(action, axis=-1, keepdims=True)
    assert (sizes(law, law.after(y, action)) > sizes(law, y) - IMPULSE - 1e-14).all()


def test_numbers_that_are_not_positive_are_refused():
    with pytest.raises(ValueError, match=r"^impulse = 0; expected a positive finite number"):
        MomentumBrake(BODY, 0)
    with pytest.raises(ValueError, match=r"^weight_impulse = -1\.0; expected a positive"):
        MomentumRegulator(BODY, 1.0, 1.0, -1.0)
