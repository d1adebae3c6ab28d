"""Tops led into steady precession or kept upright: equations, costs, reach, and the tasks."""

from functools import cache

import numpy as np
import pytest

from rigid_envs.control import linear
from rigid_envs.mechanics import rotations
from rigid_envs.systems.heavy_top import references
from rigid_envs.systems.heavy_top.closed_forms import nutation_frequency
from rigid_envs.systems.heavy_top.controllers import (
    AsymmetricBalance,
    PivotBalance,
    PrecessionRegulator,
    UprightBalance,
    axis_of,
    nutation_of,
    vertical_of,
)
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.heavy_top.tasks.sleeping_top import SleepingTopRandom
from rigid_envs.systems.heavy_top.tasks.top_precession import TopPrecession
from tests.refusals import refuses
from tests.systems.claims import assert_optimal
from tests.systems.runs import bound, run

# Tops led into steady precession or kept upright: linear equations, costs and reach.


TOP = HeavyTop(1.2, 1.2, 0.6, m=0.8, g=9.5, ell=0.13)
DT, FREE = 0.05, 1e9  # the latter: no limit
TILTS = (0.3, 0.9)
SPINS = (1.1 * TOP.critical_spin, 2.0 * TOP.critical_spin)
BRANCHES = ("slow", "fast")


@cache
def precessing(branch="slow", torque=FREE, top=TOP, spins=SPINS):
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


@pytest.mark.parametrize("branch", BRANCHES)
@pytest.mark.parametrize(("tilt", "share"), [(0.4, 1.2), (0.9, 1.9)])
def test_the_linear_equation_is_that_of_the_steps_of_the_top(branch, tilt, share):
    regulator, spin = precessing(branch), share * TOP.critical_spin
    x0 = steady(regulator, tilt, spin)
    y0 = nutating(x0, spin)
    G0 = rotations.rotate_inverse(y0[:4], [0.0, 0.0, 1.0])[:2]
    n = G0 / np.linalg.norm(G0)
    frame = np.array([n, [-n[1], n[0]]])  # n and l in body axes at the beginning

    def advance(x, u):
        # x and u are moved one at a time: where u is not 0, n is that of x0
        held = regulator.inputs(u @ frame / FREE)
        return nutation_of(TOP.advance(nutating(x, spin), held, DT, 16))

    F, G = linear.step_jacobian(advance, x0, 2)
    K, P = regulator.regulator(tilt, spin)
    costs = np.diag([100.0, 10.0, 10.0]), 3.0 * np.eye(2)
    assert_optimal(F, G, K, P, *costs, rtol=1e-5, atol=1e-5 * np.abs(P).max())
    free = np.linalg.eigvals(F)
    rate = float(regulator.steady_rate(tilt, spin))
    nod = float(nutation_frequency(tilt, rate, spin, i_perp=TOP.I1, i3=TOP.I3))
    expected = np.array([1.0, np.exp(1j * nod * DT), np.exp(-1j * nod * DT)])
    np.testing.assert_allclose(np.sort_complex(free), np.sort_complex(expected), atol=1e-5)


@pytest.mark.parametrize("branch", BRANCHES)
def test_the_riccati_value_is_the_sum_of_the_costs_and_decreases(branch):
    regulator, rng = precessing(branch), np.random.default_rng(0)
    goal, spin = np.full(20, TILTS[0]), np.full(20, SPINS[1])  # a node of the table
    x0 = steady(regulator, goal, spin)
    states = linear.simulate_closed_loop(
        step(regulator, goal), nutating(x0 + 1e-5 * rng.normal(size=(20, 3)), spin), 60
    )
    x = nutation_of(states[:-1]) - x0
    u = FREE * regulator(states[:-1], goal)
    cost = x**2 @ [100.0, 10.0, 10.0] + 3.0 * np.sum(u**2, axis=-1)
    value = regulator.value(states, goal)
    # 1e-5 of it is not linear, and the steps of the fast branch are good to some 1e-5
    np.testing.assert_allclose(cost.sum(axis=0), value[0] - value[-1], rtol=1e-3)
    far = nutating(x0 + [0.05, 0.1, 0.05] * rng.normal(size=(20, 3)), spin)
    value = regulator.value(linear.simulate_closed_loop(step(regulator, goal), far, 40), goal)
    assert (np.diff(value, axis=0) < 0.0).all()


