"""Predictive control and sampling: problems whose optimum is known, plans that happen."""

import itertools
from typing import ClassVar

import numpy as np
import pytest

from rigid_envs import systems
from rigid_envs.control import predictive
from rigid_envs.mechanics import rotations
from rigid_envs.systems.dynamic_ball.controllers import HeldBall
from rigid_envs.systems.free_body.controllers import HeldSpin
from rigid_envs.systems.heavy_top.controllers import BalancedTop
from tests.refusals import refuses

A = np.array([[1.0, 0.1], [0.0, 1.0]])  # a double integrator of period 0.1 s
B = np.array([[0.005], [0.1]])
Q, R = np.diag([1.0, 0.1]), np.array([[0.1]])
T = 20


def cost(x, plans):
    """Quadratic cost of plans (T, ..., 1) from x (2,)."""
    x, total = np.broadcast_to(x, (*plans.shape[1:-1], 2)), 0.0
    for u in plans:
        x = x @ A.T + u @ B.T
        total = total + np.einsum("...i,ij,...j", x, Q, x) + np.einsum("...i,ij,...j", u, R, u)
    return total


def optimum(x):
    """Least cost over the horizon, by the Riccati recursion."""
    P = np.zeros((2, 2))
    for _ in range(T):
        P = Q + P
        P = A.T @ P @ A - A.T @ P @ B @ np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    return x @ P @ x


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_plans_come_near_the_optimum_of_a_linear_quadratic_problem(correlation):
    rng = np.random.default_rng(0)
    planner = predictive.PathIntegral(
        n_samples=500, horizon=T, spread=0.1, temperature=0.3, correlation=correlation
    )
    x = np.array([0.3, 0.2])
    plan = planner.start((), 1)
    for _ in range(60):
        samples = planner.sample(plan, planner.draw(rng, 1))
        plan = planner.improve(samples, cost(x, samples))
    assert optimum(x) <= cost(x, plan)  # nothing is better
    # measured: 1 to 3 % above, the noise of a mean of some dozens of plans that count
    assert cost(x, plan) < 1.05 * optimum(x) < 0.5 * cost(x, planner.start((), 1))


def test_a_batch_of_plans_is_its_rows():
    planner, rng = predictive.PathIntegral(8, 5), np.random.default_rng(0)
    plan, draws = rng.uniform(-1.0, 1.0, (5, 3, 2)), planner.draw(rng, 2)
    samples, costs = planner.sample(plan, draws), rng.normal(size=(3, 8))
    together = planner.improve(samples, costs)
    for k in range(3):
        alone = planner.sample(plan[:, k], draws)
        np.testing.assert_array_equal(alone, samples[:, k])
        np.testing.assert_array_equal(planner.improve(alone, costs[k]), together[:, k])


def test_plans_stay_in_the_box_and_the_first_that_is_tried_is_the_plan():
    planner, rng = predictive.PathIntegral(64, 10, spread=3.0), np.random.default_rng(0)
    plan = rng.uniform(-1.0, 1.0, (10, 4, 2))
    samples = planner.sample(plan, planner.draw(rng, 2))
    np.testing.assert_array_equal(samples[:, :, 0], plan)
    assert np.abs(samples).max() == 1.0
    # a mean of numbers in the box, but for the roundings of its sum
    assert np.abs(planner.improve(samples, rng.normal(size=(4, 64)))).max() <= 1.0 + 1e-14


def test_noise_has_the_deviation_and_the_correlation_that_are_asked_for():
    planner = predictive.PathIntegral(20_000, 4, spread=0.1, correlation=0.6, finest=1.0)
    e = planner.draw(np.random.default_rng(0), 1)[:, 1:, 0].T
    # 5 standard errors of 20 000 draws: 5 / sqrt(n) of a correlation, 5 / sqrt(2 n) of a deviation
    np.testing.assert_allclose(e.std(axis=0), 0.1, rtol=0.025)
    for now, later in itertools.pairwise(e.T):
        np.testing.assert_allclose(np.corrcoef(now, later)[0, 1], 0.6, atol=0.036)


