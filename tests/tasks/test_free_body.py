"""What holds for all tasks of a free body: they are not solved by accident, and stay in bounds."""

import importlib

import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.systems.free_body.tasks.axis_flip import AxisFlip
from rigid_envs.systems.free_body.tasks.intermediate_axis_single import IntermediateAxisSingle
from rigid_envs.systems.free_body.tasks.shared import fastest, spun_up
from rigid_envs.systems.free_body.tasks.spin_capture import SpinCapture
from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.tasks.runs import at_random, run, still

BOUNDED = ("IntermediateAxisSingle", "SpinCapture", "AxisFlip", "Detumble", "Reorient")
ALL = ("IntermediateAxis", "IntermediateAxisRandom", *BOUNDED)


def spin_up(envs):
    """As much energy as possible at every moment: each torque along its angular velocity."""
    omega = envs.y[:, 4:7]
    if type(envs.task) is IntermediateAxisSingle:
        omega = omega[:, 2:]
    if envs.task.n_goal or type(envs.task) in (AxisFlip, SpinCapture, IntermediateAxisSingle):
        return np.where(omega < 0.0, -1.0, 1.0)
    momentum = omega * envs.task.system().moments
    return momentum / np.linalg.norm(momentum, axis=-1, keepdims=True)


@pytest.mark.parametrize("policy", [still, at_random()], ids=["still", "random"])
@pytest.mark.parametrize("name", ALL)
def test_neither_doing_nothing_nor_random_actions_succeed(name, policy):
    # of 1000 starts none succeeds, but for one of IntermediateAxisSingle under random actions
    assert run(name, policy).success.mean() <= 0.005


@pytest.mark.parametrize("name", BOUNDED)
def test_no_motion_before_the_time_limit_is_faster_than_its_bound(name):
    record = ENVIRONMENTS[f"RigidEnvs/{name}-v0"]
    module, kind = record.task.split(":")
    task_type = getattr(importlib.import_module(module), kind)
    fast = np.linalg.norm(run(name, spin_up).y[..., 4:7], axis=-1).max()
    task = task_type()
    assert 0.3 < fast / task.largest_rate(record.max_episode_steps * task.dt) <= 1.0


def test_bounds_of_drawn_bodies_are_those_of_the_worst_one():
    ranges = ((1.0, 1.3), (1.7, 2.1), (2.3, 2.7))
    torques = (0.1, 0.2, 0.3)
    worst = fastest(ranges, spun_up(ranges, 1.5, torques, 10.0))
    for moments in np.random.default_rng(0).uniform(*np.transpose(ranges), (1000, 3)).tolist():
        body = tuple(moments)
        assert fastest(body, spun_up(body, 1.5, torques, 10.0)) <= worst


@pytest.mark.parametrize("task", [IntermediateAxisSingle, SpinCapture, AxisFlip])
def test_moments_out_of_order_are_refused_by_name(task):
    with pytest.raises(ConfigError, match=r"^config\.I1: I1 = 2\.5; expected less than I2 = 2\.0"):
        task(I1=2.5)
    with pytest.raises(ConfigError, match=r"^config\.I3: I3 = .*; expected more than I2 = "):
        task(I2=(1.5, 2.5), I3=(2.4, 2.45))
