"""Straight rolls and plans of them: where they lead, by the closed form, and in how many steps."""

from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.dynamic_ball.controllers import PushAlong
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import difference, roll_along, rolled, three_rolls
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.reference import cases


def polygons(n_rows, n_sides):
    return np.random.default_rng(0).uniform(-2.0, 2.0, (n_rows, n_sides, 2))


def test_rolls_turn_the_ball_as_the_closed_form_says():
    rolls = polygons(20, 7)
    turns, _ = rolled(rolls)
    closed = np.array([rolling_ball.roll_polygon(row, 1.0) for row in rolls])
    assert np.max(rotations.distance(turns, closed)) < 1e-14


def test_derivatives_are_those_of_the_turn():
    rolls, step = polygons(5, 6), 1e-5
    turn, change = rolled(rolls)
    for k, axis in np.ndindex(6, 2):
        moved = np.zeros_like(rolls)
        moved[:, k, axis] = step
        there, back = rolled(rolls + moved)[0], rolled(rolls - moved)[0]
        difference = rotations.log(rotations.multiply(there, rotations.conjugate(back)))
        # truncation step^2, rounding 1e-16 / step
        np.testing.assert_allclose(difference / (2.0 * step), change[:, k, :, axis], atol=1e-9)
    assert change.shape == (5, 6, 3, 2)
    assert turn.shape == (5, 4)


def test_the_difference_of_poses_is_what_leads_from_one_to_the_other():
    rng = np.random.default_rng(0)
    start, goal = (
        np.concatenate([rotations.random_quaternion(rng, (9,)), rng.normal(size=(9, 2))], axis=1)
        for _ in range(2)
    )
    radius = np.linspace(0.5, 2.0, 9)
    turn, way = difference(start, goal, radius)
    np.testing.assert_allclose(start[:, 4:] + radius[:, None] * way, goal[:, 4:], atol=1e-15)
    assert np.max(rotations.distance(rotations.multiply(turn, start[:, :4]), goal[:, :4])) < 1e-15


BALL = DynamicBall(m=3.0, radius=0.7, beta=0.5)
PUSHER = PushAlong(BALL, force=4.0, dt=0.1, rate=1.5)


def three_sides(n, size=2.0):
    return size * np.random.default_rng(0).uniform(-1.0, 1.0, (n, 3, 2))


def rest(n):
    return np.broadcast_to(BALL.state(position=[0.3, -0.2]), (n, 13))


@pytest.mark.parametrize("reach", [0.05, 0.3, 10.0])
def test_a_ball_that_is_told_to_rolls_as_the_polygon_turns_it(reach):
    ball, rolls = RollingBall(0.7), three_sides(20)
    plan = roll_along(rolls, reach)
    y = np.broadcast_to(ball.state(), (20, 6))
    for action in plan.actions:
        velocity = np.concatenate([reach * action, np.zeros((20, 1))], axis=1)
        y = ball.advance(y, velocity, 1.0, 12)
    np.testing.assert_allclose(y[:, 4:], np.sum(rolls, axis=1), rtol=0, atol=1e-12)
    turns = np.array([rolling_ball.roll_polygon(way, 0.7) for way in rolls])
    assert np.max(rotations.distance(y[:, :4], turns)) < 1e-12


def test_each_roll_takes_the_fewest_steps_that_are_not_too_large():
    rolls, reach = three_sides(50), np.linspace(0.1, 0.5, 50)
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


# The attitude is solved for to 1e-12 rad; the rest is rounding, 2.2e-16 times ways of up to 500.
EXACT = 2e-12
N = 60


def poses(seed, way, angle):
    """States whose positions and rotation vectors have entries of these sizes."""
    rng = np.random.default_rng(seed)
    position = way * rng.uniform(-1.0, 1.0, (N, 2))
    return np.concatenate([rotations.exp(angle * rng.uniform(-1.0, 1.0, (N, 3))), position], axis=1)


def uniform(seed, way, n=N):
    rng = np.random.default_rng(seed)
    position = rng.uniform(-way, way, (n, 2))
    return np.concatenate([rotations.random_quaternion(rng, (n,)), position], axis=1)


def missed(start, goal, rolls, radius=1.0):
    """Distance [m] and angle [rad] between the goal and where the rolls lead to."""
    turns = np.array([rolling_ball.roll_polygon(way, radius) for way in rolls])
    end = start[:, 4:] + np.sum(rolls, axis=1)
    angle = rotations.distance(rotations.multiply(turns, start[:, :4]), goal[:, :4])
    return np.linalg.norm(end - goal[:, 4:], axis=1), angle


def length(rolls):
    return np.sum(np.linalg.norm(rolls, axis=-1), axis=-1)


