"""Rollouts and their linearisation against the environment, and its convex problem."""

import gymnasium as gym
import numpy as np
import pytest
from scipy.optimize import minimize

import rigid_envs.control.planning.model as planning
from rigid_envs.control.planning.descent import Subproblem, square_root
from rigid_envs.control.planning.model import (
    Limits,
    Linear,
    Model,
    Tracking,
    conditions_of,
    tracking_gains,
)
from rigid_envs.engine.layout import FLAGS
from rigid_envs.envs.lookup import task_of
from rigid_envs.mechanics import rotations
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.finding import recipe_of
from rigid_envs.scores.policies import untrained_policies
from rigid_envs.scores.starts import row_seeds
from rigid_envs.systems.heavy_top.closed_forms import steady_precession
from rigid_envs.systems.heavy_top.controllers import nutation_of
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.refusals import refuses

# Rollouts and their linearisation, against the environment itself.


IDS = [env_id for env_id in ENVIRONMENTS if recipe_of(env_id)]
ONE_EACH = {conditions_of(task_of(env_id)): env_id for env_id in IDS}.values()
OTHERS = [pytest.param(i, marks=pytest.mark.long) for i in IDS if i not in ONE_EACH]
SEED = 7
SUFFICIENT = ("RigidEnvs/BallSteer-v0", "RigidEnvs/WheelTrack-v0")  # they ask for a mean


def model_of(env_id, n, n_steps, counts="cost"):
    envs = make_rows(env_id, n)
    envs.reset(seed=row_seeds(SEED, n, "test"))
    return Model(task_of(env_id), envs.get_state(), n_steps, counts)


def some_actions(model, n_steps, scale=0.5):
    rng = np.random.default_rng(0)
    return scale * rng.uniform(-1.0, 1.0, (n_steps, model.n_rows, len(model.limits.counted)))


@pytest.mark.parametrize("env_id", IDS)
def test_a_rollout_is_that_of_the_environment(env_id):
    n, n_steps = 3, 12
    model = model_of(env_id, n, n_steps)
    motion = model.roll(some_actions(model, n_steps))
    for row, seed in enumerate(row_seeds(SEED, n, "test")):
        env = gym.make(env_id)
        env.reset(seed=seed)
        cost = 0.0
        for action in motion.actions[:, row]:
            cost += env.step(action)[4]["cost"]
        assert cost == motion.costs[row]
        np.testing.assert_array_equal(env.unwrapped.get_state()["y"].ravel(), motion.y[-1, row])


def largest_errors(model, motion):
    """Largest norm of an error after each step, over its tolerance, shape (T, N)."""
    return np.max(
        [np.linalg.norm(motion.errors[..., group], axis=-1) for group in model.groups], axis=0
    )


@pytest.mark.parametrize("env_id", ["RigidEnvs/BallSteer-v0", "RigidEnvs/DiskRoll-v0"])
def test_errors_of_what_is_followed_are_those_that_the_environment_pays_for(env_id):
    n, n_steps = 3, 12
    model = model_of(env_id, n, n_steps, "error")
    motion, record = model.roll(some_actions(model, n_steps)), ENVIRONMENTS[env_id].error
    scale = model.task.bound if "Steer" in env_id else model.task.tolerance
    for row, seed in enumerate(row_seeds(SEED, n, "test")):
        env = gym.make(env_id)
        env.reset(seed=seed)
        terms = [env.step(action)[4][f"reward/{record.term}"] for action in motion.actions[:, row]]
        errors = (1.0 / np.array(terms) - 1.0) / record.sharpness
        found = scale * np.linalg.norm(motion.errors[:, row], axis=-1)
        np.testing.assert_allclose(found, errors, rtol=1e-9)
        assert scale * motion.costs[row] == pytest.approx(np.sqrt(np.mean(errors**2)))


