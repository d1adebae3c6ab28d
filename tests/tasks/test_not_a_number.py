"""What would make a reward that is no number has a number, or ends the episode."""

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.systems.rolling_disk.system import RollingDisk


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
