"""Parking a ball that rolls as it is told: BallPark, BallParkRandom, BallReorient, BallParkGoal."""

from functools import cache

import numpy as np
import pytest

from rigid_envs.envs.goal import RigidGoalVectorEnv
from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.scores.policies import reference_controllers
from rigid_envs.systems.rolling_ball.references import straight_rolls
from tests.systems.runs import bound, run

KINDS = ("BallPark", "BallParkRandom", "BallReorient", "BallParkGoal")


@cache
def planned(env_id):
    """Episodes along three straight rolls."""
    return run(env_id, bound(reference_controllers(f"RigidEnvs/{env_id}-v0")["three_rolls"]))


@pytest.mark.parametrize("env_id", KINDS)
def test_three_straight_rolls_park_every_ball(env_id):
    found, n = planned(env_id), 20
    assert found.success.all()
    if env_id != "BallParkGoal":
        assert (found.steps < 50).all()
    kind = RigidGoalVectorEnv if env_id == "BallParkGoal" else RigidVectorEnv
    envs = kind(f"rigid_envs.systems.rolling_ball.tasks:{env_id}", n)
    envs.reset(seed=0)
    length = np.sum(np.linalg.norm(straight_rolls(envs.task, envs, np.arange(n)), axis=-1), axis=-1)
    # the steps along a plan make up the plan: rounded to float32, each by 6e-8
    assert (found.cost[:n] <= length * (1.0 + 1e-6)).all()


@pytest.mark.parametrize("env_id", ["BallPark", "BallReorient"])
def test_no_way_is_shorter_than_the_bound_less_the_tolerance(env_id):
    found = planned(env_id)
    task = RigidEnv(f"rigid_envs.systems.rolling_ball.tasks:{env_id}").task
    least = task.lower_bound(found.y[0]) - max(task.position_tolerance, task.angle_tolerance)
    assert (found.cost >= least).all()


def goal_rows(n=500, **config):
    envs = RigidGoalVectorEnv("rigid_envs.systems.rolling_ball.tasks:BallParkGoal", n, **config)
    observations, _ = envs.reset(seed=0)
    return envs, observations


def test_goals_are_the_poses_drawn_and_what_is_achieved_is_the_pose():
    envs, seen = goal_rows()
    for part, pose in (
        ("achieved_goal", envs.y),
        ("desired_goal", envs.auxiliary(*envs.task.aux_names)),
    ):
        np.testing.assert_allclose(seen[part][:, :2], pose[:, 4:], rtol=1e-7)
        R = rotations.matrix_from_quaternion(pose[:, :4]).reshape(-1, 9)
        np.testing.assert_allclose(seen[part][:, 2:], R, rtol=0, atol=1e-7)


def test_goals_are_reached_within_both_tolerances_of_distance_and_angle():
    envs, _ = goal_rows(1)
    rng, n = np.random.default_rng(0), 20000
    turn = rng.uniform(0.0, 0.3, (n, 1)) * rotations.rotate(
        rotations.random_quaternion(rng, (n,)), [0.0, 0.0, 1.0]
    )
    q = rotations.random_quaternion(rng, (n,))
    place, way = rng.uniform(-2.0, 2.0, (n, 2)), rng.uniform(-0.15, 0.15, (n, 2))
    matrices = [
        rotations.matrix_from_quaternion(attitude).reshape(n, 9)
        for attitude in (q, rotations.multiply(rotations.exp(turn), q))
    ]
    pair = np.column_stack([place, matrices[0]]), np.column_stack([place + way, matrices[1]])
    reached = envs.task.goal_reward(*pair) == 0.0
    distance, angle = np.linalg.norm(way, axis=1), np.linalg.norm(turn, axis=1)
    np.testing.assert_array_equal(reached, (distance <= 0.1) & (angle <= 0.15))
    assert 0.05 < np.mean(reached) < 0.5


def test_the_dense_term_is_the_cost_of_parking_at_the_pose_from_the_goal():
    envs, _ = goal_rows(200, weight_distance=0.3, radius=(0.5, 1.5))
    park = RigidVectorEnv("rigid_envs.systems.rolling_ball.tasks:BallPark", 200)
    park.reset(seed=0)
    for _ in range(20):
        actions = envs.action_space.sample()
        _, rewards, _, _, infos = envs.step(actions)
        np.testing.assert_allclose(
            rewards, infos["reward/reached"] + 0.3 * infos["reward/distance"], rtol=1e-15
        )
        goal = envs.auxiliary(*envs.task.aux_names)
        turn = rotations.multiply(envs.y[:, :4], rotations.conjugate(goal[:, :4]))
        # a step at rest pays for the pose as it is; the middle radius is 1 m
        park.set_state(
            {**park.get_state(), "y": np.column_stack([turn, envs.y[:, 4:6] - goal[:, 4:6]])}
        )
        _, _, _, _, parked = park.step(np.zeros((200, 2), np.float32))
        cost = sum(parked[f"reward/{name}"] for name in ("position", "twist", "mismatch"))
        # goals are rounded to float32, which the root and the cube root near 0 enlarge
        np.testing.assert_allclose(infos["reward/distance"], cost, atol=1e-3)


def test_at_the_goal_the_dense_term_is_0():
    envs, _ = goal_rows(weight_distance=0.3, position_tolerance=1.5, angle_tolerance=1.5)
    _, rewards, _, _, infos = envs.step(np.zeros((500, 2), np.float32))
    there = infos["is_success"]
    assert there.any()
    assert not rewards[there].any()
    assert (infos["reward/distance"][~there] < -1.0).all()


def test_an_episode_goes_on_at_the_goal():
    found = planned("BallParkGoal")
    assert (found.steps == 100).all()
    assert (found.reward > -50.0).all()  # the way there takes less than half of the time


def parked(env, x, angle=0.0):
    """Whether a ball is parked that stands still at (x, 0), turned about the vertical."""
    q = [np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)]
    env.reset(options={"state": {"q": q, "position": [x, 0.0]}})
    _, _, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
    assert terminated == info["is_success"]
    return terminated


@pytest.mark.parametrize("radius", [1e-3, 0.3, 1.0, 7.0])
def test_ball_is_parked_within_the_tolerances_and_not_outside(radius):
    config = {"radius": radius, "position_tolerance": 2.0, "angle_tolerance": 0.4}
    env = RigidEnv("rigid_envs.systems.rolling_ball.tasks:BallPark", **config)
    for x, angle in ((1.999, 0.0), (0.0, 0.399), (-1.999, -0.399)):
        assert parked(env, x, angle)
    for x, angle in ((2.001, 0.0), (0.0, 0.401), (-1e3, 0.0), (0.0, -3.0)):
        assert not parked(env, x, angle)