@pytest.mark.parametrize("env_id", [i for i in (*ONE_EACH, *OTHERS) if i not in SUFFICIENT])
def test_the_errors_say_what_success_is(env_id):
    record = gym.spec(env_id)
    n, T = 6, record.max_episode_steps
    config = {"spin_rate": 0.8} if hasattr(task_of(env_id), "spin_rate") else {}
    envs = make_rows(env_id, n, config)
    seen, _ = envs.reset(seed=row_seeds(SEED, n, "test"))
    start = envs.get_state()
    model = Model(envs.task, start, T)
    name = next(iter(untrained_policies(env_id)))
    name = {"shortest_path": "three_rolls"}.get(name, name)
    act, actions = untrained_policies(env_id)[name](envs), []
    for _ in range(T):
        actions.append(act(seen))
        seen = envs.step(actions[-1])[0]
    motion = model.roll(np.array(actions, dtype=np.float64))
    sizes = largest_errors(model, motion)
    if (model.first == T).all():  # success is one step
        met = (sizes <= 1.0).any(axis=0)
    else:
        met = np.array(
            [(sizes[first - 1 :, k] <= 1.0).all() for k, first in enumerate(model.first)]
        )
    assert met.any()
    np.testing.assert_array_equal(met, motion.successes)
    core, before, won = Core(model.task, n), [], []
    core.set_state(start)
    for action, size in zip(motion.actions, sizes, strict=True):
        before.append(core.get_state())
        core.actions[...] = action
        core.step()
        won.append(core.flags[FLAGS.is_success].copy())
        if "held" in model.task.aux_names:  # the time of success so far
            held = core.auxiliary("held")
            np.testing.assert_array_equal(size <= 1.0, held > 0.0)
            np.testing.assert_array_equal(won[-1], held > T - model.first)  # so many steps
    # the first step to succeed again, each component by itself moved until none does any more
    t, row = np.argwhere(won)[0]
    away = np.kron(np.geomspace(1e-3, 0.5, 50)[:, None], np.eye(core.y.shape[1])[model.index])
    state = {key: part[[row]].repeat(len(away), axis=0) for key, part in before[t].items()}
    moved = Model(model.task, state | {"y": state["y"] + away}, 1)
    motion = moved.roll(motion.actions[[t]][:, [row]].repeat(len(away), axis=1))
    np.testing.assert_array_equal(largest_errors(moved, motion)[0] <= 1.0, motion.successes)
    assert 0 < motion.successes.sum() < len(away)


@pytest.mark.parametrize("env_id", IDS)
def test_the_linearisation_is_that_of_small_changes(env_id):
    n_steps, h = 5, 1e-3
    model = model_of(env_id, 4, n_steps)
    model.first = np.ones(4, dtype=np.int64)
    actions = some_actions(model, n_steps).astype(np.float32).astype(np.float64)
    motion = model.roll(actions)
    linear = model.linearise(motion)
    change = h * some_actions(model, n_steps, 1.0)
    ahead, behind = (model.roll(actions + s * change) for s in (1.0, -1.0))
    applied = 0.5 * (ahead.actions.astype(np.float64) - behind.actions)
    x = np.zeros(linear.A.shape[1:3])
    for t in range(n_steps):
        e = (linear.Ey[t] @ x[..., None] + linear.Ea[t] @ applied[t][..., None])[..., 0]
        x = (linear.A[t] @ x[..., None] + linear.B[t] @ applied[t][..., None])[..., 0]
        seen = 0.5 * (model.coordinates(ahead.y[t + 1]) - model.coordinates(behind.y[t + 1]))
        np.testing.assert_allclose(x, seen, atol=2e-5 * max(1.0, np.abs(seen).max() / h))
        shown = 0.5 * (ahead.errors[t] - behind.errors[t])
        np.testing.assert_allclose(e, shown, atol=1e-2 * np.abs(shown).max() + 1e-6)


def test_it_does_not_matter_which_steps_are_linearised_together(monkeypatch):
    model = model_of("RigidEnvs/PivotTop-v0", 3, 8)
    motion = model.roll(some_actions(model, 8))
    whole = model.linearise(motion)
    monkeypatch.setattr(planning, "_TOGETHER", 3 * 3 * (len(model.index) + model.n_actions))
    for one, other in zip(model.part(np.arange(3)).linearise(motion), whole, strict=True):
        np.testing.assert_array_equal(one, other)  # 0 .. 2, 3 .. 5, 5 .. 7


