"""Metrics against the motion itself, bounds against what was reached, rollouts against rows."""

import json
from dataclasses import fields
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.scores import policies
from rigid_envs.scores.best import least_time, limit_of
from rigid_envs.scores.evaluation import evaluate, make_rows
from rigid_envs.scores.starts import (
    METRICS,
    Tally,
    evaluation_seeds,
    joined,
    metrics_of,
    play,
    row_seeds,
    shared,
)
from rigid_envs.scores.statistics import mean_interval
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.upright_coin.system import UprightCoin
from rigid_envs.tasks.registry import ENVIRONMENTS, ErrorTerm
from rigid_envs.tools.fair_starts import chosen, coordinates, features

DOCS = Path(__file__).parents[2] / "docs"
TOP = "RigidEnvs/SleepingTop-v0"
DETUMBLE, GRID = "RigidEnvs/Detumble-v0", "RigidEnvs/BallGrid-v0"
SEEDS = [5677982223520472754, 1865544673836395877]
FIRST = [  # version 1 of the evaluation set, by NumPy alone
    int(child.generate_state(1, np.uint64)[0]) // 2
    for child in np.random.SeedSequence(314159, spawn_key=(2,)).spawn(16_384)
]


def best(env_id):
    return policies.from_controller(next(iter(policies.reference_controllers(env_id).values())))


def begun(env_id, n, config=None, **options):
    """Rows at their starts, which are those of an evaluation unless told otherwise."""
    envs = make_rows(env_id, n, config)
    envs.reset(**({"seed": evaluation_seeds(n)} | options))
    return envs


def test_the_evaluation_set_is_the_published_one():
    assert evaluation_seeds(2) == SEEDS
    assert evaluation_seeds() == row_seeds(314159, 500, "test")
    assert len(set(evaluation_seeds())) == 500
    assert set(evaluation_seeds()) <= set(FIRST)
    assert evaluation_seeds(7) == evaluation_seeds()[:7]
    more = evaluation_seeds(510)
    assert len(set(more)) == 510 and more[:500] == evaluation_seeds()


@pytest.mark.long
@pytest.mark.push
def test_most_starts_of_version_1_are_the_first_ones_of_the_set_in_their_order():
    both = [seed for seed in FIRST[:500] if seed in set(evaluation_seeds())]
    assert len(both) == 450 and evaluation_seeds(450) == both
    for n in (1, 4, 500):
        assert [FIRST[k] for k in shared(1, n)] == [s for s in FIRST[:n] if s in both]
    np.testing.assert_array_equal(shared(2, 7), range(7))


def test_starts_are_chosen_so_that_means_over_them_are_those_of_all():
    """Of points in a square: the mean of a smooth function that nobody chose by."""
    apart = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        points = np.sqrt(3.0) * rng.uniform(-1.0, 1.0, (2000, 2))
        places = chosen(features(points, rng), 100, 20)
        kept, new = places[:80], places[80:]
        assert (np.diff(kept) > 0).all() and kept.max() < 100 <= new.min()
        assert len(set(places.tolist())) == 100
        values = np.exp(0.5 * points[:, 0]) * np.cos(points[:, 1])
        apart.append([values[rows].mean() - values.mean() for rows in (np.arange(100), places)])
    drawn, even = np.sqrt(np.mean(np.square(apart), axis=0))
    assert even < 0.2 * drawn


@pytest.mark.parametrize("env_id", [TOP, "RigidEnvs/IntermediateAxisRandom-v0"])
def test_the_starts_of_the_set_are_more_even_than_drawn_ones(env_id):
    """Means of what tells starts apart, against other starts than those that it was chosen among.

    n times the squared error of a mean is 1 in the mean of drawn starts, and that of the 8192
    starts adds 0.06.
    """
    apart = []
    for seeds in (evaluation_seeds(), FIRST[:500]):
        z = coordinates(env_id, seeds + row_seeds(1, 8192, "test"))
        apart.append(500 * np.mean((z[:500].mean(axis=0) - z[500:].mean(axis=0)) ** 2))
    assert apart[0] < 0.3 < 0.6 < apart[1]