@pytest.mark.parametrize("branch", BRANCHES)
def test_limited_torque_damps_the_nutation_from_where_the_controller_says(branch):
    top, rng = HeavyTop(), np.random.default_rng(0)
    regulator = precessing(branch, 0.5, top, (top.critical_spin, 2.0 * top.critical_spin))
    goal, spin = rng.uniform(0.3, 0.9, 200), top.critical_spin * rng.uniform(1.2, 2.0, 200)
    across = rng.uniform(0.0, 1.0, 200) ** 0.5 * np.exp(2j * np.pi * rng.random(200))
    y = nutating(np.stack([rng.uniform(0.0, 1.2, 200), *np.zeros((2, 200))], axis=-1), spin)
    y[:, 4:7] = np.stack([across.real, across.imag, spin], axis=-1)
    end = linear.simulate_closed_loop(
        lambda y: top.advance(y, regulator.inputs(regulator(y, goal)), DT, 2), y, 300
    )[-1]
    found, wanted = nutation_of(end), steady(regulator, goal, spin)
    np.testing.assert_allclose(found[:, ::2], wanted[:, ::2], rtol=0.02)


def test_what_does_not_precess_steadily_is_refused():
    refuses("expected a symmetric top, I1 = I2", precessing, top=HeavyTop(1.0, 1.1, 0.5))
    refuses(r"^spins = .*; expected .*steadily at a tilt of 0\.3 rad", precessing, spins=(1.0, 9.0))
    refuses(r"^branch = 'steady'; expected one of", precessing, "steady")
    with pytest.raises(ValueError, match=r"^tilts = \(0\.9, 0\.3\); expected 0 < least < largest"):
        PrecessionRegulator(TOP, 0.5, DT, TILTS[::-1], SPINS)


E_Z = np.array([0.0, 0.0, 1.0])


@cache
def controllers(limit, top=TOP):
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


def upright_step(controller, n_substeps=2):
    return lambda y: controller.top.advance(y, controller.inputs(controller(y)), DT, n_substeps)


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


@pytest.mark.parametrize("controller", controllers(FREE))
@pytest.mark.parametrize("spin", [0.0, 0.7, -3.0, 5.0])
def test_the_complex_equation_is_the_linearisation_of_the_steps_of_the_top(controller, spin):
    n = len(controller.regulator(spin).riccati)

    def advance(x, u):
        whole = np.concatenate([x, np.zeros((len(x), 8 - 2 * n))], axis=-1)
        y = TOP.advance(leaning(whole, spin), controller.inputs(u / FREE), DT, 8)
        pairs = axis_of(y)[:, :n]
        return np.stack([pairs.real, pairs.imag], axis=-1).reshape(len(x), -1)

    F, G = linear.step_jacobian(advance, np.zeros(2 * n), 2)
    K, P = controller.regulator(spin)
    costs = [np.diag(np.repeat(part, 2)) for part in controller._weights]
    # of the real system, whose Jacobian is known to 1e-9
    atol = 1e-6 * np.abs(P).max()
    assert_optimal(F, G, real(K), real(P), *costs, most=1.0 - 1e-3, rtol=1e-7, atol=atol)


@pytest.mark.parametrize("controller", controllers(FREE))
def test_the_riccati_value_is_the_sum_of_the_costs_and_decreases_of_an_upright_top(controller):
    rng = np.random.default_rng(0)
    spin = TOP.critical_spin * 0.4  # a node of the table
    y = leaning(1e-4 * rng.normal(size=(20, 8)), spin)
    states, n = linear.simulate_closed_loop(upright_step(controller), y, 200), controller._n
    x, u = axis_of(states[:-1])[..., :n], FREE * controller(states[:-1])
    cost = np.abs(x) ** 2 @ controller._weights[0] + controller._weights[1][0] * np.sum(
        u**2, axis=-1
    )
    value = controller.value(states)
    # what is not linear is of third order in the tilt, 1e-8 of the rest, and steps are good to 1e-7
    np.testing.assert_allclose(cost.sum(axis=0), value[0] - value[-1], rtol=1e-5)
    value = controller.value(
        linear.simulate_closed_loop(
            upright_step(controller), leaning(0.05 * rng.normal(size=(100, 8)), spin), 100
        )
    )
    assert (np.diff(value, axis=0) < 0.0).all()