def test_the_linearisation_does_not_depend_on_roundings_of_the_length_of_an_attitude():
    n = 1000
    model = model_of("RigidEnvs/BallPark-v0", 1, 2).part(np.zeros(n, dtype=np.int64))
    motion = model.roll(np.full((2, n, 2), 0.3))
    motion.y[1, :, :4] *= 1.0 + np.geomspace(1e-15, 1e-11, n)[:, None]
    linear = model.linearise(motion)
    changes = linear.A[1] @ linear.B[0]  # differ by 1e-7, measured
    np.testing.assert_allclose(changes, np.tile(changes[:1], (n, 1, 1)), rtol=0, atol=2e-6)


def test_a_task_without_conditions_and_another_one_of_the_name_of_one_with_them_have_none():
    task = type(task_of(IDS[0]))
    for other in (type(task.__name__, (task,), {})(), task_of("RigidEnvs/BallGrid-v0")):
        refuses("^task = .*; expected one of an id", conditions_of, other)


def test_tracking_gains_are_those_of_least_squares():
    T, n, m, weight, rng = 4, 3, 2, 0.7, np.random.default_rng(1)
    A, B = rng.normal(size=(T, 1, n, n)), rng.normal(size=(T, 1, n, m))
    gains = tracking_gains(Linear(A, B, A, B), weight)
    for t in range(T):
        by_x, by_u, parts = np.eye(n), np.zeros((n, T * m)), []
        for k in range(t, T):  # the states to come by this one and by the actions
            by_x, by_u = A[k, 0] @ by_x, A[k, 0] @ by_u
            by_u[:, k * m : (k + 1) * m] += B[k, 0]
            parts.append((by_x, by_u))
        X, U = (np.concatenate(each) for each in zip(*parts, strict=True))
        best = -np.linalg.solve(np.eye(T * m) / weight + U.T @ U, U.T @ X)
        np.testing.assert_allclose(gains[t, 0], best[t * m : (t + 1) * m], atol=1e-10)


def test_a_rollout_that_tracks_returns_to_the_motion_that_it_left():
    n_steps = 40
    model = model_of("RigidEnvs/SleepingTop-v0", 4, n_steps)
    plan = some_actions(model, n_steps, 0.1)
    motion = model.roll(plan)
    x = np.stack([model.coordinates(y) for y in motion.y])
    tracking = Tracking(tracking_gains(model.linearise(motion), 100.0), x[:-1])
    plan[0] += 0.5
    led, left = (
        np.linalg.norm(model.coordinates(model.roll(plan, each).y[-1]) - x[-1], axis=-1)
        for each in (tracking, None)
    )
    assert (led < 0.1 * left).all()


@pytest.mark.parametrize("config", [{}, {"flip_time": 2.0}])  # which a step ends at
def test_a_spin_that_is_due_at_a_time_is_asked_for_from_the_first_step_that_ends_then(config):
    env_id, n, T = "RigidEnvs/AxisFlip-v0", 8, 300
    envs = make_rows(env_id, n, config)
    envs.reset(seed=row_seeds(SEED, n, "test"))
    model = Model(task_of(env_id, config), envs.get_state(), T)
    left = [envs.step(np.zeros((n, 3), np.float32))[0][:, 3] for _ in range(T)]
    due = 1 + np.argmax(np.array(left) < 1e-6, axis=0)
    assert due.min() > 1
    np.testing.assert_array_equal(model.first, due)


