"""Leading a top into steady precession: the linear equation about it, and its Riccati matrix."""

import numpy as np
import pytest

from rigid_envs.control.linear import simulate_closed_loop, step_jacobian
from rigid_envs.mechanics import rotations
from rigid_envs.systems.heavy_top.closed_forms import nutation_frequency
from rigid_envs.systems.heavy_top.controllers import PrecessionRegulator, nutation_of
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.control.claims import assert_within_limits_row_by_row

TOP = HeavyTop(1.2, 1.2, 0.6, m=0.8, g=9.5, ell=0.13)
DT, FREE = 0.05, 1e9  # the latter: no limit
TILTS = (0.3, 0.9)
SPINS = (1.1 * TOP.critical_spin, 2.0 * TOP.critical_spin)
BRANCHES = ("slow", "fast")


def law(branch="slow", torque=FREE, top=TOP, spins=SPINS):
    return PrecessionRegulator(top, torque, DT, TILTS, spins, branch)


def nutating(x, spin, phi=0.4, psi=-1.1):
    """States with x = (theta, theta', phi') and a spin; phi and psi make no difference."""
    theta, fall, rate = np.moveaxis(x, -1, 0)
    angles = np.stack([phi + 0.0 * theta, theta, psi + 0.0 * theta], axis=-1)
    rates = np.stack([rate, fall, spin - rate * np.cos(theta)], axis=-1)
    omega = rotations.omega_body_from_euler_rates(angles, rates)
    rest = np.zeros((*theta.shape, 4))
    return np.concatenate([rotations.quaternion_from_euler(angles), omega, rest], axis=-1)


def steady(regulator, goal, spin):
    return np.stack(np.broadcast_arrays(goal, 0.0, regulator.steady_rate(goal, spin)), axis=-1)


def step(regulator, goal):
    return lambda y: TOP.advance(y, regulator.inputs(regulator(y, goal)), DT, 2)


def test_tilt_and_rates_are_read_off():
    rng = np.random.default_rng(0)
    x = rng.uniform([0.1, -2.0, -2.0], [3.0, 2.0, 2.0], (50, 3))
    np.testing.assert_allclose(nutation_of(nutating(x, 5.0)), x, atol=1e-13)


def test_actions_stay_within_their_limits_and_rows_are_independent():
    rng = np.random.default_rng(0)
    goal = rng.uniform(*TILTS, (3, 5))
    x = rng.uniform([0.1, -1.0, -1.0], [1.2, 1.0, 1.0], (3, 5, 3))
    assert_within_limits_row_by_row(law(torque=0.5), nutating(x, np.full((3, 5), 7.0)), goal)


@pytest.mark.parametrize("branch", BRANCHES)
def test_steady_precession_needs_no_torque_and_lasts(branch):
    regulator, goal = law(branch), np.linspace(*TILTS, 7)
    spin = np.linspace(*SPINS, 7)
    y = nutating(steady(regulator, goal, spin), spin)
    np.testing.assert_allclose(regulator.inputs(regulator(y, goal)), 0.0, atol=1e-11)
    left = simulate_closed_loop(lambda y: TOP.advance(y, None, DT, 4), y, 100)[-1]
    np.testing.assert_allclose(nutation_of(left), nutation_of(y), rtol=2e-5, atol=2e-5)