def test_from_the_set_a_fixed_reference_costs_what_it_costs_from_all_starts():
    """Within the standard error of 500 drawn starts, on every id: cost and return.

    For ids that came after the set was chosen its starts are as drawn ones: two standard errors.
    """
    data = json.loads((DOCS / "fresh_starts.json").read_text(encoding="utf-8"))
    assert [row["env_id"] for row in data["references"]] == list(ENVIRONMENTS)
    assert all(row["fresh"]["starts"] == 20_000 for row in data["references"])
    later = {"TippeTop", "RacketCatch", "WheelReorient", "TwoWheels", "WheelTrack", "DualSpin"}
    later |= {"MagneticDetumble"}
    for row in data["references"]:
        most = 2.0 if row["env_id"].split("/")[1].removesuffix("-v0") in later else 1.0
        assert max(abs(row["apart"]["cost"]), abs(row["apart"]["return"])) <= most, row["env_id"]


def test_an_evaluation_repeats_and_fewer_starts_are_the_first_of_more():
    few, many = (evaluate(DETUMBLE, best(DETUMBLE), n=n).values for n in (5, 20))
    for name, values in evaluate(DETUMBLE, best(DETUMBLE), n=20).values.items():
        np.testing.assert_array_equal(values, many[name])
        np.testing.assert_array_equal(few[name], values[:5])


def test_metrics_are_those_of_the_motion():
    """Tilt from the states: its root mean square, and the last time that it was not small."""
    n, envs = 20, begun(TOP, 20)
    policy = next(iter(policies.reference_controllers(TOP).values()))(envs.task)
    tilts = []
    for _ in range(299):  # with the 300th the rows start anew
        envs.step(np.asarray(policy(envs), dtype=np.float32))
        up = rotations.rotate(envs.y[:, :4], [0.0, 0.0, 1.0])
        tilts.append(np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]))
    tilts = np.array(tilts)
    found = evaluate(TOP, best(TOP), n=n).values
    late = 299 - np.argmax((tilts >= envs.task.tolerance)[::-1], axis=0)
    late[~(tilts >= envs.task.tolerance).any(axis=0)] = 0
    np.testing.assert_allclose(found["time"], late * envs.task.dt, rtol=1e-12)
    rms = np.sqrt((tilts**2).sum(axis=0) / 300)  # without the last step, which is hardly tilted
    np.testing.assert_allclose(found["error"], rms, rtol=1e-3)
    np.testing.assert_array_equal(found["success"], 1.0)


# of the tasks that the planner of the shortest path solves, which takes seconds, one
ALIKE = tuple(f"RigidEnvs/{name}-v0" for name in ("BallParkGoal", "BallParkRandom", "BallReorient"))


@pytest.mark.parametrize(
    "env_id",
    [
        pytest.param(env_id, marks=pytest.mark.long) if env_id in ALIKE else env_id
        for env_id, record in ENVIRONMENTS.items()
        if record.limits
    ],
)
def test_no_reference_beats_theory_from_any_start(env_id):
    n = 4 if env_id.endswith("BallPark-v0") else 20  # paths are planned for seconds
    found = evaluate(env_id, best(env_id), n=n)
    envs = begun(env_id, n)
    won = found.successes
    for metric in metrics_of(env_id):
        limit = limit_of(env_id, metric.name)
        if limit is None:
            continue
        best_there_is, value = limit.values(envs)[won], found.values[metric.name][won]
        sign = 1.0 if metric.higher_is_better else -1.0
        # float32 actions and what the finite horizon leaves change a return by less than this
        assert (sign * (value - best_there_is) <= 1e-6 * np.abs(best_there_is)).all()


