"""A ball on a plate or pushed: its controllers, their reach, and the tasks in which they act."""

import numpy as np
import pytest

from rigid_envs.control.linear import region_of_attraction, simulate_closed_loop
from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import least_time
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.finding import of_plans, plan
from rigid_envs.systems.dynamic_ball.controllers import PlateRegulator, PushAlong, TiltTransfer
from rigid_envs.systems.dynamic_ball.references import plate_regulator, pushed
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import BallParkDynamic, speed_bound
from rigid_envs.systems.dynamic_ball.tasks.ball_plate import BallPlate
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import roll_along
from tests.refusals import refuses
from tests.systems.runs import bound, rows, run, still

# PlateRegulator and PushAlong: values that are costs, errors that die out, and from how far.


DT, RATE = 0.1, 0.4
TABLES = (0.0, 1.0, -2.0)
POINT = np.array([0.4, -0.3])


def controller_on(table):
    return PlateRegulator(DynamicBall(turntable_rate=table), RATE, DT)


def played(controller, y, n, n_substeps=40):
    """States of the closed loop, the limit of the rates included."""

    def step(y):
        return controller.ball.advance(
            y, controller.inputs(y, controller(y, POINT)), DT, n_substeps
        )

    return simulate_closed_loop(step, y, n)


@pytest.mark.parametrize("table", TABLES)
def test_the_linear_step_is_that_of_the_system(table):
    controller = controller_on(table)
    F, G = controller.step
    h = 1e-5
    for k in range(10):
        x = h * np.eye(10)[k]
        y = controller.ball.state(
            position=POINT + x[:2], velocity=x[2:4], tilt=x[4:6], tilt_rate=x[6:8]
        )
        # on a turntable the middle of the table is at rest, not the point
        y[4:6] -= POINT
        after = controller.ball.advance(y, controller.inputs(y, x[8:] / RATE), DT, 20)
        found = controller.error(after, [0.0, 0.0]) / h
        # the next order is h^2 of an odd motion; rounding is 1e-16 / h
        np.testing.assert_allclose(found, np.hstack([F, G])[:, k], rtol=0, atol=1e-8)


def test_the_riccati_value_is_the_cost_of_small_errors():
    controller, rng = controller_on(0.0), np.random.default_rng(0)
    y = controller.ball.state(position=POINT + 1e-3 * rng.uniform(-1, 1, (20, 2)))
    states = played(controller, y, 150, 10)
    error, action = controller.error(states, POINT), controller(states, POINT)
    cost = np.sum(error**2 * ([1.0] * 2 + [1e-3] * 6), axis=-1)
    cost += controller.input_weight * RATE**2 * np.sum(action**2, axis=-1)
    value = controller.value(states, POINT)
    # offsets of 1e-3 m in a motion whose next order is their square
    np.testing.assert_allclose(np.sum(cost[:-1], axis=0) + value[-1], value[0], rtol=1e-4)
    big = value[:-1] > 1e-6 * value[0]
    assert (np.diff(value, axis=0)[big] < 0.0).all()


def held(states):
    """Whether the last two seconds were within 0.05 m."""
    away = np.linalg.norm(states[-20:, ..., 4:6] - POINT, axis=-1)
    return (away < 0.05).all(axis=0)


DIRECTIONS = np.stack([np.cos(np.arange(5.0)), np.sin(np.arange(5.0))], axis=-1)


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize(
    ("part", "sizes"), [("position", [0.1, 1, 3, 10]), ("velocity", [0.1, 1, 4])]
)
def test_balls_are_led_in_from_ten_metres_away_and_from_four_metres_a_second(table, part, sizes):
    controller = controller_on(table)

    def succeeds(offset):
        begin = {"position": POINT, "velocity": 0.0 * POINT}
        y = controller.ball.state(**begin | {part: begin[part] + offset})
        return held(played(controller, y, 400 if part == "position" else 300))

    assert (region_of_attraction(succeeds, DIRECTIONS, sizes) == sizes[-1]).all()


def test_rates_are_those_commanded_at_the_end_of_the_period():
    controller = controller_on(0.0)
    y = controller.ball.state(tilt_rate=[0.1, -0.2])
    after = controller.ball.advance(y, controller.inputs(y, [0.5, 1.0]), DT, 2)
    np.testing.assert_allclose(controller.ball.tilt_rate(after), [0.2, 0.4], rtol=1e-14)