@pytest.mark.parametrize(
    ("controller", "spread"), list(zip(controllers(FREE), (0.15, 0.05), strict=True))
)
def test_between_the_nodes_and_for_tops_that_are_a_little_different_the_loop_is_stable(
    controller, spread
):
    rng, held = np.random.default_rng(0), []
    for _ in range(30):
        factors = rng.uniform(1.0 - spread, 1.0 + spread, 4)
        I1, I3, m, ell = factors * [TOP.I1, TOP.I3, TOP.m, TOP.ell]
        other = type(controller)(HeavyTop(I1, I1, I3, m, TOP.g, ell), FREE, DT)
        spin = rng.uniform(-1.4, 1.4) * TOP.critical_spin
        F, G = linear.zero_order_hold(*other.model(spin), DT)
        held.append(np.abs(np.linalg.eigvals(F - G @ controller._table(spin).gain)).max())
    assert max(held) < 1.0


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_torque_brings_back_nearly_every_tilt_that_any_torque_can(share):
    top, controller = HeavyTop(), controllers(0.3, HeavyTop())[0]

    def succeeds(turn):
        y = top.state(q=rotations.exp(turn), omega_body=share * top.critical_spin * E_Z)
        return top.tilt(linear.simulate_closed_loop(upright_step(controller), y, 300)[-1]) < 0.05

    bound = 0.3 / np.sqrt(1.0 - share**2)
    directions = bound * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.6, 0.8, 0.0]])
    found = linear.region_of_attraction(
        succeeds, directions, np.append(0.5, np.arange(0.9, 1.2, 0.01))
    )
    assert (found > 0.95 - 1e-9).all()
    assert (found < 1.0 + 0.3 * bound**2).all()  # the linear bound, but for second order


def test_the_pivot_brings_back_a_tilt_within_five_metres():
    top = HeavyTop()
    controller = PivotBalance(top, 3.0, DT)

    def succeeds(turn):
        y = top.state(q=rotations.exp(turn), omega_body=0.3 * top.critical_spin * E_Z)
        states = linear.simulate_closed_loop(upright_step(controller), y, 400)
        away = np.linalg.norm(top.pivot(states), axis=-1)
        return (top.tilt(states[-1]) < 0.05) & (away < 5.0).all(axis=0) & (away[-1] < 0.1)

    found = linear.region_of_attraction(
        succeeds, [[1.0, 0.0, 0.0], [-0.6, 0.8, 0.0]], np.arange(0.02, 0.2, 0.01)
    )
    np.testing.assert_allclose(found, 0.16, atol=1e-9)


def test_tops_without_symmetry_or_weight_and_limits_that_are_none_are_refused():
    refuses("expected a symmetric top, I1 = I2", UprightBalance, HeavyTop(1.0, 1.1, 0.5), 0.3, DT)
    for controller, top in ((UprightBalance, HeavyTop(g=0.0)), (PivotBalance, HeavyTop(ell=0.0))):
        refuses(r"^top = HeavyTop\(.*; expected a top that can fall", controller, top, 0.3, DT)


UNEVEN = HeavyTop(0.925, 1.15, 0.55)
PRICES = np.array([1.0, 1.0, 0.1, 0.1]), 0.03


@cache
def uneven(torque=FREE, top=UNEVEN):
    return AsymmetricBalance(top, torque, DT, fastest=3.0)


def tilting(x, spin, heading=0.7):
    """States with x = (G1, G2, omega1, omega2) and a spin; the heading makes no difference."""
    up = np.sqrt(1.0 - x[..., 0] ** 2 - x[..., 1] ** 2)
    q = np.stack([1.0 + up, x[..., 1], -x[..., 0], 0.0 * up], axis=-1)
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    q = rotations.multiply(rotations.exp([0.0, 0.0, heading]), q)
    rest = np.zeros((*up.shape, 5))
    rest[..., 0] = spin
    return np.concatenate([q, x[..., 2:], rest], axis=-1)


def test_the_vertical_is_read_off_at_any_heading():
    x = 0.3 * np.random.default_rng(0).normal(size=(50, 4))
    for heading in (0.0, 2.0):
        np.testing.assert_allclose(vertical_of(tilting(x, 1.0, heading)), x, atol=1e-15)