@pytest.mark.parametrize("name", ["BallPark", "BallParkGoal", "BallParkDynamic"])
def test_errors_of_a_ball_are_its_distance_angle_and_speed_over_their_tolerances(name):
    n, home = 8, np.eye(1, 6)
    model = model_of(f"RigidEnvs/{name}-v0", n, 5)
    motion, task = model.roll(some_actions(model, 5)), model.task
    goal = model._state["aux"] if task.n_goal else np.tile(home, (n, 1))
    for y, errors in zip(motion.y[1:], motion.errors, strict=True):
        expected = [
            np.linalg.norm(y[:, 4:6] - goal[:, 4:], axis=1) / task.position_tolerance,
            rotations.distance(y[:, :4], goal[:, :4]) / task.angle_tolerance,
        ]
        if name == "BallParkDynamic":
            expected.append(np.linalg.norm(y[:, 6:8], axis=1) / task.speed_tolerance)
        found = [np.linalg.norm(errors[:, group], axis=1) for group in model.groups]
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_errors_of_a_precession_are_above_0_where_it_is_too_steep_or_too_fast():
    model = model_of("RigidEnvs/TopPrecession-v0", 16, 20)
    motion, task = model.roll(some_actions(model, 20)), model.task
    goal = model._state["aux"][:, list(task.aux_names).index("goal_tilt")]
    top = task.system()
    for y, errors in zip(motion.y[1:], motion.errors, strict=True):
        tilt, _, rate = nutation_of(y).T
        slow, _ = steady_precession(
            goal, y[:, 6], i_perp=top.I1, i3=top.I3, mgl=top.m * top.g * top.ell
        )
        np.testing.assert_allclose(errors[:, 0], (tilt / goal - 1.0) / task.tolerance, atol=1e-9)
        np.testing.assert_array_equal(np.sign(errors[:, 1]), np.sign(rate - slow))


# The convex problem of a linearisation, and the proximal map of its cost: what is optimal.


LIMITS = Limits(True, np.array([True, True]))


def problem(rng, n=6, r=3, t=5):
    a = LIMITS.clip(rng.normal(0.0, 0.7, (n, t, 2)))
    G, c = rng.normal(0.0, 1.0, (n, r, t, 2)), rng.normal(0.0, 2.0, (n, r))
    ones = np.ones(n)
    return Subproblem(LIMITS, a, G, c, np.ones((n, r)), 0.3 * ones, 2.0 * ones, 5.0 * ones)


KINDS = {
    "disk": LIMITS,
    "box": Limits(False, np.array([True, True, True])),
    "box of which one side counts": Limits(False, np.array([True, False])),
}


def uneven(limits, n=40, r=4, t=6):
    """Problems that have nothing in common but their sizes."""
    rng, m = np.random.default_rng(3), len(limits.counted)
    a = limits.clip(rng.normal(0.0, 0.7, (n, t, m)))
    G, c = rng.normal(0.0, 1.0, (n, r, t, m)), rng.normal(0.0, 3.0, (n, r))
    sizes = ((0.3, 1.5, (n, r)), (0.1, 1.0, n), (0.5, 5.0, n), (0.5, 8.0, n))
    return Subproblem(limits, a, G, c, *(rng.uniform(*size) for size in sizes))


@pytest.mark.parametrize("limits", KINDS.values(), ids=KINDS)
def test_plans_and_prices_meet_the_conditions_of_karush_kuhn_and_tucker(limits):
    """The problem is convex: whatever meets them is its solution."""
    p = uneven(limits)
    plans, prices = p.solve(np.zeros_like(p.c))
    e = p.c + np.einsum("nrtj,ntj->nr", p.G, plans - p.a)
    mu, slack = p.mu[:, None], np.abs(e) - p.b
    free, spent = np.abs(prices) < 1e-9 * mu, np.abs(prices) > (1.0 - 1e-9) * mu
    assert min(free.sum(), spent.sum(), (~free & ~spent).sum()) > 5  # each kind is there
    assert (np.abs(prices) <= mu).all()
    assert (slack[free] < 1e-4).all() and (slack[spent] > -1e-4).all()
    assert (np.abs(slack[~free & ~spent]) < 1e-4).all()
    assert (prices * e >= 0.0).all()
    # no way from a plan within the limits goes down, given the prices
    down = p.rho[:, None, None] * (plans - p.a) + np.einsum("nr,nrtj->ntj", prices, p.G)
    rng = np.random.default_rng(4)
    for _ in range(200):
        ahead = plans + 1e-3 * (limits.clip(rng.normal(0.0, 1.5, plans.shape)) - plans)
        paid = p.w[:, None] * (limits.length(ahead) - limits.length(plans))
        assert (paid + (down * (ahead - plans)).sum(axis=2) > -1e-6).all()