def test_beyond_the_farthest_only_the_direction_of_the_offset_counts():
    controller = PlateRegulator(DynamicBall(), 100.0, DT)  # whose limit cuts no rate
    near, far = (
        controller(controller.ball.state(position=d * np.array([0.6, 0.8])), [0, 0])
        for d in (1, 50)
    )
    np.testing.assert_allclose(near, far, rtol=1e-14)


BALL = DynamicBall(m=3.0, radius=0.7, beta=0.5)
PUSHER = PushAlong(BALL, force=4.0, dt=0.1, rate=1.5)
LARGEST = 4.0 / (3.0 * 1.5)  # acceleration


def polygons(n, size=2.0):
    return size * np.random.default_rng(0).uniform(-1.0, 1.0, (n, 3, 2))


def rest(n):
    return np.broadcast_to(BALL.state(position=[0.3, -0.2]), (n, 13))


@pytest.mark.parametrize("size", [2.0, 0.005])  # [m]; short ones take one period and back
def test_a_pushed_ball_moves_as_planned_and_rolls_as_the_polygon_turns_it(size):
    rolls = polygons(20, size)
    plan, y = PUSHER.plan(rest(20), rolls), rest(20)
    for k, push in enumerate(plan.pushes):
        # the motion in a period is a parabola of the acceleration: rounding, and 5 steps for it
        np.testing.assert_allclose(y[:, 4:6], plan.positions[k], rtol=0, atol=1e-12)
        np.testing.assert_allclose(y[:, 6:8], plan.velocities[k], rtol=0, atol=1e-12)
        force = 4.0 * PUSHER(y, push, plan.positions[k], plan.velocities[k])
        held = np.concatenate([force, np.zeros((20, 2))], axis=1)
        y = BALL.advance(y, held, 0.1, 5)
    np.testing.assert_allclose(y[:, 6:8], 0.0, rtol=0, atol=1e-12)
    # the way to where it stops at each corner is straight: the ball is turned about one axis
    turns = np.array([rolling_ball.roll_polygon(way, 0.7) for way in rolls])
    assert np.max(rotations.distance(y[:, :4], turns)) < 1e-11


def test_rolls_are_the_fastest_but_for_whole_periods():
    rolls = polygons(50)
    plan = PUSHER.plan(rest(50), rolls)
    assert not PUSHER.plan(rest(4), np.zeros((4, 3, 2))).steps.any()  # rolls of no length
    assert np.max(np.linalg.norm(plan.pushes, axis=-1)) <= 0.98 * LARGEST * (1.0 + 1e-12)
    # bang-bang: 2 sqrt(L / a) for each roll
    fastest = np.sum(2.0 * np.sqrt(np.linalg.norm(rolls, axis=-1) / (0.98 * LARGEST)), axis=1)
    assert (0.1 * plan.steps >= fastest * (1.0 - 1e-12)).all()
    assert (0.1 * plan.steps < fastest + 3 * 0.2).all()


def test_errors_die_out_with_both_eigenvalues_of_the_sampled_motion_equal():
    z = np.exp(-1.5 * 0.1)
    np.testing.assert_allclose(np.trace(PUSHER.closed_loop), 2.0 * z, rtol=1e-14)
    np.testing.assert_allclose(np.linalg.det(PUSHER.closed_loop), z**2, rtol=1e-13)


def test_the_error_of_a_ball_is_multiplied_by_the_closed_loop_in_each_period():
    rng, rolls = np.random.default_rng(1), polygons(20)
    plan, y = PUSHER.plan(rest(20), rolls), rest(20).copy()
    error = 0.005 * rng.uniform(-1.0, 1.0, (20, 2, 2))  # small enough for the rest of the force
    y[:, 4:8] += error.reshape(20, 4)
    for k, push in enumerate(plan.pushes):
        found = y[:, 4:8] - np.concatenate([plan.positions[k], plan.velocities[k]], axis=1)
        np.testing.assert_allclose(found, error.reshape(20, 4), rtol=0, atol=1e-12)
        error = PUSHER.closed_loop @ error
        force = 4.0 * PUSHER(y, push, plan.positions[k], plan.velocities[k])
        y = BALL.advance(y, np.concatenate([force, np.zeros((20, 2))], axis=1), 0.1, 5)


