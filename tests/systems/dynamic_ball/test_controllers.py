"""PlateRegulator and PushAlong: values that are costs, errors that die out, and from how far."""

import numpy as np
import pytest

from rigid_envs.control.linear import region_of_attraction, simulate_closed_loop
from rigid_envs.mechanics import rotations
from rigid_envs.systems.dynamic_ball.controllers import PlateRegulator, PushAlong
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import roll_along
from tests.systems.claims import assert_within_limits_row_by_row

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
def test_the_closed_loop_is_stable(table):
    controller = controller_on(table)
    F, G = controller.step
    assert np.max(np.abs(np.linalg.eigvals(F - G @ controller.regulator.gain))) < 0.95


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
def test_balls_are_led_in_from_ten_metres_away(table):
    controller = controller_on(table)

    def succeeds(offset):
        return held(played(controller, controller.ball.state(position=POINT + offset), 400))

    assert (region_of_attraction(succeeds, DIRECTIONS, [0.1, 1.0, 3.0, 10.0]) == 10.0).all()


@pytest.mark.parametrize("table", TABLES)
def test_balls_are_stopped_that_pass_at_four_metres_a_second(table):
    controller = controller_on(table)

    def succeeds(velocity):
        return held(
            played(controller, controller.ball.state(position=POINT, velocity=velocity), 300)
        )

    assert (region_of_attraction(succeeds, DIRECTIONS, [0.1, 1.0, 4.0]) == 4.0).all()


def test_rates_are_those_commanded_at_the_end_of_the_period():
    controller = controller_on(0.0)
    y = controller.ball.state(tilt_rate=[0.1, -0.2])
    after = controller.ball.advance(y, controller.inputs(y, [0.5, 1.0]), DT, 2)
    np.testing.assert_allclose(controller.ball.tilt_rate(after), [0.2, 0.4], rtol=1e-14)


def test_no_rate_is_larger_than_the_largest_and_each_row_is_as_alone():
    controller, rng = controller_on(1.0), np.random.default_rng(1)
    y = controller.ball.state(
        position=rng.uniform(-5, 5, (4, 3, 2)), tilt=rng.uniform(-1, 1, (4, 3, 2))
    )
    points = rng.uniform(-1, 1, (4, 3, 2))
    assert_within_limits_row_by_row(controller, y, points)


def test_beyond_the_farthest_only_the_direction_of_the_offset_counts():
    controller = controller_on(0.0)
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


def test_no_force_is_larger_than_the_largest_and_each_row_is_as_alone():
    rng = np.random.default_rng(2)
    y = np.broadcast_to(BALL.state(), (5, 4, 13)).copy()
    y[..., 4:8] = rng.uniform(-3.0, 3.0, (5, 4, 4))
    planned = rng.uniform(-1.0, 1.0, (3, 5, 4, 2))
    assert_within_limits_row_by_row(PUSHER, y, *planned, ball=True)


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
    with pytest.raises(ValueError, match=r"share = 1\.1"):
        PushAlong(BALL, 4.0, 0.1, share=1.1)
    with pytest.raises(ValueError, match=r"turntable_rate = 1.0; expected 0"):
        PushAlong(DynamicBall(turntable_rate=1.0), 4.0, 0.1)
    with pytest.raises(ValueError, match="expected a ball at rest, at the start"):
        PUSHER.plan(BALL.state(velocity=[0.1, 0.0]), polygons(1)[0])
    with pytest.raises(ValueError, match=r"reach = 0\.0"):
        roll_along(polygons(1), 0.0)
    with pytest.raises(ValueError, match="rolls has shape"):
        roll_along(np.zeros((3, 3)), 1.0)
