"""Plans and the search for them: as good as can be where that is known, what is kept, deadlines."""

from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.optimize import least_squares

from rigid_envs.control.planning import deadlines, tracking
from rigid_envs.control.planning.deadlines import hurried, shorten, sooner
from rigid_envs.control.planning.descent import (
    Plans,
    PlanSearch,
    Rows,
    axes_along,
    condense,
    improve,
    looked_at,
    merge,
    take,
)
from rigid_envs.control.planning.model import Limits, Linear, Model, Motion
from rigid_envs.control.planning.tracking import follow
from rigid_envs.envs.lookup import task_of
from rigid_envs.mechanics import rotations
from rigid_envs.scores import finding
from rigid_envs.scores.best import least_time
from rigid_envs.scores.evaluation import evaluate, make_rows
from rigid_envs.scores.finding import RECIPES, Recipe, of_plans, plan
from tests.control.planning.test_model import model_of, some_actions

PARK = "RigidEnvs/BallPark-v0"


def test_axes_along_a_vector_are_orthonormal_and_the_first_lies_along_it():
    rng = np.random.default_rng(0)
    for n in (1, 2, 3):
        e = np.concatenate([rng.normal(size=(30, n)), -np.eye(n), np.eye(n), np.zeros((1, n))])
        axes = axes_along(e)
        products = axes @ axes.swapaxes(1, 2)
        np.testing.assert_allclose(products, np.broadcast_to(np.eye(n), products.shape), atol=1e-12)
        along = np.abs((axes[:, 0] * e).sum(axis=1))
        np.testing.assert_allclose(along, np.linalg.norm(e, axis=1), atol=1e-12)


@pytest.mark.parametrize("n_parts", [1, 3])
def test_errors_are_looked_at_at_both_ends_of_their_time_and_where_they_are_largest(n_parts):
    rng, T, groups = np.random.default_rng(1), 13, (np.arange(2), np.array([2]))
    first = np.repeat([3, 6, 9, 12, 13], 6)  # of twelve steps, in which three parts are equal
    n = len(first)
    errors = rng.normal(size=(T, n, 3))
    found = looked_at(errors, groups, first, n_parts, np.full(n, 0.5))
    for row, begin in enumerate(first):
        due = range(begin - 1, T)  # the steps after which the conditions must hold
        sizes = [np.linalg.norm(errors[:, row, group], axis=1) for group in groups]
        excess = sum(max(max(size[t] for t in due) - 1.0, 0.0) for size in sizes)
        assert found.excess[row] == pytest.approx(excess)
        looks = [*zip(found.steps[row].tolist(), found.directions[row], strict=True)]
        seen = {(t, group) for t, d in looks for group in range(2) if d[groups[group]].any()}
        for group, size in enumerate(sizes):
            # the last step is none of the parts: it is looked at by itself
            length = (T - 1 - begin) // n_parts
            parts = [range(k, k + length) for k in range(begin, T - 1, max(length, 1))]
            assert {(begin - 1, group), (T - 1, group)} <= seen
            assert {(max(part, key=size.__getitem__), group) for part in parts} <= seen
        assert all(t in due for t, _ in seen)
    for row in range(n):
        for t, direction, value in zip(
            found.steps[row], found.directions[row], found.values[row], strict=True
        ):
            assert np.linalg.norm(direction) == pytest.approx(1.0)
            assert value == pytest.approx(direction @ errors[t, row])
    late = looked_at(errors[:, -6:], groups, first[-6:], n_parts, np.full(6, 0.5))
    np.testing.assert_array_equal(late.steps, np.full((6, 3), T - 1))  # each entry once


@pytest.mark.parametrize("size", [0.2, 0.6, 0.9, 1.0, 3.0])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_an_error_within_its_bounds_is_within_the_tolerance(size, n):
    """The bounds are a box in the ball of errors, as large as it can be: its corners touch it."""
    rng = np.random.default_rng(2)
    e = rng.normal(size=(20, n))
    errors = (size * e / np.linalg.norm(e, axis=1, keepdims=True))[None]
    found = looked_at(errors, (np.arange(n),), np.full(20, 1), 1, rng.uniform(0.01, 0.5, 20))
    corner = np.linalg.norm(found.bounds[:, :n], axis=1)
    np.testing.assert_allclose(corner, 1.0, rtol=1e-12)
    assert (found.bounds > 0.0).all()
    room = found.bounds[:, 0] / np.minimum(size, 1.0)
    assert (room >= 0.7).all()  # an error that is small enough may stay as large as it is
    if size < 0.6:
        assert (found.values[:, 0] <= found.bounds[:, 0]).all()