def bound(start, goal):
    """No way is shorter: it turns the ball by its own length in radii at most."""
    distance = np.linalg.norm(goal[:, 4:] - start[:, 4:], axis=1)
    return np.maximum(distance, rotations.distance(start[:, :4], goal[:, :4]))


HOME = np.broadcast_to([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], (N, 6))
FROM_TO = {
    "anywhere in a square": (uniform(0, 2.0), uniform(1, 2.0)),
    "back where it was": (uniform(2, 0.0), uniform(3, 0.0)),
    "far away": (uniform(4, 100.0), uniform(5, 100.0)),
    "the attitude it has": (poses(6, 2.0, 0.0), poses(7, 2.0, 0.0)),
    "nearly where it is": (poses(8, 1e-3, 1e-3), HOME),
    "twisted a little": (poses(9, 0.0, np.array([0.0, 0.0, 0.1])), HOME),
    "upside down": (poses(10, 2.0, 0.0), np.tile([0.0, 0.6, 0.8, 0.0, 0.3, 0.7], (N, 1))),
    "half a turn about the vertical": (poses(11, 2.0, 0.0), np.tile([0, 0, 0, 1.0, 0, 0], (N, 1))),
    "nowhere": (HOME, HOME),
}


@pytest.mark.parametrize("kind", FROM_TO)
def test_three_rolls_lead_from_any_pose_to_any_other(kind):
    start, goal = FROM_TO[kind]
    rolls = three_rolls(start, goal)
    distance, angle = missed(start, goal, rolls)
    assert rolls.shape == (N, 3, 2)
    assert np.max(distance) < EXACT
    assert np.max(angle) < EXACT
    assert (length(rolls) >= bound(start, goal) - EXACT).all()


def test_where_one_straight_roll_is_enough_it_is_the_plan():
    way = np.random.default_rng(0).uniform(-2.0, 2.0, (N, 2))
    goal = np.concatenate([[rolling_ball.roll_straight(w, 1.0) for w in way], way], axis=1)
    np.testing.assert_allclose(
        length(three_rolls(HOME, goal)), np.linalg.norm(way, axis=1), rtol=EXACT
    )


def test_a_ball_is_carried_along_unturned_by_rolls_of_two_whole_turns_together():
    start, goal = FROM_TO["the attitude it has"]
    np.testing.assert_allclose(length(three_rolls(start, goal)), 4.0 * np.pi, rtol=1e-6)


def test_plans_scale_with_the_radius():
    start, goal = FROM_TO["anywhere in a square"]
    size = np.array([1.0, 1.0, 1.0, 1.0, 0.3, 0.3])
    rolls = three_rolls(size * start, size * goal, radius=0.3)
    assert np.max(missed(size * start, size * goal, rolls, 0.3)) < EXACT
    # the same family, and near its shortest the length depends on the place to second order only
    np.testing.assert_allclose(length(rolls), 0.3 * length(three_rolls(start, goal)), rtol=1e-9)


@pytest.mark.parametrize("case", cases("ball_reach"), ids=itemgetter("id"))
def test_plans_are_no_longer_than_those_of_the_reference(case):
    given = case["in"]
    goal = np.concatenate([given["target_q"], given["target_xy"]])
    rolls = three_rolls([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], goal, radius=given["a"])
    assert length(rolls) < case["out"]["path_length"] + EXACT


def test_plans_of_a_batch_are_those_of_its_rows():
    start = uniform(12, 2.0, 6).reshape(2, 3, 6)
    radius = np.array([0.5, 1.0, 2.0])
    rolls = three_rolls(start, HOME[0], radius=radius)
    assert rolls.shape == (2, 3, 3, 2)
    for row in np.ndindex(2, 3):
        alone = three_rolls(start[row], HOME[0], radius=radius[row[1]])
        # products of matrices may be summed in another order, and each plan is near its shortest
        np.testing.assert_allclose(length(alone), length(rolls[row]), rtol=1e-9)
    assert three_rolls(start[0, 0], HOME[0], radius=radius).shape == (3, 3, 2)


@pytest.mark.long
def test_ten_thousand_of_ten_thousand_poses_are_reached():
    start = uniform(13, 2.0, 10_000)
    distance, angle = missed(
        start, np.broadcast_to(HOME[0], start.shape), three_rolls(start, HOME[0])
    )
    assert np.max(distance) < 1e-9
    assert np.max(angle) < 1e-9


def test_what_is_no_pose_or_no_ball_is_refused():
    with pytest.raises(ValueError, match=r"radius = 0\.0; expected positive"):
        three_rolls(HOME[0], HOME[0], radius=0.0)
    with pytest.raises(ValueError, match=r"^q = .*; expected length 1"):
        three_rolls([2.0, 0.0, 0.0, 0.0, 0.0, 0.0], HOME[0])
    with pytest.raises(ValueError, match=r"shape \(5,\)"):
        three_rolls(HOME[0], np.zeros(5))
