"""Upright tops: the complex linear equation, its Riccati matrix, and the tilts that are held."""

import numpy as np
import pytest

from rigid_envs.control.linear import (
    region_of_attraction,
    simulate_closed_loop,
    step_jacobian,
    zero_order_hold,
)
from rigid_envs.mechanics import rotations
from rigid_envs.systems.heavy_top.closed_forms import sleeping_exponents
from rigid_envs.systems.heavy_top.controllers import PivotBalance, UprightBalance, axis_of
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.control.claims import assert_within_limits_row_by_row

TOP = HeavyTop(1.2, 1.2, 0.6, m=0.8, g=9.5, ell=0.13)
DT, FREE = 0.05, 1e9  # the latter: no limit
E_Z = np.array([0.0, 0.0, 1.0])


def laws(limit, top=TOP):
    return [UprightBalance(top, limit, DT), PivotBalance(top, limit, DT)]


def leaning(x, spin, phase=0.3):
    """States with these real parts (e_x, e_y, e'_x, e'_y, X, Y, VX, VY) and a spin, (..., 11)."""
    e = np.concatenate([x[..., :2], np.sqrt(1.0 - np.sum(x[..., :2] ** 2, -1, keepdims=True))], -1)
    fall = -np.sum(x[..., :2] * x[..., 2:4], axis=-1, keepdims=True) / e[..., 2:]
    rate = np.concatenate([x[..., 2:4], fall], axis=-1)
    axis = np.cross(E_Z, e)
    size = np.linalg.norm(axis, axis=-1, keepdims=True)
    angle = np.arctan2(size, e[..., 2:])
    tilt = rotations.exp(axis / np.maximum(size, 1e-300) * angle)
    q = rotations.multiply(tilt, rotations.exp([0.0, 0.0, phase]))
    omega = rotations.rotate_inverse(q, np.cross(e, rate)) + spin * E_Z
    return np.concatenate([q, omega, x[..., 4:]], axis=-1)


def step(law, n_substeps=2):
    return lambda y: law.top.advance(y, law.inputs(law(y)), DT, n_substeps)


def real(matrix):
    """A complex matrix acting on pairs (real part, imaginary part)."""
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    return np.kron(matrix.real, np.eye(2)) + np.kron(matrix.imag, turn)


def test_the_axis_is_read_off_at_any_phase():
    x = 0.4 * np.random.default_rng(0).normal(size=(30, 8))
    for phase in (0.0, 2.0):
        found = axis_of(leaning(x, 1.7, phase))
        np.testing.assert_allclose(found.real, x[:, ::2], atol=1e-14)
        np.testing.assert_allclose(found.imag, x[:, 1::2], atol=1e-14)


@pytest.mark.parametrize("law", laws(0.3))
def test_inputs_stay_in_their_disc_and_rows_are_independent(law):
    y = leaning(0.3 * np.random.default_rng(0).normal(size=(3, 5, 8)), 1.0)
    y[0] = leaning(0.01 * np.random.default_rng(0).normal(size=(5, 8)), 1.0)
    assert_within_limits_row_by_row(law, y, ball=True)


@pytest.mark.parametrize("law", laws(FREE))
@pytest.mark.parametrize("spin", [0.0, 0.7, -3.0, 5.0])
def test_the_complex_equation_is_the_linearisation_of_the_steps_of_the_top(law, spin):
    n = len(law.regulator(spin).riccati)

    def advance(x, u):
        whole = np.concatenate([x, np.zeros((len(x), 8 - 2 * n))], axis=-1)
        y = TOP.advance(leaning(whole, spin), law.inputs(u / FREE), DT, 8)
        pairs = axis_of(y)[:, :n]
        return np.stack([pairs.real, pairs.imag], axis=-1).reshape(len(x), -1)

    F, G = step_jacobian(advance, np.zeros(2 * n), 2)
    K, P = law.regulator(spin)
    closed = F - G @ real(K)
    assert np.abs(np.linalg.eigvals(closed)).max() < 1.0 - 1e-3
    # the Riccati equation of the real system, whose Jacobian is known to 1e-9
    weights = [np.repeat(part, 2) for part in law._weights]
    again = np.diag(weights[0]) + real(K).T @ np.diag(weights[1]) @ real(K)
    again += closed.T @ real(P) @ closed
    np.testing.assert_allclose(again, real(P), atol=1e-6 * np.abs(P).max())