def test_derivatives_by_all_actions_are_those_of_the_steps_one_after_another():
    rng, T, N, n, m, q = np.random.default_rng(3), 6, 4, 3, 2, 2
    linear = Linear(*(rng.normal(size=(T, N, *s)) for s in ((n, n), (n, m), (q, n), (q, m))))
    steps, directions = rng.integers(0, T, (N, 5)), rng.normal(size=(N, 5, q))
    empty = np.zeros((N, 5))
    G = condense(linear, Rows(steps, directions, empty, empty, np.zeros(N)))
    change = rng.normal(size=(T, N, m))
    x, expected = np.zeros((N, n)), np.zeros((N, 5))
    for t in range(T):
        e = np.einsum("nij,nj->ni", linear.Ey[t], x)
        e += np.einsum("nij,nj->ni", linear.Ea[t], change[t])
        expected += np.where(steps == t, np.einsum("nrq,nq->nr", directions, e), 0.0)
        x = np.einsum("nij,nj->ni", linear.A[t], x)
        x += np.einsum("nij,nj->ni", linear.B[t], change[t])
    np.testing.assert_allclose(np.einsum("nrtj,tnj->nr", G, change), expected, atol=1e-9)


def merit(model, motion, price):
    """Cost and priced excess of the errors, as the search is to lower it."""
    length = model.limits.length(motion.actions.astype(np.float64)).sum(axis=0)
    excess = np.zeros(model.n_rows)
    for group in model.groups:
        for row, begin in enumerate(model.first):
            size = np.linalg.norm(motion.errors[begin - 1 :, row][:, group], axis=1).max()
            excess[row] += max(size - 1.0, 0.0)
    return model.weights * length + price * excess


def test_a_step_is_taken_where_it_lowers_the_merit_and_nowhere_else():
    n, T = 4, 10
    model = model_of(PARK, n, T)
    search = PlanSearch(model, some_actions(model, T), 2.0)
    price = 2.0 * np.maximum(search.motion.costs, 0.1)
    before, taken = search.motion, []
    for _ in range(12):
        tried = search.step()
        lower = merit(model, tried, price) < merit(model, before, price)
        expected = np.where(lower[:, None], tried.actions, before.actions)
        np.testing.assert_array_equal(search.motion.actions, expected)
        before = search.motion
        taken.append(lower)
    assert 0 < np.mean(taken) < 1  # both came up


def test_a_part_of_a_search_goes_on_as_the_whole_does_in_its_rows():
    n, T, rows = 4, 10, np.array([3, 1])
    model = model_of(PARK, n, T)
    search = PlanSearch(model, some_actions(model, T), 2.0)
    for _ in range(3):
        search.step()
    part = search.part(rows)
    for _ in range(2):
        tried, whole = part.step().actions, search.step().actions
        np.testing.assert_array_equal(tried, whole[:, rows])
        here, there = part.motion, search.motion
        np.testing.assert_array_equal(here.y, there.y[:, rows])
        np.testing.assert_array_equal(here.costs, there.costs[rows])
    assert part.going().all() and not part.going().any()  # nothing was gained between the two


def test_a_search_does_not_depend_on_the_unit_of_the_cost():
    model, other = (model_of(PARK, 2, 10) for _ in range(2))
    other.weights, actions = model.weights / 128.0, some_actions(model, 10)
    searches = [PlanSearch(model, actions, 2.0), PlanSearch(other, actions, 2.0 / 128.0)]
    for _ in range(6):
        one, two = (search.step().actions for search in searches)
        np.testing.assert_array_equal(two, one)


def test_rows_of_motions_are_taken_and_merged_whole():
    rng, T, n = np.random.default_rng(5), 3, 4

    def motion():
        shapes = ((T, n, 2), (T + 1, n, 5), (T + 1, n, 6), (T, n, 3), (n,), (n,))
        return Motion(*(rng.normal(size=shape) for shape in shapes))

    one, other = motion(), motion()
    both = merge(np.array([True, False, True, False]), one, other)
    for rows, source in ((np.array([2, 0]), one), (np.array([1, 3]), other)):
        for found, expected in zip(take(both, rows), source, strict=True):
            chosen = expected[rows] if expected.ndim == 1 else expected[:, rows]
            np.testing.assert_array_equal(found, chosen)