@pytest.mark.parametrize(
    ("env_id", "metric", "law", "config"),
    [
        (DETUMBLE, "loss", "riccati", {}),
        (DETUMBLE, "time", "brake", {}),
        (DETUMBLE, "time", "brake", {"tolerance": 0.2}),
        (DETUMBLE, "time", "brake", {"start_momentum": 0.4}),  # one impulse or none
        (GRID, "path", "breadth_first", {}),
        (GRID, "time", "breadth_first", {}),
    ],
)
def test_a_limit_that_is_exact_is_reached_from_every_start(env_id, metric, law, config):
    n, limit = 20, limit_of(env_id, metric)
    policy = policies.from_controller(policies.reference_controllers(env_id)[law])
    found = evaluate(env_id, policy, n=n, config=config).values[metric]
    # actions are float32, and the loss is least there: errors enter squared, but for |L| itself
    rtol = 1e-6 if metric == "loss" else 1e-12
    np.testing.assert_allclose(found, limit.values(begun(env_id, n, config)), rtol=rtol)
    assert limit.kind == "exact"


def test_a_ball_that_was_rolled_k_cells_has_k_moves_to_go_and_one_at_home_two():
    env_id, side = "RigidEnvs/BallGrid-v0", 0.5 * np.pi
    way = side * np.outer(np.arange(4), [1.0, 0.0])
    state = [np.append(rolling_ball.roll_straight(each, 1.0), each) for each in way]
    envs = begun(env_id, 4, options={"state": np.array(state)})
    for metric, unit in (("path", side), ("time", envs.task.dt)):
        found = limit_of(env_id, metric).values(envs)
        np.testing.assert_allclose(found, unit * np.array([2, 1, 2, 3]), rtol=1e-14)