@pytest.mark.parametrize("spin", [0.0, 1.7, -2.5])
def test_the_linear_equation_is_that_of_the_steps_of_the_top_of_an_uneven_top(spin):
    balance = uneven()

    def advance(x, u):
        whole = np.concatenate([u, 0.0 * u[:, :1]], axis=-1) / FREE
        return vertical_of(UNEVEN.advance(tilting(x, spin), balance.inputs(whole), DT, 8))

    F, G = linear.step_jacobian(advance, np.zeros(4), 2)
    K, P = balance.regulator(spin)
    costs, atol = (np.diag(PRICES[0]), PRICES[1] * np.eye(2)), 1e-7 * np.abs(P).max()
    assert_optimal(F, G, K, P, *costs, rtol=1e-7, atol=atol)  # the Jacobian is known to 1e-9


def test_between_the_nodes_and_for_every_drawn_body_the_loop_is_stable():
    balance, rng, found = uneven(), np.random.default_rng(0), []
    for moments in rng.uniform([0.85, 1.05, 0.45], [1.0, 1.25, 0.65], (30, 3)):
        other, spin = uneven(top=HeavyTop(*moments)), rng.uniform(-3.0, 3.0)
        F, G = linear.zero_order_hold(*other.model(spin), DT)
        found.append(np.abs(np.linalg.eigvals(F - G @ balance._table(spin).gain)).max())
    assert max(found) < 0.995


@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_from_the_fastest_spin_on_the_gains_are_those_of_it(sense):
    balance, x = uneven(0.3), np.array([0.01, -0.02, 0.03, 0.01])
    K, P = balance.regulator(3.0 * sense)
    for spin in (3.0 * sense, 4.0 * sense):
        expected = np.append(-K @ x / 0.3, 0.0)  # no torque about e3
        np.testing.assert_allclose(balance(tilting(x, spin)), expected, rtol=1e-12)
        np.testing.assert_allclose(balance.value(tilting(x, spin)), x @ P @ x, rtol=1e-12)


@pytest.mark.parametrize("spin", [-2.0, 0.0, 1.0])
def test_limited_torque_brings_back_the_tilts_that_the_controller_says(spin):
    balance = uneven(0.3)

    def step(y):
        return UNEVEN.advance(y, balance.inputs(balance(y)), DT, 2)

    def succeeds(turn):
        y = UNEVEN.state(q=rotations.exp(turn), omega_body=[0.0, 0.0, spin])
        return UNEVEN.tilt(linear.simulate_closed_loop(step, y, 300)[-1]) < 0.05

    angle = np.linspace(0.0, np.pi, 12)
    directions = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    assert (linear.region_of_attraction(succeeds, directions, [0.1, 0.2, 0.3]) == 0.3).all()


# Tops that are led into steady precession, or can be caught.


@pytest.mark.parametrize("branch", ["slow", "fast"])
def test_linear_feedback_leads_into_steady_precession_from_every_start(branch):
    found = run("TopPrecession", bound(references.precession_regulator), branch=branch)
    assert found.success.mean() >= 0.99


def test_the_regulator_of_precession_has_gains_for_all_tilts_and_spins_of_the_task(monkeypatch):
    made, task = {}, TopPrecession(goal_tilt=0.6, goal_spread=0.2, start_spread=0.1)
    regulator = "rigid_envs.systems.heavy_top.controllers.PrecessionRegulator"
    monkeypatch.setattr(regulator, lambda *_, **settings: made.update(settings))
    references.precession_regulator(task)
    slowest = task.system().critical_spin
    assert made["tilts"] == pytest.approx((0.6, 0.8))
    assert made["spins"] == pytest.approx((slowest, slowest * (task.start_spin + 0.1)))


@pytest.mark.parametrize("spin", [0.0, 20.0])
def test_the_balance_of_an_uneven_top_has_gains_for_the_fastest_spin_of_the_task(spin):
    settings = {"start_spin": spin, "n_substeps": 10}
    found = run("TopRandom", bound(references.asymmetric_balance), n=10, **settings)
    assert found.success.all()


def test_every_drawn_top_can_be_caught_by_the_torque_there_is():
    """A start is caught if ``m g ell theta sqrt(1 - share^2) < torque`` (see the task)."""
    task = SleepingTopRandom()
    heaviest = task.m[1] * task.g * task.ell[1]
    worst = heaviest * task.start_tilt * np.sqrt(1.0 - task.start_spin_low**2)
    assert worst < 0.85 * task.torque
