"""Parking a ball that rolls as it is told: BallPark, BallParkRandom, BallReorient, BallParkGoal."""

from functools import cache

import numpy as np
import pytest

from rigid_envs.envs.goal import RigidGoalVectorEnv
from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.scores.policies import reference_controllers
from rigid_envs.systems.rolling_ball.references import straight_rolls
from tests.systems.runs import bound, run

KINDS = ("BallPark", "BallParkRandom", "BallReorient", "BallParkGoal")


@cache
def planned(env_id):
    """Episodes along three straight rolls."""
    return run(env_id, bound(reference_controllers(f"RigidEnvs/{env_id}-v0")["three_rolls"]), n=40)


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