def test_weights_do_not_depend_on_unit_or_origin_of_costs():
    costs = np.random.default_rng(0).normal(size=(5, 40))
    w = predictive.weights(costs, 0.2)
    np.testing.assert_allclose(w.sum(axis=-1), 1.0, rtol=1e-14)
    # a shift by 100 loses two digits of the costs, which the temperature multiplies by 25 or so
    np.testing.assert_allclose(predictive.weights(7.0 * costs + 100.0, 0.2), w, rtol=1e-11)
    assert (np.argmax(w, axis=-1) == np.argmin(costs, axis=-1)).all()
    assert (predictive.weights(costs, 1e-6).max(axis=-1) > 0.999).all()
    np.testing.assert_array_equal(predictive.weights(np.full(8, 3.0), 0.1), 1.0 / 8.0)


@pytest.mark.parametrize(("n_samples", "n"), [(2, 1), (39, 1), (40, 2), (100, 5)])
def test_the_temperature_is_a_part_of_the_span_of_the_least_twentieth(n_samples, n):
    w = predictive.weights(np.random.default_rng(0).normal(size=n_samples), 0.2)
    assert np.sort(w)[-1 - n] == pytest.approx(w.max() * np.exp(-1.0 / 0.2))


def test_how_badly_the_worst_fail_does_not_matter():
    costs = np.sort(np.random.default_rng(0).normal(size=(5, 100)))
    fallen = costs + np.where(np.arange(100) < 50, 0.0, 1e6)  # half of the rollouts
    w, w_fallen = predictive.weights(costs, 0.2)[:, :50], predictive.weights(fallen, 0.2)[:, :50]
    np.testing.assert_allclose(w_fallen / w_fallen[:, :1], w / w[:, :1], rtol=1e-14)


def test_choices_are_drawn_as_the_plan_says():
    planner = predictive.CrossEntropyChoices(40_000, 2, 3)
    plan = np.array([[0.2, 0.5, 0.3], [0.0, 0.0, 1.0]])
    drawn = planner.sample(plan, planner.draw(np.random.default_rng(0)))[..., 0]
    share = np.stack([np.bincount(row, minlength=3) for row in drawn]) / 40_000
    np.testing.assert_allclose(share, plan, atol=5 * 0.5 / 200)  # 5 standard errors at most
    least = planner.sample(plan, np.zeros((2, 1)))  # nor is one without probability
    np.testing.assert_array_equal(least.ravel(), [0, 2])


def test_choices_find_a_hidden_sequence():
    rng = np.random.default_rng(0)
    hidden = rng.integers(0, 4, 12)
    planner = predictive.CrossEntropyChoices(200, 12, 4)
    plan = planner.start(())
    for _ in range(20):
        samples = planner.sample(plan, planner.draw(rng))
        plan = planner.improve(samples, (samples[..., 0].T != hidden).sum(axis=-1))
    np.testing.assert_array_equal(plan.argmax(axis=-1), hidden)
    np.testing.assert_allclose(plan.sum(axis=-1), 1.0, rtol=1e-14)


def test_a_plan_moves_on_by_one_step():
    planner = predictive.PathIntegral(4, 3)
    np.testing.assert_array_equal(planner.shift(np.arange(6.0).reshape(3, 2))[:, 0], [2, 4, 4])
    choices = predictive.CrossEntropyChoices(4, 2, 2)
    np.testing.assert_array_equal(choices.shift(np.eye(2)), [[0.0, 1.0], [0.5, 0.5]])


@pytest.mark.parametrize("mixing", [1e-9, 0.3, 1.0])
def test_of_choices_that_are_not_drawn_only_the_uniform_share_is_left(mixing):
    plan = predictive.CrossEntropyChoices(5, 1, 4, mixing=mixing)
    share = plan.improve(np.zeros((1, 5, 1), np.int64), np.arange(5.0))
    np.testing.assert_allclose(share, [[1.0 - 0.75 * mixing, *3 * [0.25 * mixing]]], rtol=1e-14)