def test_a_plan_is_replaced_by_one_that_succeeds_and_costs_less_alone():
    T, old, new = 2, np.zeros((2, 4, 1), np.float32), np.ones((2, 4, 1), np.float32)
    plans = Plans(old.copy(), np.array([3.0, 3.0, 3.0, np.inf]))
    found = np.zeros((T + 1, 4, 1))
    costs, successes = np.array([2.0, 2.0, 3.0, 9.0]), np.array([True, False, True, True])
    plans.keep(np.arange(4), Motion(new, found, found, found, costs, successes))
    assert plans.actions[0, :, 0].tolist() == [1.0, 0.0, 0.0, 1.0]
    assert plans.costs.tolist() == [2.0, 3.0, 3.0, 9.0]


def test_a_plan_run_faster_comes_as_far_in_less_time():
    T, steps, goal = 40, np.array([24.0, 24.0]), np.array([12.0, 24.0])
    push = np.where(np.arange(T) < 12, 0.1, -0.1) * (np.arange(T) < 24)
    found = deadlines.compressed(np.repeat(push[:, None, None], 2, axis=1), steps, goal)[..., 0].T

    def place(pushes):  # and speed, of a mass that is pushed in steps
        speed = np.cumsum(pushes)
        return [np.sum(speed - 0.5 * pushes), speed[-1]]

    np.testing.assert_allclose(place(found[0]), place(push), atol=1e-12)
    assert np.flatnonzero(found[0])[-1] == 11 and found[0][0] == pytest.approx(0.4)
    np.testing.assert_array_equal(found[1], push)
    whole = np.random.default_rng(0).normal(size=(T, 1, 2))
    np.testing.assert_array_equal(deadlines.compressed(whole, np.array([T]), np.array([T])), whole)


def tried_deadlines(monkeypatch, first, least, n_cuts):
    """The deadlines that are tried with plans of `first` steps where `least` are enough."""
    T, n, dt, tried = 64, len(first), 0.1, []

    class Timed(SimpleNamespace):
        def part(self, rows):
            return Timed(rows=rows)

        def roll(self, actions):
            costs = np.asarray(first) * dt
            empty = np.zeros((T, n, 1))
            return Motion(actions, empty, empty, empty, costs, np.ones(n, dtype=bool))

    def improve(model, plan, n_rounds):
        tried.append(dict(zip(model.rows.tolist(), model.first.tolist(), strict=True)))
        enough = model.first >= np.asarray(least)[model.rows]
        return Plans(plan, np.where(enough, model.first * dt, np.inf))

    monkeypatch.setattr(deadlines, "improve", improve)
    model = Timed(n_rows=n, task=SimpleNamespace(dt=dt))
    return shorten(model, np.zeros((T, n, 1)), n_cuts, 3).costs / dt, tried


def test_a_deadline_that_is_met_moves_on_and_one_that_is_not_moves_half_as_far(monkeypatch):
    costs, tried = tried_deadlines(monkeypatch, [40.0], [22], 20)
    assert [each[0] for each in tried] == [30, 20, 25, 20, 23, 21, 22, 21, 21]
    assert costs == pytest.approx([22.0])


def test_each_row_has_its_own_deadline_and_is_left_when_it_cannot_be_shorter(monkeypatch):
    first, least = [40.0, 8.0, 1.0], [1, 8, 1]
    costs, tried = tried_deadlines(monkeypatch, first, least, 50)
    assert costs == pytest.approx([1.0, 8.0, 1.0])
    assert all(2 not in each for each in tried)  # one step cannot be fewer
    assert [each[1] for each in tried if 1 in each] == [6, 7, 7]
    assert min(each[0] for each in tried if 0 in each) == 1
    assert tried_deadlines(monkeypatch, first, least, 2)[0] == pytest.approx([20.0, 8.0, 1.0])


def model_from(env_id, n_steps, counts="cost", **start):
    """A model of one row that starts from a given state."""
    env = gym.make(env_id)
    env.reset(seed=0, options={"state": start})
    state = {key: np.atleast_2d(part) for key, part in env.unwrapped.get_state().items()}
    return Model(task_of(env_id), state, n_steps, counts)


def crooked(n_steps, length, side=0.2):
    """Steps along a bow of about a length [largest steps], shape (n_steps, 1, 2)."""
    s = np.linspace(0.0, 1.0, n_steps)
    steps = np.stack([-np.ones(n_steps), side * np.cos(np.pi * s)], axis=-1) * length / n_steps
    return steps[:, None]


