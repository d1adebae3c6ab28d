"""Ids are made and described as Gymnasium does it."""

import json

import gymnasium as gym
import pytest
from gymnasium.envs.registration import EnvSpec

from rigid_envs.envs.goal import RigidGoalEnv, RigidGoalVectorEnv
from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.testing.environments import (
    GOALS,
    assert_same_bits,
    ranges,
    representations,
    single,
    vector,
)


def test_an_id_is_of_the_kind_that_its_task_asks_for(env_id):
    kinds = (RigidGoalEnv, RigidGoalVectorEnv) if env_id in GOALS else (RigidEnv, RigidVectorEnv)
    assert (type(single(env_id)), type(vector(env_id, 2))) == kinds
    assert type(gym.make_vec(env_id, num_envs=2)) is kinds[1]  # native unless asked otherwise


@pytest.mark.parametrize("configured", [False, True], ids=["default", "configured"])
def test_spec_survives_json(env_id, configured):
    shown = representations(env_id)[-1]
    config = {**ranges(env_id), "rotation": shown, "observation_noise": 0.1} if configured else {}
    env = gym.make(env_id, max_episode_steps=7, **config)
    text = env.spec.to_json()
    json.loads(text)
    spec = EnvSpec.from_json(text)
    again = gym.make(spec)
    assert again.unwrapped.task == env.unwrapped.task
    assert again.spec.max_episode_steps == 7
    assert EnvSpec.from_json(again.spec.to_json()) == spec
    assert_same_bits(env.reset(seed=0), again.reset(seed=0))


def test_spec_of_a_vector_environment_makes_it_again(env_id):
    envs = gym.make_vec(env_id, num_envs=3, **ranges(env_id))
    again = gym.make_vec(EnvSpec.from_json(envs.spec.to_json()))
    assert again.num_envs == 3
    assert again.task == envs.task
    assert_same_bits(again.reset(seed=0), envs.reset(seed=0))


def test_repr_names_the_id(env_id):
    assert env_id in str(single(env_id))
    assert env_id in str(vector(env_id, 2))