@pytest.mark.parametrize(("name", "config"), [("BallSteer", {}), ("BallGrid", {"start_cells": 1})])
def test_a_ball_of_twice_the_radius_is_led_alike_on_twice_the_scale(name, config):
    """No length of these two tasks is given but the radius."""
    env_id = f"RigidEnvs/{name}-v0"
    for controller in policies.reference_controllers(env_id).values():
        one, two = (begun(env_id, 5, {**config, "radius": radius}) for radius in (1.0, 2.0))
        for metric in ENVIRONMENTS[env_id].limits:
            least, larger = (limit_of(env_id, metric).values(envs) for envs in (one, two))
            np.testing.assert_allclose(larger, least * (2.0 if metric == "path" else 1.0))
        policy, larger_policy = controller(one.task), controller(two.task)
        for _ in range(5):
            action, larger_action = policy(one), larger_policy(two)
            np.testing.assert_allclose(larger_action, action, rtol=1e-6, atol=1e-9)
            for envs in (one, two):
                envs.step(np.asarray(action, dtype=envs.single_action_space.dtype))
            np.testing.assert_allclose(two.y[:, 4:6], 2.0 * one.y[:, 4:6], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("place", [(3.0, 0.0), (0.0, -0.5), (-1.5, 2.0)])
@pytest.mark.parametrize("name", ["BallPark", "BallParkGoal"])
def test_the_bound_of_a_ball_turned_as_its_goal_is_the_straight_line_to_the_edge_of_the_tolerance(
    name, place
):
    env_id, home = f"RigidEnvs/{name}-v0", np.eye(1, 6)
    envs = begun(env_id, 1, seed=0)
    (goal,) = envs.auxiliary(*envs.task.aux_names) if name == "BallParkGoal" else home
    state = {"q": goal[:4], "position": goal[4:] + place}
    envs = begun(env_id, 1, seed=0, options={"state": state})
    expected = np.hypot(*place) - envs.task.position_tolerance
    np.testing.assert_allclose(limit_of(env_id, "path").values(envs), expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("place", "phase", "way", "roll"),
    [((3.0, 4.0), 0.5, 5.0, 0.5), ((0.1, 0.0), -2.0, 0.1, 2.0), ((0.0, 0.04), 0.05, 0.0, 0.0)],
)
def test_the_bound_of_a_coin_is_the_way_or_the_roll_to_the_edge_of_the_tolerance(
    place, phase, way, roll
):
    env_id = "RigidEnvs/CoinPark-v0"
    config = {"position_tolerance": 0.05, "phase_tolerance": 0.1, "radius": 0.5}
    state = {"q": UprightCoin.attitude(0.3, phase), "contact": place}
    envs = begun(env_id, 1, config, seed=0, options={"state": state})
    expected = max(way - 0.05, 0.5 * (roll - 0.1), 0.0)
    np.testing.assert_allclose(limit_of(env_id, "path").values(envs), expected, rtol=1e-12)


def test_the_bound_of_a_pushed_ball_is_that_of_its_mass_and_what_turns_with_it():
    env_id = "RigidEnvs/BallParkDynamic-v0"
    state = {"q": [1.0, 0.0, 0.0, 0.0], "position": (0.0, -3.0)}
    envs = begun(env_id, 1, {"m": 3.0, "beta": 0.5}, seed=0, options={"state": state})
    task = envs.task
    expected = least_time(3.0 - task.position_tolerance, task.force / 4.5, task.speed_tolerance)
    np.testing.assert_allclose(limit_of(env_id, "time").values(envs), expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("moments", "square", "ratio"),  # square of a / torque, and I_max / I_min
    [((2.0, 2.0, 2.0), 3.0 / 4.0, 1.0), ((1.0, 2.0, 3.0), 11.0 / 6.0, 3.0)],
)
def test_the_bound_of_a_turn_is_reached_by_a_body_of_equal_moments_that_may_still_turn(
    moments, square, ratio
):
    """Full torque on all axes gives a = sqrt(3) torque / I, about the diagonal of the body.

    Of others the speed is sqrt(2 T / I_min): at the end, about e3, sqrt(I_max / I_min) of the rate.
    """
    env_id, body = "RigidEnvs/Reorient-v0", dict(zip(("I1", "I2", "I3"), moments, strict=True))
    envs = begun(env_id, 20, {**body, "rate_tolerance": 0.4})
    task = envs.task
    goal = envs.auxiliary(*task.aux_names)
    angle = rotations.distance(envs.y[:, :4], goal) - task.angle_tolerance
    a, w = np.sqrt(square) * task.torque, 0.4 * np.sqrt(ratio)
    limit = limit_of(env_id, "time")
    # areas below speed over time: forward a t^2 / 2, then down from a t to w
    up = (limit.values(envs) + w / a) / 2.0
    np.testing.assert_allclose(a * up**2 - w**2 / (2.0 * a), angle, rtol=1e-12)


@pytest.mark.parametrize(("length", "speed"), [(2.0, 0.0), (2.0, 0.5), (0.01, 0.5)])
def test_the_least_time_is_that_of_full_thrust_and_full_brake(length, speed):
    a, dt = 3.0, 1e-5
    x = v = t = 0.0
    while x < length:  # thrust as long as the speed at the end can still be brought down
        v += a * dt if v * v <= speed * speed + 2.0 * a * (length - x) else -a * dt
        x += v * dt
        t += dt
    # one step too long at the largest speed shifts v^2 by 2 a v dt: so much speed is left at rest
    off = np.sqrt(2.0 * np.sqrt(2.0 * a * length) * dt / a)
    np.testing.assert_allclose(least_time(np.array(length), a, speed), t, atol=off)


def test_the_bootstrap_interval_of_a_normal_sample_is_that_of_its_standard_error():
    x = np.random.default_rng(1).normal(size=500)
    low, high = mean_interval(x)
    width = 1.959964 * x.std() / np.sqrt(500)
    # quantiles of 2000 draws are uncertain by 5 % or so of the width
    np.testing.assert_allclose([low, high], [x.mean() - width, x.mean() + width], atol=0.15 * width)


@pytest.mark.parametrize(
    ("name", "config"),
    [("DiskRollRandom", {"start_lean": 1.0}), ("BallGrid", {"start_cells": 0})],
    ids=str,
)
def test_rollouts_cost_what_rows_are_paid_until_they_end(name, config):
    n, k, steps = 12, 4, 25
    envs = begun(f"RigidEnvs/{name}-v0", n, config, seed=0)
    state, rng = envs.get_state(), np.random.default_rng(0)
    if envs.task.n_choices:
        actions = rng.integers(0, 4, (steps, n, k, 1))
    else:
        actions = rng.uniform(-1.0, 1.0, (steps, n, k, 1)).astype(np.float32)
    costs = policies.Rollouts(envs.task, n, k)(state, actions)
    n_ended = 0
    for j in range(k):
        envs.reset(seed=0)
        alive, paid = np.ones(n, dtype=bool), np.zeros(n)
        for t in range(steps):
            action = actions[t, :, j, 0] if envs.task.n_choices else actions[t, :, j]
            _, rewards, terminated, _, _ = envs.step(action)
            paid += np.where(alive, rewards, 0.0)
            alive &= ~terminated
        n_ended += (~alive).sum()
        np.testing.assert_array_equal(costs[:, j], -paid)
    assert 0 < n_ended < n * k


def test_rollouts_towards_a_goal_cost_the_square_of_the_distance_too():
    n, k, steps = 3, 2, 5
    envs = begun("RigidEnvs/BallParkGoal-v0", n, seed=0)
    state, rng = envs.get_state(), np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (steps, n, k, 2)).astype(np.float32)
    costs = policies.Rollouts(envs.task, n, k)(state, actions)
    for j in range(k):
        envs.reset(seed=0)
        expected = np.zeros(n)
        for action in actions[:, :, j]:
            seen, rewards, terminated, truncated, _ = envs.step(action)
            assert not (terminated | truncated).any()
            away = seen["achieved_goal"].astype(np.float64) - seen["desired_goal"]
            expected += np.sum(away**2, axis=-1) - rewards
        # goals are float32, and so is their difference before it is squared
        rtol = 4.0 * float(np.finfo(np.float32).eps)
        np.testing.assert_allclose(costs[:, j], expected, rtol=rtol)