def test_a_ball_that_may_roll_straight_home_takes_the_shortest_path_to_the_tolerance():
    distance = 1.5
    q = rotations.exp([0.0, distance, 0.0])  # as rolling from home leaves it
    model = model_from("RigidEnvs/BallPark-v0", 20, q=q, position=(distance, 0.0))
    task = model.task
    plans = improve(model, crooked(20, distance / task.roll_per_step), 60)
    least = distance - min(task.position_tolerance, task.angle_tolerance)
    assert least <= plans.costs[0] * (1.0 + 1e-6) and plans.costs[0] < 1.002 * least


def test_a_coin_that_may_roll_straight_home_takes_the_shortest_path_to_the_tolerance():
    distance = 1.2
    upright, turned = (rotations.exp([0.5 * np.pi, 0, 0]), rotations.exp([0, 0, -distance]))
    q = rotations.multiply(upright, turned)
    model = model_from("RigidEnvs/CoinPark-v0", 20, q=q, contact=(distance, 0.0))
    roll = np.full(20, distance / 20 / model.task.roll_per_step)
    turn = 0.3 * np.sin(np.linspace(0.0, 2.0 * np.pi, 20))
    plans = improve(model, np.stack([roll, turn], axis=-1)[:, None], 60)
    task = model.task
    least = distance - min(task.position_tolerance, task.phase_tolerance)
    assert least <= plans.costs[0] * (1.0 + 1e-6) and plans.costs[0] < 1.002 * least


def test_a_ball_is_pushed_straight_home_in_the_least_time():
    distance = 1.5
    q = rotations.exp([0.0, distance, 0.0])
    model = model_from(
        "RigidEnvs/BallParkDynamic-v0", 30, counts="time", q=q, position=(distance, 0.0)
    )
    assert not model.weights.any()  # time alone counts
    task = model.task
    largest = task.force / (task.m * (1.0 + task.beta))
    part = np.sqrt(distance / largest) / task.dt
    half = int(np.ceil(1.5 * part))
    strength = (part / half) ** 2
    slow = np.zeros((30, 1, 2))
    slow[:half, 0, 0], slow[half : 2 * half, 0, 0] = -strength, strength
    least = least_time(distance - task.position_tolerance, largest, task.speed_tolerance)
    plans = Plans(slow.astype(np.float32), model.roll(slow).costs)
    hurried(model, plans, np.array([0]), 12)
    for found in (shorten(model, slow, 8, 12), plans):
        assert least <= found.costs[0] + 1e-9 and found.costs[0] < least + 1.01 * task.dt
    ends = round(plans.costs[0] / task.dt)
    assert plans.actions[:ends].any() and not plans.actions[ends:].any()
    assert model.roll(plans.actions).costs == plans.costs
    assert not len(sooner(model, plans, np.array([0]), lambda T, rows: plans.actions[:T], 4))


def test_plans_are_made_to_end_sooner_each_from_a_deadline_of_its_own(monkeypatch):
    model, tried = model_of("RigidEnvs/BallParkDynamic-v0", 4, 12, "time"), {}
    plans = Plans(np.ones((12, 4, 2), np.float32), np.array([1.0, 1.6, np.inf, 1.6]))

    def improve(part, first, n_rounds):
        tried[part.n_steps] = part.n_rows
        costs = np.where(np.arange(part.n_rows) == 0, 0.2 * (part.n_steps - 1), np.inf)
        return Plans(first, costs)

    monkeypatch.setattr(deadlines, "improve", improve)
    rows = np.array([0, 1, 2, 3])
    better = sooner(model, plans, rows, lambda T, part: np.full((T, len(part), 2), 0.5), 3)
    assert tried == {4: 1, 7: 2, 11: 1} and better.tolist() == [0, 1, 2]
    assert plans.costs == pytest.approx([0.6, 1.2, 2.0, 1.6])
    assert plans.actions[:, :, 0].sum(axis=0).tolist() == [2.0, 3.5, 5.5, 12.0]


def test_a_plan_that_succeeds_is_kept_until_there_is_a_better_one():
    q = rotations.exp([0.0, 1.5, 0.0])
    model = model_from("RigidEnvs/BallPark-v0", 20, q=q, position=(1.5, 0.0))
    straight = crooked(20, 1.5 / model.task.roll_per_step, side=0.0)
    plans = improve(model, straight, 0)
    np.testing.assert_array_equal(plans.actions, straight.astype(np.float32))
    np.testing.assert_array_equal(plans.costs, model.roll(straight).costs)


