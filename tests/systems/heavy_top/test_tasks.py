"""Tops that are kept up, led into steady precession, or known to fall."""

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.heavy_top.references import (
    asymmetric_balance,
    pivot_balance,
    precession_regulator,
    upright_balance,
)
from rigid_envs.systems.heavy_top.tasks.sleeping_top import SleepingTopRandom
from tests.systems.runs import bound, run

UPRIGHT = {
    "SleepingTop": upright_balance,
    "SleepingTopRandom": upright_balance,
    "PivotTop": pivot_balance,
    "TopRandom": asymmetric_balance,
}


@pytest.mark.parametrize("name", UPRIGHT)
def test_tops_are_kept_upright_by_linear_feedback_from_every_start(name):
    assert run(name, bound(UPRIGHT[name])).success.all()


@pytest.mark.parametrize("branch", ["slow", "fast"])
def test_linear_feedback_leads_into_steady_precession_from_every_start(branch):
    found = run("TopPrecession", bound(precession_regulator), branch=branch)
    assert found.success.mean() >= 0.99


def test_leaving_the_arena_ends_the_episode():
    env = gym.make("RigidEnvs/PivotTop-v0").unwrapped
    for x, out in ((4.9, False), (4.99999, True)):
        env.reset(options={"state": {"pivot": (-x, 0.0), "pivot_velocity": (-1.0, 0.0)}})
        _, _, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
        assert terminated == out
        assert not info["is_success"]


def test_a_fall_ends_the_episode():
    env = gym.make("RigidEnvs/PivotTop-v0").unwrapped
    for tilt, fallen in ((0.49, False), (0.51, True)):
        q = rotations.quaternion_from_axis_angle([0.0, 1.0, 0.0], tilt)
        env.reset(options={"state": {"q": q, "omega_body": (0.0, 0.0, 0.0)}})
        _, _, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
        assert terminated == fallen  # within a step the tilt grows by tilt dt^2 / 2, 0.6 mrad
        assert not info["is_success"]


def test_the_centre_pays_an_upright_top_only():
    env = gym.make("RigidEnvs/PivotTop-v0").unwrapped
    paid = []
    for tilt in (0.0, 0.4):
        q = rotations.quaternion_from_axis_angle([0.0, 1.0, 0.0], tilt)
        env.reset(options={"state": {"q": q, "omega_body": (0.0, 0.0, 0.0)}})
        paid.append(env.step(np.zeros(2, dtype=np.float32))[4]["reward/centre"])
    assert paid[0] == 1.0
    np.testing.assert_allclose(paid[1], 1.0 / (1.0 + 10.0 * 0.4), rtol=2e-3)  # 0.5 mrad of falling


def test_every_drawn_top_can_be_caught_by_the_torque_there_is():
    """A start is caught if ``m g ell theta sqrt(1 - share^2) < torque`` (see the task)."""
    task = SleepingTopRandom()
    heaviest = task.m[1] * task.g * task.ell[1]
    worst = heaviest * task.start_tilt * np.sqrt(1.0 - task.start_spin_low**2)
    assert worst < 0.85 * task.torque