@pytest.mark.parametrize("branch", BRANCHES)
@pytest.mark.parametrize(("tilt", "share"), [(0.4, 1.2), (0.9, 1.9)])
def test_the_linear_equation_is_that_of_the_steps_of_the_top(branch, tilt, share):
    regulator, spin = law(branch), share * TOP.critical_spin
    x0 = steady(regulator, tilt, spin)
    y0 = nutating(x0, spin)
    G0 = rotations.rotate_inverse(y0[:4], [0.0, 0.0, 1.0])[:2]
    n = G0 / np.linalg.norm(G0)
    frame = np.array([n, [-n[1], n[0]]])  # n and l in body axes at the beginning

    def advance(x, u):
        # x and u are moved one at a time: where u is not 0, n is that of x0
        held = regulator.inputs(u @ frame / FREE)
        return nutation_of(TOP.advance(nutating(x, spin), held, DT, 16))

    F, G = step_jacobian(advance, x0, 2)
    K, P = regulator.regulator(tilt, spin)
    closed = F - G @ K
    assert np.abs(np.linalg.eigvals(closed)).max() < 0.99
    again = np.diag([100.0, 10.0, 10.0]) + 3.0 * K.T @ K + closed.T @ P @ closed
    np.testing.assert_allclose(again, P, rtol=1e-5, atol=1e-5 * np.abs(P).max())
    free = np.linalg.eigvals(F)
    rate = float(regulator.steady_rate(tilt, spin))
    nod = float(nutation_frequency(tilt, rate, spin, i_perp=TOP.I1, i3=TOP.I3))
    expected = np.array([1.0, np.exp(1j * nod * DT), np.exp(-1j * nod * DT)])
    np.testing.assert_allclose(np.sort_complex(free), np.sort_complex(expected), atol=1e-5)


@pytest.mark.parametrize("branch", BRANCHES)
def test_the_riccati_value_is_the_sum_of_the_costs_and_decreases(branch):
    regulator, rng = law(branch), np.random.default_rng(0)
    goal, spin = np.full(20, TILTS[0]), np.full(20, SPINS[1])  # a node of the table
    x0 = steady(regulator, goal, spin)
    states = simulate_closed_loop(
        step(regulator, goal), nutating(x0 + 1e-5 * rng.normal(size=(20, 3)), spin), 60
    )
    x = nutation_of(states[:-1]) - x0
    u = FREE * regulator(states[:-1], goal)
    cost = x**2 @ [100.0, 10.0, 10.0] + 3.0 * np.sum(u**2, axis=-1)
    value = regulator.value(states, goal)
    # 1e-5 of it is not linear, and the steps of the fast branch are good to some 1e-5
    np.testing.assert_allclose(cost.sum(axis=0), value[0] - value[-1], rtol=1e-3)
    far = nutating(x0 + [0.05, 0.1, 0.05] * rng.normal(size=(20, 3)), spin)
    value = regulator.value(simulate_closed_loop(step(regulator, goal), far, 40), goal)
    assert (np.diff(value, axis=0) < 0.0).all()


@pytest.mark.parametrize("branch", BRANCHES)
def test_limited_torque_damps_the_nutation_from_where_the_law_says(branch):
    top, rng = HeavyTop(), np.random.default_rng(0)
    regulator = law(branch, 0.5, top, (top.critical_spin, 2.0 * top.critical_spin))
    goal, spin = rng.uniform(0.3, 0.9, 200), top.critical_spin * rng.uniform(1.2, 2.0, 200)
    across = rng.uniform(0.0, 1.0, 200) ** 0.5 * np.exp(2j * np.pi * rng.random(200))
    y = nutating(np.stack([rng.uniform(0.0, 1.2, 200), *np.zeros((2, 200))], axis=-1), spin)
    y[:, 4:7] = np.stack([across.real, across.imag, spin], axis=-1)
    end = simulate_closed_loop(
        lambda y: top.advance(y, regulator.inputs(regulator(y, goal)), DT, 2), y, 300
    )[-1]
    found, wanted = nutation_of(end), steady(regulator, goal, spin)
    np.testing.assert_allclose(found[:, ::2], wanted[:, ::2], rtol=0.02)


def test_what_does_not_precess_steadily_is_refused():
    with pytest.raises(ValueError, match="expected a symmetric top, I1 = I2"):
        law(top=HeavyTop(1.0, 1.1, 0.5))
    with pytest.raises(ValueError, match=r"^spins = .*; expected .*steadily at a tilt of 0\.3 rad"):
        law(spins=(1.0, 9.0))
    with pytest.raises(ValueError, match=r"^branch = 'steady'; expected one of"):
        law("steady")
    with pytest.raises(ValueError, match=r"^tilts = \(0\.9, 0\.3\); expected 0 < least < largest"):
        PrecessionRegulator(TOP, 0.5, DT, TILTS[::-1], SPINS)
    with pytest.raises(ValueError, match=r"^torque = 0; expected a positive finite number"):
        law(torque=0)