def test_numbers_outside_their_range_are_refused():
    refuses("n_samples = 1; expected an integer of at least 2", predictive.PathIntegral, 1, 5)
    refuses(r"correlation = 1.0; .* in \[0, 1\)", predictive.PathIntegral, 8, 5, correlation=1.0)
    refuses("n_choices = 1", predictive.CrossEntropyChoices, 8, 5, 1)
    refuses(r"mixing = 1.1; .* in \(0, 1\]", predictive.CrossEntropyChoices, 8, 5, 3, mixing=1.1)


casadi = pytest.importorskip("casadi")
PRICE = 0.1
H, K = 0.1, 20
BODY = systems.FreeBody(1.0, 2.0, 3.0)
TOP = systems.HeavyTop(1.2, 1.2, 0.6, m=0.8, g=9.5, ell=0.13)
BALL = systems.DynamicBall(radius=0.8, beta=0.5, turntable_rate=0.3)
SPIN = HeldSpin(BODY, 1.0, 0.2)
BALANCE = BalancedTop(TOP, 3.0)
TABLE = HeldBall(BALL, 0.4, 0.1, 0.1)
OFF = {"pivot": [0.4, -0.6], "pivot_velocity": [0.2, 0.3]}
UPRIGHT = TOP.state(q=rotations.exp([0.1, -0.05, 0.7]), omega_body=[0.1, -0.2, 1.5], **OFF)


class DoubleIntegrator:
    """x'' = a at quadratic cost; the speed may not exceed a limit."""

    sizes: ClassVar = (2, 1, 0)

    def __init__(self, fastest=np.inf):
        self.fastest = fastest

    def coordinates(self, y):
        return np.asarray(y)

    def step(self, x, a, h):
        assert h == H
        return casadi.DM(A) @ x + casadi.DM(B) @ a

    def cost(self, x, a, goal):
        return x.T @ casadi.DM(Q) @ x + PRICE * casadi.sumsqr(a)

    def limits(self, x, a):
        return casadi.vertcat(x[1] - self.fastest, -x[1] - self.fastest)[
            : 2 * bool(np.isfinite(self.fastest))
        ]


def riccati(x, tail):
    """The optimal actions of the double integrator without limits, and their cost."""
    P, gains = tail * Q, []
    for _ in range(K):
        gain = np.linalg.solve(B.T @ P @ B + H * PRICE, B.T @ P @ A)
        P = H * Q + A.T @ P @ (A - B @ gain)
        gains.insert(0, gain)
    actions, least = [], x @ P @ x
    for gain in gains:
        actions.append(-gain @ x)
        x = A @ x + B @ actions[-1]
    return np.array(actions), least


def test_the_plan_of_a_linear_quadratic_problem_is_that_of_riccati():
    controller = predictive.PredictiveControl(DoubleIntegrator(), (H,) * K, tail=2.0)
    x = np.array([0.2, 0.1])
    plan = controller.plan(x)
    assert plan.is_solved
    expected, least = riccati(x, 2.0)
    assert np.abs(expected).max() < 1.0  # no limit is met
    # a barrier of 1e-5 or so keeps actions off their limits, more where they matter less
    np.testing.assert_allclose(plan.actions, expected, atol=5e-3)
    assert float(cost_of(controller, x, ())(plan.actions.T)) == pytest.approx(least, rel=1e-4)


def test_limits_of_actions_and_of_what_they_lead_to_hold():
    controller = predictive.PredictiveControl(DoubleIntegrator(fastest=0.5), (H,) * 40, tail=2.0)
    plan = controller.plan([2.0, 0.0])
    assert plan.is_solved
    assert np.abs(plan.actions).max() == pytest.approx(1.0, abs=1e-3)
    assert np.abs(plan.states[:, 1]).max() == pytest.approx(0.5, abs=1e-3)
    controller = predictive.PredictiveControl(DoubleIntegrator(), (H,) * 40)
    for far in (-2e3, 2e3):  # IPOPT goes 1e-8 beyond
        assert np.abs(controller.plan([far, 0.0]).actions).max() == 1.0


