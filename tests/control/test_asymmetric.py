"""An asymmetric top kept upright: the linear equation, its Riccati matrix, the tilts it holds."""

import numpy as np
import pytest

from rigid_envs.control.linear import (
    region_of_attraction,
    simulate_closed_loop,
    step_jacobian,
    zero_order_hold,
)
from rigid_envs.mechanics import rotations
from rigid_envs.systems.heavy_top.controllers import AsymmetricBalance, vertical_of
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.control.claims import assert_within_limits_row_by_row

TOP = HeavyTop(0.925, 1.15, 0.55)
DT, FREE = 0.05, 1e9  # the latter: no limit
PRICES = np.array([1.0, 1.0, 0.1, 0.1]), 0.03


def law(torque=FREE, top=TOP):
    return AsymmetricBalance(top, torque, DT, fastest=3.0)


def leaning(x, spin, heading=0.7):
    """States with x = (G1, G2, omega1, omega2) and a spin; the heading makes no difference."""
    up = np.sqrt(1.0 - x[..., 0] ** 2 - x[..., 1] ** 2)
    q = np.stack([1.0 + up, x[..., 1], -x[..., 0], 0.0 * up], axis=-1)
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    q = rotations.multiply(rotations.exp([0.0, 0.0, heading]), q)
    rest = np.zeros((*up.shape, 5))
    rest[..., 0] = spin
    return np.concatenate([q, x[..., 2:], rest], axis=-1)


def step(balance):
    return lambda y: TOP.advance(y, balance.inputs(balance(y)), DT, 2)


def test_the_vertical_is_read_off_at_any_heading():
    x = 0.3 * np.random.default_rng(0).normal(size=(50, 4))
    for heading in (0.0, 2.0):
        np.testing.assert_allclose(vertical_of(leaning(x, 1.0, heading)), x, atol=1e-15)


def test_actions_stay_within_their_limits_and_rows_are_independent():
    x = 0.2 * np.random.default_rng(0).normal(size=(3, 5, 4))
    assert_within_limits_row_by_row(law(0.3), leaning(x, 1.3))
    assert (law(0.3)(leaning(x, 1.3))[..., 2] == 0.0).all()


@pytest.mark.parametrize("spin", [0.0, 1.7, -2.5])
def test_the_linear_equation_is_that_of_the_steps_of_the_top(spin):
    balance = law()

    def advance(x, u):
        whole = np.concatenate([u, 0.0 * u[:, :1]], axis=-1) / FREE
        return vertical_of(TOP.advance(leaning(x, spin), balance.inputs(whole), DT, 8))

    F, G = step_jacobian(advance, np.zeros(4), 2)
    K, P = balance.regulator(spin)
    closed = F - G @ K
    assert np.abs(np.linalg.eigvals(closed)).max() < 0.99
    again = np.diag(PRICES[0]) + PRICES[1] * K.T @ K + closed.T @ P @ closed
    # the Jacobian is known to 1e-9
    np.testing.assert_allclose(again, P, atol=1e-7 * np.abs(P).max())


def test_the_riccati_value_is_the_sum_of_the_costs_and_decreases():
    balance, rng = law(), np.random.default_rng(0)
    states = simulate_closed_loop(step(balance), leaning(1e-5 * rng.normal(size=(20, 4)), 1.5), 200)
    x, u = vertical_of(states[:-1]), FREE * balance(states[:-1])
    cost = x**2 @ PRICES[0] + PRICES[1] * np.sum(u**2, axis=-1)
    value = balance.value(states)
    np.testing.assert_allclose(cost.sum(axis=0), value[0] - value[-1], rtol=1e-5)
    value = balance.value(
        simulate_closed_loop(step(balance), leaning(0.1 * rng.normal(size=(50, 4)), 1.5), 100)
    )
    assert (np.diff(value, axis=0) < 0.0).all()


def test_between_the_nodes_and_for_every_drawn_body_the_loop_is_stable():
    balance, rng, found = law(), np.random.default_rng(0), []
    for moments in rng.uniform([0.85, 1.05, 0.45], [1.0, 1.25, 0.65], (100, 3)):
        other, spin = law(top=HeavyTop(*moments)), rng.uniform(-3.0, 3.0)
        F, G = zero_order_hold(*other.model(spin), DT)
        found.append(np.abs(np.linalg.eigvals(F - G @ balance._table(spin).gain)).max())
    assert max(found) < 0.995


@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_from_the_fastest_spin_on_the_gains_are_those_of_it(sense):
    balance, x = law(0.3), np.array([0.01, -0.02, 0.03, 0.01])
    K, P = balance.regulator(3.0 * sense)
    for spin in (3.0 * sense, 4.0 * sense):
        np.testing.assert_allclose(balance(leaning(x, spin))[:2], -K @ x / 0.3, rtol=1e-12)
        np.testing.assert_allclose(balance.value(leaning(x, spin)), x @ P @ x, rtol=1e-12)


@pytest.mark.parametrize("spin", [-2.0, 0.0, 1.0])
def test_limited_torque_brings_back_the_tilts_that_the_law_says(spin):
    balance = law(0.3)

    def succeeds(turn):
        y = TOP.state(q=rotations.exp(turn), omega_body=[0.0, 0.0, spin])
        return TOP.tilt(simulate_closed_loop(step(balance), y, 300)[-1]) < 0.05

    angle = np.linspace(0.0, np.pi, 12)
    directions = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    assert (region_of_attraction(succeeds, directions, [0.1, 0.2, 0.3]) == 0.3).all()


def test_numbers_that_are_not_positive_are_refused():
    with pytest.raises(ValueError, match=r"^torque = 0\.0; expected a positive finite number"):
        law(0.0)
    with pytest.raises(ValueError, match=r"^fastest = -1\.0; expected a positive finite number"):
        AsymmetricBalance(TOP, 0.3, DT, -1.0)
