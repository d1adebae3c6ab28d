"""Friction as a parameter of a task, and rewards that would be no numbers."""

import dataclasses
import inspect

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.base.settings import setting
from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import DynamicBallTask
from rigid_envs.systems.dynamic_ball.tasks.ball_plate import BallPlate
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.starts import start_from
from rigid_envs.tasks.task import Task

ID = "RigidEnvs/BallParkDynamic-v0"
NEEDED = 0.4 / 1.4 * 4.0 / 9.81  # beta / (1 + beta) F / (m g), with the largest force


def test_a_force_slips_on_floors_below_the_friction_that_newton_asks_for():
    envs = gym.make_vec(ID, num_envs=400, mu=(0.05, 0.2), observe_params=True, end_on_slip=True)
    observations, _ = envs.reset(seed=0)
    mu = observations[:, -1].astype(np.float64)
    assert mu.min() < 0.06 < 0.19 < mu.max()
    *_, terminated, _, infos = envs.step(np.tile(np.float32([1.0, 0.0]), (400, 1)))
    np.testing.assert_allclose(infos["needed_friction"], NEEDED, rtol=1e-12)
    assert (np.abs(mu - NEEDED) > 1e-6).all()  # what float32 could confuse
    np.testing.assert_array_equal(infos["slips"], mu < NEEDED)
    np.testing.assert_array_equal(terminated, mu < NEEDED)


def test_friction_can_be_given_at_a_reset():
    env = gym.make(ID, end_on_slip=True)
    for mu, slips in ((1.001 * NEEDED, False), (0.999 * NEEDED, True)):
        env.reset(seed=0, options={"params": {"mu": mu}})
        _, _, terminated, _, info = env.step(np.float32([0.0, -1.0]))
        assert info["slips"] == terminated == slips
        assert env.unwrapped.system.mu == mu


def test_a_success_that_slips_is_none():
    tight = {"position_tolerance": 10.0, "angle_tolerance": 3.2, "speed_tolerance": 10.0}
    for mu, success in ((1.0, True), (0.01, False)):
        env = gym.make(ID, end_on_slip=True, mu=mu, **tight)
        env.reset(seed=0)
        _, _, terminated, _, info = env.step(np.float32([1.0, 0.0]))
        assert terminated
        assert info["is_success"] == success


def without_friction():
    """`BallPlate` as a task that knows nothing of friction."""
    classes = DynamicBallTask, BallPlate  # without their base, which has the friction
    own = {name: kind for each in classes for name, kind in inspect.get_annotations(each).items()}
    rules = {field.name: field for field in dataclasses.fields(BallPlate)}
    settings = {
        name: setting(rules[name].default, rules[name].metadata["rule"])
        for name in own.keys() & rules.keys()
    }
    members = [*vars(DynamicBallTask).items(), *vars(BallPlate).items()]
    rest = {name: value for name, value in members if not name.startswith("__")}
    namespace = {**rest, **settings, "__annotations__": own, "__module__": BallPlate.__module__}
    return dataclasses.dataclass(frozen=True)(type("Plain", (Task,), namespace))


def test_a_task_need_not_name_every_parameter_of_its_system():
    task = without_friction()()
    assert task.ranges()["mu"] == (1.0, 1.0)
    assert "mu" not in task.physical_parameters()
    core = Core(task, 3)
    core.reset(np.arange(3))
    core.actions[...] = 1.0
    core.step()
    normal, needed = core.results[-3:-1]
    assert (normal > 0.0).all()
    assert (needed > 0.0).all()
    assert core.system_parameters(0)["mu"] == 1.0
    with pytest.raises(ValueError, match="mu"):
        start_from(task, 3, None, {"mu": 0.5})


def test_a_top_without_spin_has_a_goal_of_zero_and_an_error_that_is_a_number():
    env = gym.make("RigidEnvs/TopPrecession-v0", branch="fast")
    env.reset(seed=0, options={"state": {"q": [1.0, 0, 0, 0], "omega_body": [0.0, 0, 0]}})
    _, reward, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
    assert not terminated
    assert np.isfinite(reward)
    assert info["reward/rate"] == 1.0  # it does not precess, as it should not


def test_a_reward_that_is_no_number_is_a_physics_error():
    env = gym.make("RigidEnvs/DiskRoll-v0").unwrapped
    rolling = RollingDisk().state(omega_body=(0.0, 0.0, 2.0))  # straight on
    env.reset(seed=0, options={"state": {"q": rolling[:4], "omega_body": rolling[4:7]}})
    goal = env._core._slots.aux + env.task.aux_names.index("goal_curvature")
    env._core._write(np.zeros(1, dtype=np.int64), goal, 0.0)  # the error is relative: 0 / 0
    with pytest.raises(ValueError, match="goal_curvature"):  # which is why no state may have it
        env.set_state(env.get_state())
    observation, reward, terminated, _, info = env.step(np.zeros(1, dtype=np.float32))
    assert terminated
    assert info["physics_error"]
    assert reward == 0.0
    assert np.isfinite(observation).all()
    assert all(np.isfinite(value) for value in info.values())
