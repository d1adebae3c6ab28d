"""The planner of three straight rolls, judged by the closed form of rolling along a polygon."""

from operator import itemgetter

import numpy as np
import pytest

from rigid_envs import rotations
from rigid_envs.analytic import rolling_ball
from tests.reference import cases
from tests.tasks.controllers.three_rolls import plan

# The attitude is solved for to 1e-12 rad; the rest is rounding, 2.2e-16 times ways of up to 500.
EXACT = 2e-12
N = 60


def poses(seed, way, angle):
    """States whose positions and rotation vectors have entries of these sizes."""
    rng = np.random.default_rng(seed)
    position = way * rng.uniform(-1.0, 1.0, (N, 2))
    return np.concatenate([rotations.exp(angle * rng.uniform(-1.0, 1.0, (N, 3))), position], axis=1)


def uniform(seed, way):
    rng = np.random.default_rng(seed)
    position = rng.uniform(-way, way, (N, 2))
    return np.concatenate([rotations.random_quaternion(rng, (N,)), position], axis=1)


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
    rolls = plan(start, goal)
    distance, angle = missed(start, goal, rolls)
    assert rolls.shape == (N, 3, 2)
    assert np.max(distance) < EXACT
    assert np.max(angle) < EXACT
    assert (length(rolls) >= bound(start, goal) - EXACT).all()


def test_where_one_straight_roll_is_enough_it_is_the_plan():
    way = np.random.default_rng(0).uniform(-2.0, 2.0, (N, 2))
    goal = np.concatenate([[rolling_ball.roll_straight(w, 1.0) for w in way], way], axis=1)
    np.testing.assert_allclose(length(plan(HOME, goal)), np.linalg.norm(way, axis=1), rtol=EXACT)


def test_a_ball_is_carried_along_unturned_by_rolls_of_two_whole_turns_together():
    start, goal = FROM_TO["the attitude it has"]
    np.testing.assert_allclose(length(plan(start, goal)), 4.0 * np.pi, rtol=1e-6)


def test_plans_scale_with_the_radius():
    start, goal = FROM_TO["anywhere in a square"]
    size = np.array([1.0, 1.0, 1.0, 1.0, 0.3, 0.3])
    rolls = plan(size * start, size * goal, radius=0.3)
    assert np.max(missed(size * start, size * goal, rolls, 0.3)) < EXACT
    # the same family, and near its shortest the length depends on the place to second order only
    np.testing.assert_allclose(length(rolls), 0.3 * length(plan(start, goal)), rtol=1e-9)


@pytest.mark.parametrize("case", cases("ball_reach"), ids=itemgetter("id"))
def test_plans_are_no_longer_than_those_of_the_reference(case):
    given = case["in"]
    goal = np.concatenate([given["target_q"], given["target_xy"]])
    rolls = plan([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], goal, radius=given["a"])
    assert length(rolls) < case["out"]["path_length"] + EXACT