def test_sampling_solves_the_grid_that_the_random_policy_does_not():
    env_id = "RigidEnvs/BallGrid-v0"
    found = evaluate(env_id, "sampling", n=5)
    assert found.successes.all()
    assert not evaluate(env_id, "random", n=5).successes.any()


def test_sampling_does_in_a_row_what_it_does_in_it_alone():
    env_id, n = "RigidEnvs/AxisFlip-v0", 40  # two blocks of copies, of different sizes
    envs, one = begun(env_id, n, seed=5), begun(env_id, 1, seed=5 + n - 1)
    policy, policy_alone = policies.sampling(envs.task), policies.sampling(one.task)
    for _ in range(3):
        actions, action = policy(envs), policy_alone(one)
        np.testing.assert_array_equal(actions[-1:], action)
        envs.step(actions.astype(np.float32))
        one.step(action.astype(np.float32))


def test_what_is_due_is_the_first_step_of_the_plan():
    class Ramp:
        """Its plans are 0.1, 0.2, 0.3, whatever they cost."""

        n_samples = 2
        fresh = ()

        def start(self, lead, n_action):
            self.fresh = (*self.fresh, *lead)
            return np.zeros((3, *lead, n_action))

        def draw(self, rng, n_action):
            return None

        def sample(self, plan, draws):
            return np.repeat(plan[..., None, :], self.n_samples, axis=-2)

        def improve(self, samples, costs):
            assert costs.shape == samples.shape[1:3]
            return np.broadcast_to([[[0.1]], [[0.2]], [[0.3]]], samples[..., 0, :].shape)

        def shift(self, plan):
            return np.concatenate([plan[1:], plan[-1:]])

    envs = begun(TOP, 3, seed=0)
    ramp = Ramp()
    controller = policies.SamplingController(ramp, np.random.default_rng(0))
    np.testing.assert_array_equal(controller(envs), np.full((3, 2), 0.1))
    envs.step(np.full((3, 2), 0.1, np.float32))
    controller(envs)
    assert ramp.fresh[-2:] == (3, 0)  # rows that have begun go on with their plans


