"""Calls in the wrong order raise, and say what to call."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded

from rigid_envs.testing.environments import actions, assert_same_bits, break_physics, single, vector

MODES = ("NextStep", "SameStep", "Disabled")


def test_step_before_the_first_reset_raises(env_id):
    for make in [single, gym.make]:
        with pytest.raises(ResetNeeded, match="reset"):
            make(env_id).step(actions(env_id, 1, 1)[0, 0])


def test_step_after_the_end_raises_until_reset(env_id):
    for make in [single, gym.make]:
        env = make(env_id)
        env.reset(seed=0)
        break_physics(env.unwrapped)
        action = actions(env_id, 1, 1)[0, 0]
        assert env.step(action)[2]
        for _ in range(2):
            with pytest.raises(ResetNeeded, match="reset"):
                env.step(action)
        env.reset()
        env.step(action)


def test_step_after_close_raises_until_reset(env_id):
    for make in [single, gym.make]:
        env, open_one = make(env_id), make(env_id)
        action = actions(env_id, 1, 1)[0, 0]
        for each in (env, open_one):
            each.reset(seed=0)
        for _ in range(2):
            env.close()
            env.close()
            with pytest.raises(ClosedEnvironmentError):
                env.step(action)
            env.unwrapped.set_state(env.unwrapped.get_state())
            with pytest.raises(ClosedEnvironmentError):
                env.step(action)
            with pytest.raises(ValueError):
                env.reset(options={"speed": 1.0})
            with pytest.raises(ClosedEnvironmentError):
                env.step(action)
            assert_same_bits(env.reset(), open_one.reset())
            assert_same_bits(env.step(action), open_one.step(action))


def test_vector_step_before_the_first_reset_raises(env_id):
    for mode in MODES:
        envs = vector(env_id, 3, autoreset_mode=mode)
        with pytest.raises(ResetNeeded, match="reset"):
            envs.step(actions(env_id, 1, 3)[0])


def test_vector_step_after_close_raises_until_reset(env_id):
    for mode in MODES:
        envs, open_ones = (vector(env_id, 3, autoreset_mode=mode) for _ in range(2))
        batch = actions(env_id, 1, 3)[0]
        for each in (envs, open_ones):
            each.reset(seed=0)
        for _ in range(2):
            envs.close()
            with pytest.raises(ValueError):
                envs.reset(options={"speed": 1.0})
            with pytest.raises(ClosedEnvironmentError):
                envs.step(batch)
            assert_same_bits(envs.reset(), open_ones.reset())
            assert_same_bits(envs.step(batch), open_ones.step(batch))
        envs.close()
        assert envs.closed


def test_disabled_mode_refuses_to_step_a_finished_row_and_names_it(env_id):
    envs = vector(env_id, 5, autoreset_mode="Disabled")
    envs.reset(seed=0)
    break_physics(envs, row=3)
    batch = actions(env_id, 1, 5)[0]
    assert envs.step(batch)[2].tolist() == [False, False, False, True, False]
    before = envs.get_state()
    for _ in range(2):
        with pytest.raises(ResetNeeded, match=r"row 3.*reset_mask"):
            envs.step(batch)
    assert_same_bits(envs.get_state(), before)
    envs.reset(options={"reset_mask": np.arange(5) == 3})
    envs.step(batch)


def test_rows_may_be_begun_one_after_the_other(env_id):
    for mode in MODES:
        envs = vector(env_id, 3, autoreset_mode=mode)
        for row in range(3):
            with pytest.raises(ResetNeeded):
                envs.step(actions(env_id, 1, 3)[0])
            envs.reset(seed=0, options={"reset_mask": np.arange(3) == row})
        together = vector(env_id, 3, autoreset_mode=mode)
        together.reset(seed=0)
        batch = actions(env_id, 1, 3)[0]
        assert_same_bits(envs.step(batch), together.step(batch))