def test_plans_of_a_batch_are_those_of_its_rows():
    rolls = polygons(6).reshape(2, 3, 3, 2)
    reach = np.linspace(0.1, 0.3, 6).reshape(2, 3)
    plan = roll_along(rolls, reach)
    pushed = PUSHER.plan(BALL.state(), rolls)
    for row in np.ndindex(2, 3):
        alone = roll_along(rolls[row], reach[row])
        np.testing.assert_array_equal(plan.actions[: len(alone.actions), *row], alone.actions)
        way = PUSHER.plan(BALL.state(), rolls[row])
        np.testing.assert_array_equal(pushed.positions[: len(way.positions), *row], way.positions)
        assert pushed.steps[row] == way.steps


def test_what_cannot_be_pushed_or_planned_is_refused():
    refuses(r"share = 1\.1", PushAlong, BALL, 4.0, 0.1, share=1.1)
    with pytest.raises(ValueError, match=r"turntable_rate = 1.0; expected 0"):
        PushAlong(DynamicBall(turntable_rate=1.0), 4.0, 0.1)
    for moving in ({"velocity": [[0.0, 0.0], [0.1, 0.0]]}, {"spin": [0.0, 0.1]}):
        message = r"^y\[1\] = .*; expected a ball at rest, at the start"
        refuses(message, PUSHER.plan, BALL.state(**moving), polygons(2))
    refuses(r"reach = 0\.0", roll_along, polygons(1), 0.0)
    refuses("rolls has shape", roll_along, np.zeros((3, 3)), 1.0)


# BallParkDynamic and BallPlate: pushed along plans, held by a regulator, on a table that moves.


N = 200
PUSHED, PLATE = "dynamic_ball.tasks:BallParkDynamic", "dynamic_ball.tasks:BallPlate"


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_plan_that_is_tracked_parks_every_ball_at_rest(noise):
    found = run("BallParkDynamic", bound(pushed), 40, action_noise=noise)
    assert found.success.all()
    assert np.mean(found.steps) < 33
    assert (found.steps < 45).all()


def test_rolling_off_costs_more_than_staying_for_the_whole_episode():
    assert np.min(run("BallParkDynamic", still, N).reward) > -BallParkDynamic().weight_off


@pytest.mark.parametrize("turntable_rate", [0.0, 0.3])
def test_no_ball_becomes_faster_than_the_step_allows_for(turntable_rate):
    config = {"turntable_rate": turntable_rate, "n_substeps": 8}
    envs = rows(PUSHED, N, **config)
    system = envs.systems[0]
    rng, reached = np.random.default_rng(0), np.zeros(N)
    edge = 2.0 * np.sqrt(2.0) + 7.0
    y = np.zeros((N, 13))
    angle = rng.uniform(0.0, 2.0 * np.pi, N)
    y[:, 0], y[:, 4], y[:, 5] = 1.0, 0.99 * edge * np.cos(angle), 0.99 * edge * np.sin(angle)
    envs.reset(options={"state": y})
    # from the edge always onwards, but for the first push, which is inward: a ball that gains most
    inward = -y[:, 4:6] / np.linalg.norm(y[:, 4:6], axis=1, keepdims=True)
    ended = np.zeros(N, dtype=bool)
    for _ in range(150):
        speed = np.linalg.norm(envs.y[:, 6:8], axis=1, keepdims=True)
        onward = np.where(speed > 0.0, envs.y[:, 6:8] / np.maximum(speed, 1e-9), inward)
        _, _, terminated, *_ = envs.step(onward.astype(np.float32))
        ended |= terminated
        rate = np.linalg.norm(system.omega_plate(envs.y), axis=1)
        reached = np.where(ended, reached, np.maximum(reached, rate))
    largest = BallParkDynamic(**config).largest_rate(10.0)
    assert ended.all()
    assert 0.5 * largest < np.max(reached) < largest


