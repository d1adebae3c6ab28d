"""Rolling along polygons: where plans lead, how fast, and how errors die out."""

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.dynamic_ball.controllers import PushAlong
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import roll_along
from rigid_envs.systems.rolling_ball.system import RollingBall

BALL = DynamicBall(m=3.0, radius=0.7, beta=0.5)
PUSHER = PushAlong(BALL, force=4.0, dt=0.1, rate=1.5)
LARGEST = 4.0 / (3.0 * 1.5)  # acceleration


def polygons(n, size=2.0):
    return size * np.random.default_rng(0).uniform(-1.0, 1.0, (n, 3, 2))


def rest(n):
    return np.broadcast_to(BALL.state(position=[0.3, -0.2]), (n, 13))


@pytest.mark.parametrize("reach", [0.05, 0.3, 10.0])
def test_a_ball_that_is_told_to_rolls_as_the_polygon_turns_it(reach):
    ball, rolls = RollingBall(0.7), polygons(20)
    plan = roll_along(rolls, reach)
    y = np.broadcast_to(ball.state(), (20, 6))
    for action in plan.actions:
        velocity = np.concatenate([reach * action, np.zeros((20, 1))], axis=1)
        y = ball.advance(y, velocity, 1.0, 12)
    np.testing.assert_allclose(y[:, 4:], np.sum(rolls, axis=1), rtol=0, atol=1e-12)
    turns = np.array([rolling_ball.roll_polygon(way, 0.7) for way in rolls])
    assert np.max(rotations.distance(y[:, :4], turns)) < 1e-12


def test_each_roll_takes_the_fewest_steps_that_are_not_too_large():
    rolls, reach = polygons(50), np.linspace(0.1, 0.5, 50)
    plan = roll_along(rolls, reach)
    lengths = np.linalg.norm(rolls, axis=-1)
    np.testing.assert_array_equal(
        plan.steps, np.sum(np.ceil(lengths / reach[:, None]), axis=1).astype(int)
    )
    assert np.max(np.linalg.norm(plan.actions, axis=-1)) <= 1.0 + 1e-9
    moves = plan.actions.any(axis=-1)
    np.testing.assert_array_equal(np.sum(moves, axis=0), plan.steps)
    np.testing.assert_allclose(plan.length, np.sum(lengths, axis=1))
    assert not plan.actions[-1].any()


def test_a_roll_of_no_length_takes_no_step():
    plan = roll_along(np.zeros((4, 3, 2)), 0.3)
    assert plan.actions.shape == (1, 4, 2)
    assert not plan.steps.any()
    assert not PUSHER.plan(rest(4), np.zeros((4, 3, 2))).steps.any()


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
    actions = PUSHER(y, *planned)
    assert np.max(np.linalg.norm(actions, axis=-1)) <= 1.0 + 1e-15
    for row in np.ndindex(5, 4):
        np.testing.assert_array_equal(PUSHER(y[row], *planned[:, *row]), actions[row])


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
    with pytest.raises(ValueError, match="force = 0"):
        PushAlong(BALL, 0.0, 0.1)
    with pytest.raises(ValueError, match="expected a ball at rest, at the start"):
        PUSHER.plan(BALL.state(velocity=[0.1, 0.0]), polygons(1)[0])
    with pytest.raises(ValueError, match=r"reach = 0\.0"):
        roll_along(polygons(1), 0.0)
    with pytest.raises(ValueError, match="rolls has shape"):
        roll_along(np.zeros((3, 3)), 1.0)