def squares(limits, n=60):
    """Quadratic functions of actions, most of them least outside the limits: H and where."""
    rng, m = np.random.default_rng(5), len(limits.counted)
    root = rng.normal(size=(n, m, m))
    return root.mT @ root + 0.1 * np.eye(m), rng.normal(0.0, 3.0, (n, m, 1)), rng


@pytest.mark.parametrize("limits", KINDS.values(), ids=KINDS)
def test_descent_in_free_directions_ends_at_the_least_square_within_the_limits(limits):
    H, out, rng = squares(limits)
    a = limits.clip(3.0 * out[..., 0])
    damped = np.linalg.norm(H, axis=(1, 2))[:, None, None] * np.eye(a.shape[1])
    for _ in range(4000):  # slow, and sure
        slope = H @ (a[..., None] - out)
        free, price = limits.free(a, slope[..., 0])
        curved = free @ H @ free + price[:, None, None] * np.eye(a.shape[1]) + damped
        a = limits.clip(a - np.linalg.solve(curved, free @ slope)[..., 0])
    slope = (H @ (a[..., None] - out))[..., 0]
    within = limits.clip(rng.normal(0.0, 1.5, (500, *a.shape)))  # the problem is convex
    assert (np.sum(slope * (within - a), axis=-1) > -1e-6).all()
    assert (np.abs(slope).max(axis=1) > 1e-3).sum() > 40  # so many end at the limits


def test_a_square_along_a_circle_is_that_of_its_slope_its_matrix_and_the_curvature():
    H, out, rng = squares(LIMITS)
    a = LIMITS.clip(9.0 * out[..., 0])
    slope = H @ (a[..., None] - out)
    free, price = LIMITS.free(a, slope[..., 0])
    step = np.array([1e-2, 5e-3])[:, None, None, None] * (free @ rng.normal(size=out.shape))
    off = LIMITS.clip(a + step[..., 0])[..., None] - a[..., None]
    told = slope.mT @ step + 0.5 * (step.mT @ H @ step + price[:, None, None] * step.mT @ step)
    left = np.abs(slope.mT @ off + 0.5 * off.mT @ H @ off - told)[:, price > 0.0]
    assert left.shape[1] > 40
    first, half = left.max(axis=(1, 2, 3))
    assert half == pytest.approx(first / 8.0, rel=0.05)  # of third order


def test_no_problem_is_left_before_its_duality_gap_is_a_millionth_of_its_value():
    p = uneven(LIMITS, n=400)
    gap, dual = gap_and_dual(p, *p.solve(np.zeros_like(p.c)))
    assert (gap <= 1.01e-6 * np.abs(dual)).all()


def gap_and_dual(p, plans, prices):
    """Difference of the primal and the dual value, and the dual value."""
    e = p.c + np.einsum("nrtj,ntj->nr", p.G, plans - p.a)
    bounds = (1.0 - 1e-5) * p.b  # a plan ends so far within them
    spent = p.w * p.limits.length(plans).sum(axis=1)
    spent += 0.5 * p.rho * ((plans - p.a) ** 2).sum(axis=(1, 2))
    primal = spent + (p.mu[:, None] * np.maximum(np.abs(e) - bounds, 0.0)).sum(axis=1)
    dual = spent + (prices * e - bounds * np.abs(prices)).sum(axis=1)
    return np.abs(primal - dual), dual


def test_the_solution_does_not_depend_on_the_prices_it_begins_with():
    p = uneven(LIMITS)
    first = p.solve(np.zeros_like(p.c))
    for prices in (np.full_like(p.c, 1e3), -first[1]):
        for one, other in zip(p.solve(prices), first, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-4)


def test_the_solution_does_not_depend_on_the_unit_of_costs():
    p, unit = uneven(LIMITS), 4.0**8  # steps are damped alike, so plans are the same to rounding
    plans, prices = p.solve(np.zeros_like(p.c))
    other = p._replace(w=unit * p.w, rho=unit * p.rho, mu=unit * p.mu)
    same, dearer = other.solve(np.zeros_like(p.c))
    np.testing.assert_allclose(same, plans, rtol=0, atol=1e-12)
    np.testing.assert_allclose(dearer, unit * prices, rtol=1e-9)