def test_the_bound_on_the_speed_solves_its_inequality():
    # w^3 <= 6 w + 1 + 6 kappa in units of reach and push, at the bound w = v - kappa and beyond
    for kappa in (0.0, 0.1, 1.0, 10.0, 1e3):
        v = speed_bound(1.0, 1.0, kappa)
        assert (v - kappa) ** 3 >= 6.0 * (v - kappa) + 1.0 + 6.0 * kappa


@pytest.mark.parametrize("turntable_rate", [0.0, -0.7])
def test_steps_on_the_level_plate_are_those_of_the_system_to_the_bit(turntable_rate):
    envs = rows(PUSHED, 70, turntable_rate=turntable_rate, radius=0.7, beta=0.6, n_substeps=15)
    task, rng = envs.task, np.random.default_rng(5)
    y = envs.y
    y[:, 6:9] = rng.uniform(-1.0, 1.0, (70, 3))  # spinning, too
    envs.reset(options={"state": y})
    for _ in range(6):
        action = rng.uniform(-0.7, 0.7, (70, 2)).astype(np.float32)
        assert not envs.step(action)[2].any()
        force = task.force * np.concatenate([action, np.zeros((70, 2))], axis=1)
        y = task.system().advance(y, force, task.dt, task.n_substeps)
        np.testing.assert_array_equal(envs.y, y)


@pytest.mark.parametrize("name", ["tilt", "tilt_rate"])
def test_a_tilted_plate_is_refused(name):
    envs = rows(PUSHED, 2)
    with pytest.raises(ValueError, match=rf"{name} = \[0\. +0\.1\]; expected 0"):
        envs.reset(options={"state": {name: [0.0, 0.1]}})


@pytest.mark.parametrize("turntable_rate", [0.0, 1.0, -2.0])
def test_the_regulator_holds_every_ball_on_its_point(turntable_rate):
    config = {"turntable_rate": turntable_rate, "n_substeps": 6}
    found = run("BallPlate", bound(plate_regulator), N, **config)
    assert found.success.all()
    assert (found.steps == 200).all()


@pytest.mark.parametrize("n_held", [1, 3, 30])
def test_no_action_tilts_the_table_beyond_its_limit(n_held):
    envs = rows(PLATE, N, tilt_rate=1.5, margin=20.0, n_substeps=30)
    rng = np.random.default_rng(n_held)
    limit, dt = envs.task.tilt_limit, envs.task.dt
    for k in range(300):
        if k % n_held == 0:
            action = rng.choice([-1.0, -0.3, 0.0, 1.0], (N, 2)).astype(np.float32)
        angle, rate = envs.y[:, 9:11], envs.y[:, 11:13]
        envs.step(action)
        change = envs.y[:, 11:13] - rate
        # inside a period the angle is a parabola; it is largest where the rate passes through 0
        passes = (rate * envs.y[:, 11:13] < 0.0) & (change != 0.0)
        inside = angle - 0.5 * dt * rate**2 / np.where(passes, change, np.inf)
        largest = np.maximum(np.abs(envs.y[:, 9:11]), np.where(passes, np.abs(inside), 0.0))
        assert np.max(largest) <= limit * (1.0 + 1e-12)
    assert np.max(largest) > 0.9 * limit


@pytest.mark.parametrize("turntable_rate", [0.0, 1.0])
def test_no_ball_on_a_table_becomes_faster_than_the_step_allows_for(turntable_rate):
    config = {"turntable_rate": turntable_rate, "n_substeps": 6}
    envs = rows(PLATE, 1000, **config)
    system, largest, reached = envs.systems[0], BallPlate(**config).largest_rate(40.0), 0.0
    for k in range(400):
        # downhill along the velocity, by half of the rows; the other half to and fro
        vx, vy = envs.y[:, 6], envs.y[:, 7]
        onward = np.sign(np.stack([-vy, vx], axis=1))
        swing = np.sign(np.sin(0.003 * np.arange(1000)[:, None] * k + np.array([0.0, 1.0])))
        action = np.where(np.arange(1000)[:, None] % 2, onward, swing)
        envs.step(action.astype(np.float32))
        reached = max(reached, np.max(np.linalg.norm(system.omega_plate(envs.y), axis=1)))
    assert 0.25 * largest < reached < largest


# Plans that lead a ball on a table to a point soon: linear programmes.