def test_without_torque_the_model_has_the_exponents_of_the_sleeping_top():
    for spin in (0.7, 5.0):
        A, _ = UprightBalance(TOP, 1.0, DT).model(spin)
        mgl = TOP.m * TOP.g * TOP.ell
        expected = sleeping_exponents(spin, i_perp=TOP.I1, i3=TOP.I3, mgl=mgl)
        found = np.linalg.eigvals(A)
        np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), atol=1e-13)


@pytest.mark.parametrize("law", laws(FREE))
def test_the_riccati_value_is_the_sum_of_the_costs_and_decreases(law):
    rng = np.random.default_rng(0)
    spin = TOP.critical_spin * 0.4  # a node of the table
    y = leaning(1e-4 * rng.normal(size=(20, 8)), spin)
    states, n = simulate_closed_loop(step(law), y, 200), law._n
    x, u = axis_of(states[:-1])[..., :n], FREE * law(states[:-1])
    cost = np.abs(x) ** 2 @ law._weights[0] + law._weights[1][0] * np.sum(u**2, axis=-1)
    value = law.value(states)
    # what is not linear is of third order in the tilt, 1e-8 of the rest, and steps are good to 1e-7
    np.testing.assert_allclose(cost.sum(axis=0), value[0] - value[-1], rtol=1e-5)
    value = law.value(
        simulate_closed_loop(step(law), leaning(0.05 * rng.normal(size=(100, 8)), spin), 100)
    )
    assert (np.diff(value, axis=0) < 0.0).all()


@pytest.mark.parametrize(("law", "spread"), list(zip(laws(FREE), (0.15, 0.05), strict=True)))
def test_between_the_nodes_and_for_tops_that_are_a_little_different_the_loop_is_stable(law, spread):
    rng, held = np.random.default_rng(0), []
    for _ in range(100):
        factors = rng.uniform(1.0 - spread, 1.0 + spread, 4)
        I1, I3, m, ell = factors * [TOP.I1, TOP.I3, TOP.m, TOP.ell]
        other = type(law)(HeavyTop(I1, I1, I3, m, TOP.g, ell), FREE, DT)
        spin = rng.uniform(-1.4, 1.4) * TOP.critical_spin
        F, G = zero_order_hold(*other.model(spin), DT)
        held.append(np.abs(np.linalg.eigvals(F - G @ law._table(spin).gain)).max())
    assert max(held) < 1.0


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_torque_brings_back_nearly_every_tilt_that_any_torque_can(share):
    top, law = HeavyTop(), laws(0.3, HeavyTop())[0]

    def succeeds(turn):
        y = top.state(q=rotations.exp(turn), omega_body=share * top.critical_spin * E_Z)
        return top.tilt(simulate_closed_loop(step(law), y, 300)[-1]) < 0.05

    bound = 0.3 / np.sqrt(1.0 - share**2)
    directions = bound * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.6, 0.8, 0.0]])
    found = region_of_attraction(succeeds, directions, np.append(0.5, np.arange(0.9, 1.2, 0.01)))
    assert (found > 0.95 - 1e-9).all()
    assert (found < 1.0 + 0.3 * bound**2).all()  # the linear bound, but for second order


def test_the_pivot_brings_back_a_tilt_within_five_metres():
    top = HeavyTop()
    law = PivotBalance(top, 3.0, DT)

    def succeeds(turn):
        y = top.state(q=rotations.exp(turn), omega_body=0.3 * top.critical_spin * E_Z)
        states = simulate_closed_loop(step(law), y, 400)
        away = np.linalg.norm(top.pivot(states), axis=-1)
        return (top.tilt(states[-1]) < 0.05) & (away < 5.0).all(axis=0) & (away[-1] < 0.1)

    found = region_of_attraction(
        succeeds, [[1.0, 0.0, 0.0], [-0.6, 0.8, 0.0]], np.arange(0.02, 0.2, 0.01)
    )
    np.testing.assert_allclose(found, 0.16, atol=1e-9)


def test_tops_without_symmetry_or_weight_and_limits_that_are_none_are_refused():
    with pytest.raises(ValueError, match="expected a symmetric top, I1 = I2"):
        UprightBalance(HeavyTop(1.0, 1.1, 0.5), 0.3, DT)
    for law, top in ((UprightBalance, HeavyTop(g=0.0)), (PivotBalance, HeavyTop(ell=0.0))):
        with pytest.raises(ValueError, match=r"^top = HeavyTop\(.*; expected a top that can fall"):
            law(top, 0.3, DT)
    with pytest.raises(ValueError, match=r"^limit = 0\.0; expected a positive finite number"):
        PivotBalance(TOP, 0.0, DT)
    with pytest.raises(ValueError, match=r"^dt = 0; expected a positive finite number \[s\]"):
        UprightBalance(TOP, 0.3, 0)