def test_a_plan_is_found_again_from_itself():
    controller = predictive.PredictiveControl(DoubleIntegrator(), (H,) * K)
    first = controller.plan([1.5, -0.3])
    again = controller.plan([1.5, -0.3], near=first)
    np.testing.assert_allclose(again.actions, first.actions, atol=1e-2)  # the barrier


def test_the_rest_of_a_plan_is_what_was_planned_for_later():
    controller = predictive.PredictiveControl(DoubleIntegrator(), (0.1, 0.1, 0.2, 0.4), 1.0)
    states = np.array([[0.0, 1.0], [0.1, 1.0], [0.2, 1.0], [0.4, 1.0], [0.8, 1.0]])
    actions = np.arange(4.0)[:, None]
    rest = controller.later(predictive.Prediction(actions, states, True), 0.1)
    np.testing.assert_allclose(rest.states[:, 0], [0.1, 0.2, 0.3, 0.5, 0.8], atol=1e-12)
    np.testing.assert_array_equal(rest.actions[:, 0], [1.0, 2.0, 2.0, 3.0])


def advanced(problem, y, a, h, n_substeps=1):
    """The state of the system after an action, by its own integrator."""
    if problem is SPIN:
        return BODY.advance(y, 0.2 * a, h, n_substeps)
    if problem is BALANCE:
        return TOP.advance(y, np.concatenate([np.zeros(6), 3.0 * a]), h, n_substeps)
    return BALL.advance(y, [0.0, 0.0, *(0.4 * a - y[11:]) / h], h, n_substeps)


STARTS = {
    SPIN: BODY.state(q=[0.0, 0.6, 0.0, 0.8], omega_body=[0.2, 0.9, -0.1]),
    BALANCE: UPRIGHT,
    TABLE: BALL.state(position=[1.0, 0.2], velocity=[0.1, -0.2], tilt=[0.05, 0.0], spin=0.3),
}
GOALS = {SPIN: (), BALANCE: (), TABLE: (0.3, 0.4)}
each_problem = pytest.mark.parametrize("problem", STARTS, ids=lambda each: type(each).__name__)


@each_problem
def test_a_step_in_coordinates_is_a_step_of_the_system(problem):
    rng = np.random.default_rng(0)
    n, m, _ = problem.sizes
    x, a = casadi.SX.sym("x", n), casadi.SX.sym("a", m)
    step = casadi.Function("step", [x, a], [problem.step(x, a, 0.05)])
    y = STARTS[problem]
    for _ in range(10):
        action = rng.uniform(-0.7, 0.7, m)
        found = np.array(step(problem.coordinates(y), action))[:, 0]
        y = advanced(problem, y, action, 0.05)
        np.testing.assert_allclose(found, problem.coordinates(y), rtol=0, atol=1e-12)


@each_problem
def test_plans_are_solved_and_are_what_happens(problem):
    controller = predictive.PredictiveControl(problem, predictive.doubling(0.1, 4, 4, 4))
    y, goal = STARTS[problem], GOALS[problem]
    plan = controller.plan(y, goal)
    assert plan.is_solved
    for a, x in zip(plan.actions[:4], plan.states[1:], strict=False):
        y = advanced(problem, y, a, 0.1, 2)
        # gaps are closed to the solver's tolerance
        np.testing.assert_allclose(problem.coordinates(y), x, rtol=0, atol=2e-3)


def cost_of(controller, y, goal):
    """Cost of actions that are rolled out, as a function of them, shape (m, K)."""
    m = controller.problem.sizes[1]
    actions = casadi.SX.sym("a", m, len(controller.intervals))
    x, total = casadi.DM(controller.problem.coordinates(y)), 0.0
    for k, h in enumerate(controller.intervals):
        total += h * controller.problem.cost(x, actions[:, k], casadi.DM(goal))
        x = controller.problem.step(x, actions[:, k], h)
    total += controller.tail * controller.problem.cost(x, casadi.DM.zeros(m), casadi.DM(goal))
    return casadi.Function("cost", [actions], [total])


