"""An environment that is dropped is freed at once, and its threads end: it holds no cycle."""

import gc
import weakref

import gymnasium as gym
import pytest

from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import actions


@pytest.fixture(autouse=True, scope="module")
def no_collector():
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize("n_threads", [1, 2])
@pytest.mark.parametrize("n_rows", [1, 63, 128, 130])
def test_rows_are_freed(n_rows, n_threads):
    envs = gym.make_vec("RigidEnvs/BallPark-v0", n_rows, num_threads=n_threads)
    envs.reset(seed=0)
    envs.step(actions("RigidEnvs/BallPark-v0", 1, n_rows)[0])
    envs.unwrapped.set_state(envs.unwrapped.get_state())
    rows = weakref.ref(envs.unwrapped._core)
    del envs
    assert rows() is None


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_a_single_environment_is_freed(env_id):
    env = gym.make(env_id)
    env.reset(seed=0)
    env.step(actions(env_id, 1, 1)[0, 0])
    with pytest.raises(ValueError):
        env.reset(options={"state": "none"})
    row = weakref.ref(env.unwrapped._core)
    del env
    assert row() is None