SMALL_BALL = DynamicBall(radius=0.002)  # hardly moved by the turning of the table itself


def transfer(ball, tilt_rate=10.0, tilt_limit=0.05, tolerance=1e-3, hold=5, dt=0.1):
    regulator = PlateRegulator(ball, tilt_rate, dt)
    return TiltTransfer(regulator, tilt_limit, tolerance, hold, n_substeps=2)


def test_the_first_deadline_that_can_be_met_is_that_of_a_point_mass():
    """A double integrator: full tilt one way, then the other, and still within the tolerance."""
    planner, d, a = transfer(SMALL_BALL), 0.8, 9.81 * 0.05 / 1.4
    start, along_x = np.zeros(9), np.array([d, 0.0])
    least = least_time(np.array(d - 1e-3), a, 2.0 * np.sqrt(a * 1e-3)) / 0.1

    def error(deadline, point):
        T = planner.periods(deadline)
        steps, near = planner.level(T), np.zeros((T, 2))
        return planner.plan(start, point, deadline, steps, near, np.inf).error

    met = [k for k in range(25, 36) if error(k, along_x) < 1.0]
    assert least - 0.1 < met[0] < least + 2.0  # the tilt takes a period to turn
    assert met == list(range(met[0], 36))
    both = along_x @ np.array([[0.6, -0.8], [0.8, 0.6]])
    assert error(met[0], both) < 1.0  # a shorter way about each of the axes


def test_a_plan_obeys_the_limits_of_the_table_and_moves_as_it_expects():
    ball = DynamicBall()
    planner, start = transfer(ball, 0.4, 0.1, 0.05, 20), np.zeros(9)
    start[:4] = 0.3, -0.2, 0.1, 0.2
    T = planner.periods(24)
    steps, near = planner.level(T), np.zeros((T, 2))
    for _ in range(4):  # linearised along what the last one did
        plan = planner.plan(start, np.array([-0.4, 0.3]), 24, steps, near, 0.8)
        x = [start]
        for rates in plan.rates:
            x.append(planner.advance(x[-1][None], rates[None])[0])
        x = np.array(x)
        steps, near = planner.along(x), plan.rates
    assert np.abs(plan.rates).max() <= 0.4 + 1e-9
    assert np.abs(x[1:, 5:7] + 0.05 * plan.rates).max() <= 0.1
    np.testing.assert_allclose(x, plan.x, atol=1e-4)  # it changes little in the last round
    assert plan.error < 1.0
    assert np.linalg.norm(x[24:, :2] - [-0.4, 0.3], axis=1).max() < 0.05
    np.testing.assert_allclose(x[-1, [2, 3, 5, 6, 7, 8]], 0.0, atol=1e-3)


def test_steps_are_linearised_along_a_motion():
    ball, rng = DynamicBall(), np.random.default_rng(0)
    planner = transfer(ball)
    x = [0.1 * rng.normal(size=9)]
    rates = 0.3 * rng.normal(size=(6, 2))
    for each in rates:
        x.append(planner.advance(x[-1][None], each[None])[0])
    steps = planner.along(np.array(x))
    np.testing.assert_allclose(
        np.einsum("tij,tj->ti", steps.F, np.array(x[:-1]))
        + np.einsum("tij,tj->ti", steps.G, rates)
        + steps.c,
        x[1:],
        atol=1e-12,
    )
    off, other = 1e-3 * rng.normal(size=(6, 9)), 1e-3 * rng.normal(size=(6, 2))
    moved = planner.advance(np.array(x[:-1]) + off, rates + other) - x[1:]
    expected = np.einsum("tij,tj->ti", steps.F, off) + np.einsum("tij,tj->ti", steps.G, other)
    np.testing.assert_allclose(moved, expected, atol=1e-5)  # squares of 1e-3


def test_planned_tilts_hold_the_ball_sooner_than_the_regulator_does():
    env_id, n = "RigidEnvs/BallPlate-v0", 2
    found = evaluate(env_id, of_plans(plan(env_id, [], np.arange(n))), n=n)
    lqr = evaluate(env_id, "lqr", n=n)
    assert found.successes.all() and (found.costs < 0.9 * lqr.costs).all()