def told(problem, y, a):
    """The cost at the goal (0, 0), by its docstring."""
    omega, pivot = y[4:7], y[7:]
    if problem is SPIN:
        return 0.2 * np.linalg.norm(a) + np.sum((omega - [0.0, 1.0, 0.0]) ** 2)
    if problem is BALANCE:
        off = 2.0 - 2.0 * np.cos(TOP.tilt(y)) + omega[0] ** 2 + omega[1] ** 2
        place, speed = np.sum(pivot[:2] ** 2), np.sum(pivot[2:] ** 2)
        return 3.0 * np.linalg.norm(a) + 3.0 * (off + 0.05 * place + 0.2 * speed)
    return np.hypot(y[4], y[5]) + 0.01 * np.sum(y[11:] ** 2)


@each_problem
def test_the_cost_is_the_one_that_is_told(problem):
    n, m, n_goal = problem.sizes
    x, a = casadi.SX.sym("x", n), casadi.SX.sym("a", m)
    cost = casadi.Function("cost", [x, a], [problem.cost(x, a, casadi.DM.zeros(n_goal))])
    rng, y = np.random.default_rng(0), STARTS[problem]
    # lengths, weighed by 3, are rounded off by 0.01, and those above 0.9 by 0.05
    for size, error in 5 * [(0.0, 0.03), (0.3, 2e-3)]:
        action = rng.choice([-1.0, 1.0], m) * rng.uniform(size, 0.7, m)
        found = float(cost(problem.coordinates(y), action))
        assert found == pytest.approx(told(problem, y, action), abs=error)
        y = advanced(problem, y, action, 0.05)


@pytest.mark.long
@pytest.mark.push
@each_problem
def test_no_plan_beside_it_costs_less(problem):
    controller = predictive.PredictiveControl(problem, predictive.doubling(0.1, 4, 4, 2))
    y, goal = STARTS[problem], GOALS[problem]
    plan, cost = controller.plan(y, goal), cost_of(controller, y, goal)
    least = float(cost(plan.actions.T))
    rng = np.random.default_rng(1)
    for spread in (0.003, 0.03, 0.3):
        for _ in range(30):
            trial = plan.actions + spread * rng.normal(size=plan.actions.shape)
            length = np.linalg.norm(trial, axis=-1, keepdims=True)
            inside = trial / np.maximum(length, 1.0) if problem is BALANCE else trial
            other = np.clip(inside, -1.0, 1.0)
            assert float(cost(other.T)) > least * (1.0 - 1e-3)


def test_the_table_can_always_stop_within_its_limit():
    controller = predictive.PredictiveControl(TABLE, predictive.doubling(0.1, 4, 8, 3))
    plan = controller.plan(BALL.state(position=[2.0, 0.0]), [-1.0, 0.5])
    x = plan.states
    stops = x[:, 5:7] + 0.05 * x[:, 7:]
    assert np.abs(stops).max() == pytest.approx(0.1, abs=2e-4)  # and it is used


def test_tops_without_symmetry_and_numbers_that_are_none_are_refused():
    refuses("expected a symmetric top, I1 = I2", BalancedTop, systems.HeavyTop(1.0, 1.1, 0.5), 3.0)
    with pytest.raises(ValueError, match=r"^intervals\[1\] = -0\.1; expected positive"):
        predictive.PredictiveControl(SPIN, (0.1, -0.1))
    controller = predictive.PredictiveControl(TABLE, (0.1,))
    refuses(r"^goal has shape \(0,\); expected \(2,\)", controller.plan, BALL.state())
    with pytest.raises(ValueError, match=r"^y has shape \(2, 13\); expected \(n_state,\)"):
        controller.plan(np.stack([BALL.state()] * 2), [0.0, 0.0])