def test_a_search_ends_once_its_plans_have_settled(monkeypatch):
    model, rounds, step = model_of(PARK, 2, 10), [], PlanSearch.step
    monkeypatch.setattr(PlanSearch, "step", lambda search: rounds.append(0) or step(search))
    improve(model, some_actions(model, 10), 400)
    assert 8 <= len(rounds) < 400
    rounds.clear()
    monkeypatch.setattr(PlanSearch, "going", lambda search: np.arange(len(search.motion.costs)) > 0)
    improve(model, some_actions(model, 10), 400)
    assert len(rounds) == 2 * 8  # a row that has settled ends itself alone


def test_a_plan_is_a_success_in_the_environment_at_the_cost_that_it_says(monkeypatch):
    env_id, n = "RigidEnvs/SleepingTop-v0", 2
    monkeypatch.setitem(RECIPES, "SleepingTop", Recipe(4))
    lqr = evaluate(env_id, "lqr", n=n)
    found = evaluate(env_id, of_plans(plan(env_id, [lqr.actions], np.arange(n))), n=n)
    assert found.successes.all()
    assert (found.costs < 0.5 * lqr.costs).all()


def test_planning_again_gives_the_same_bits_and_improves_what_is_stored(monkeypatch):
    env_id, rows = "RigidEnvs/CoinPark-v0", np.array([0])
    monkeypatch.setitem(RECIPES, "CoinPark", Recipe(n_rounds=8, n_steps=60, n_hops=1))
    shake, shaken = finding._shaken, []
    monkeypatch.setattr(finding, "_shaken", lambda *of: shaken.append(shake(*of)) or shaken[-1])
    actions = [evaluate(env_id, "two_rolls", n=1).actions]
    first, again = (plan(env_id, actions, rows) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(*shaken)  # though it may be worse than what was shaken
    np.testing.assert_array_equal(2.0**14 * first % 1.0, 0.0)  # on a grid: small files
    both = (first, plan(env_id, [first], rows))
    costs = [evaluate(env_id, of_plans(each), n=1).costs for each in both]
    assert (costs[1] < costs[0]).all()


@pytest.mark.parametrize(
    ("name", "lax"), [("BallSteer", {"bound": 10.0}), ("DiskRoll", {"hold": 0.0, "tolerance": 1.0})]
)
def test_the_least_error_of_a_short_plan_is_that_of_a_general_least_squares_method(name, lax):
    env_id, T = f"RigidEnvs/{name}-v0", 6
    envs = make_rows(env_id, 2, lax)
    envs.reset(seed=[3, 4])
    model = Model(envs.task, envs.get_state(), T, "error")
    plans = follow(model, np.zeros((T, 2, model.n_actions)), 25)
    np.testing.assert_array_equal(plans.costs, model.roll(plans.actions).costs)
    for row in range(2):
        one = model.part(np.array([row]))

        def errors(flat, one=one):
            return one.roll(flat.reshape(T, 1, -1)).errors.ravel()

        start = plans.actions[:, row].ravel() * 0.5
        found = least_squares(errors, start, bounds=(-1.0, 1.0), diff_step=1e-3)
        expected = np.sqrt(2.0 * found.cost / T)
        assert plans.costs[row] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("clamped", [0, 20])
def test_the_regulator_about_an_unstable_motion_is_that_of_riccati(clamped):
    rng, (T, n, m, rho) = np.random.default_rng(2), (400, 4, 2, 0.5)
    A, B = 1.4 * rng.normal(size=(n, n)), rng.normal(size=(n, m))
    steps = [np.tile(each, (T, 1, 1, 1)) for each in (A, B, np.eye(n), np.zeros((n, m)))]
    actions, errors = np.zeros((T, 1, m)), np.zeros((T, 1, n))
    actions[T - clamped :] = 1.0  # the last actions stay at their limit: without feedback P grows
    errors[T - clamped :] = -1e3 * np.sign(B.sum(axis=1))
    motion = Motion(actions, None, None, errors, None, None)
    limits = Limits(disk=False, counted=np.zeros(m, dtype=bool))
    _, gains = tracking._regulator(limits, Linear(*steps), motion, np.array([rho]))
    P = solve_discrete_are(A, B, np.eye(n), rho * np.eye(m))
    expected = -np.linalg.solve(rho * np.eye(m) + B.T @ P @ B, B.T @ P @ A)
    assert np.abs(np.linalg.eigvals(A)).max() > 1.5
    np.testing.assert_allclose(gains[0, 0], expected, rtol=1e-9)