@pytest.mark.parametrize("env_id", [TOP, DETUMBLE, "RigidEnvs/BallGrid-v0"])
def test_256_plans_are_drawn_for_three_seconds_ahead_and_thirty_steps_at_least(env_id):
    task = make_rows(env_id, 1).task
    planner = policies.sampling(task).planner
    horizon = planner.horizon
    assert planner.n_samples == 256
    assert horizon >= 30 and horizon * task.dt >= 3.0 - 0.5 * task.dt
    assert horizon == 30 or horizon * task.dt <= 3.0 + 0.5 * task.dt


def test_every_id_has_metrics_that_matter():
    for env_id in ENVIRONMENTS:
        names = [metric.name for metric in metrics_of(env_id)]
        assert {"success", "return"} < set(names) and len(set(names)) == len(names)
    assert metrics_of("Mine/Top-v0") == ()


def test_without_a_time_limit_the_longest_episode_is_taken_for_it():
    tally = Tally([0, 1], ErrorTerm("tilt", 10.0, "[rad]"))
    for ended in ([True, False], [False, True]):
        told = {"cost": 0.0, "is_success": False, "reward/tilt": 0.25}
        tally.add(np.zeros(2), ended, False, told)
    assert tally.lengths.tolist() == [1, 2] and tally.episodes().limit == 2
    np.testing.assert_allclose(tally.episodes().errors, 0.3)  # as in each of their own steps


TALLIED = [f"RigidEnvs/{name}-v0" for name in ("BallPark", "DiskRoll", "SleepingTop", "BallGrid")]


@pytest.mark.parametrize("env_id", TALLIED)
@pytest.mark.parametrize("seed", [3, 4])
def test_an_episode_counts_as_in_an_evaluation(env_id, seed):
    env = gym.make(env_id)
    env.action_space.seed(seed)
    env.reset(seed=seed)
    record = ENVIRONMENTS[env_id]
    tally, actions, over = Tally([seed], record.error, record.max_episode_steps), [], False
    while not over:
        actions.append(env.action_space.sample())
        _, reward, terminated, truncated, info = env.step(actions[-1])
        tally.add(reward, terminated, truncated, info)
        assert tally.success == info["is_success"]
        over = terminated or truncated
    left = iter(actions)
    theirs = play(lambda _: np.array([next(left)]), make_rows(env_id, 1), [seed], record.error)
    cut = play(lambda _: actions[:1], make_rows(env_id, 1), [seed], limit=2)
    assert cut.limit == 2 and joined([cut, theirs], 2).limit == theirs.limit
    ours = tally.episodes()
    for field in fields(ours):
        if field.name != "bounds":
            assert np.array_equal(getattr(ours, field.name), getattr(theirs, field.name))
    task = env.unwrapped.task
    for metric in metrics_of(env_id):
        assert tally.value(metric, task) == metric.values(theirs, task)[0]


def test_metrics_of_the_cost_have_its_unit():
    units = {
        env_id: metrics_of(env_id)[0].unit(make_rows(env_id, 1).task)
        for env_id in ("RigidEnvs/BallPark-v0", "RigidEnvs/SleepingTop-v0", "RigidEnvs/DiskRoll-v0")
    }
    assert list(units.values()) == ["m", "N m s", ""]
    assert {name for name, metric in METRICS.items() if metric.is_cost} == {"path", "effort"}