def test_errors_that_grow_are_solved_too():
    """Of conditions of a long plan of an unstable motion, whose dual has kinks, most are."""
    rng, n, t = np.random.default_rng(3), 200, np.linspace(0.0, 1.0, 80)
    rates, turns = rng.uniform(1.0, 6.0, (n, 1, 1)), rng.uniform(0.0, 30.0, (n, 1, 1))
    left = np.linspace(0.6, 1.0, 6)[:, None] - t
    G = 0.3 * (np.exp(rates * left) * (left > 0.0))[..., None]
    G = G * np.stack([np.cos(turns * t), np.sin(turns * t)], axis=-1)
    a, c = LIMITS.clip(rng.normal(0.0, 0.2, (n, 80, 2))), rng.normal(0.0, 3.0, (n, 6))
    ones = np.ones(n)
    p = Subproblem(LIMITS, a, G, c, np.ones((n, 6)), 0.05 * ones, 0.1 * ones, 2.0 * ones)
    gap, dual = gap_and_dual(p, *p.solve(np.zeros_like(c)))
    assert np.mean(gap <= 1.01e-6 * np.abs(dual)) > 0.9


def test_a_violation_is_what_all_errors_have_above_their_bounds():
    p = uneven(LIMITS)
    e = p.c + np.einsum("nrtj,ntj->nr", p.G, -p.a)
    above = sum(max(abs(e[0, k]) - p.b[0, k], 0.0) for k in range(p.c.shape[1]))
    assert p.violation(np.zeros_like(p.a))[0] == pytest.approx(above)
    assert (p._replace(b=np.full_like(p.b, 1e6)).violation(p.a) == 0.0).all()


def test_what_can_be_met_is_met_within_the_tolerance():
    rng = np.random.default_rng(1)
    p = problem(rng)
    p = p._replace(c=np.clip(p.c, -1.2, 1.2), mu=1e3 * np.ones(6))
    plans, _ = p.solve(np.zeros_like(p.c))
    assert p.violation(plans).max() < 1e-5


def test_the_factor_of_a_matrix_that_may_be_singular():
    x = np.random.default_rng(2).normal(size=(50, 3, 2))
    S = x @ x.swapaxes(1, 2)
    F = square_root(S)
    np.testing.assert_allclose(F @ F.swapaxes(1, 2), S, atol=1e-6)
    np.testing.assert_array_equal(F, np.tril(F))


@pytest.mark.parametrize("limits", KINDS.values(), ids=KINDS)
def test_no_other_action_within_the_limits_is_better(limits):
    rng, m = np.random.default_rng(0), len(limits.counted)
    for z, threshold in zip(rng.normal(0.0, 1.2, (40, m)), rng.uniform(0.0, 1.0, 40), strict=True):
        v = limits.shrink(z[None], np.array([threshold]))[0][0]

        def value(v, z=z, threshold=threshold):
            return threshold * limits.length(v) + 0.5 * np.sum((v - z) ** 2)

        inside = {"type": "ineq", "fun": lambda v: 1.0 - v @ v} if limits.disk else ()
        start = limits.clip(z) * 0.9
        other = minimize(value, start, bounds=[(-1.0, 1.0)] * m, constraints=inside, tol=1e-12).x
        assert value(v) <= value(limits.clip(other)) + 1e-9
        np.testing.assert_allclose(limits.clip(v), v, atol=1e-12)


@pytest.mark.parametrize("limits", KINDS.values(), ids=KINDS)
def test_its_derivative_is_that_of_difference_quotients(limits):
    rng, m, h = np.random.default_rng(1), len(limits.counted), 1e-6
    z, threshold = rng.normal(0.0, 1.2, (200, m)), rng.uniform(0.0, 1.0, 200)
    slope = limits.shrink(z, threshold)[1]
    for k, unit in enumerate(np.eye(m)):
        ahead, behind = (limits.shrink(z + s * h * unit, threshold)[0] for s in (1.0, -1.0))
        off = np.abs((ahead - behind) / (2.0 * h) - slope[:, :, k]).max(axis=1)
        assert np.mean(off < 1e-4) > 0.98  # but at kinks
