"""Ids are found, made and described as Gymnasium does it."""

import importlib
import json
import subprocess
import sys

import gymnasium as gym
import pytest
from gymnasium.envs.registration import EnvSpec

import rigid_envs
from rigid_envs.envs import RigidEnv, RigidGoalEnv, RigidGoalVectorEnv, RigidVectorEnv
from tests.contracts.environments import (
    GOALS,
    IDS,
    assert_same_bits,
    ranges,
    representations,
    single,
    vector,
)


def test_import_registers_every_id_under_the_namespace():
    registered = {name for name in gym.registry if name.startswith("RigidEnvs/")}
    assert registered == set(IDS)


def test_registration_again_changes_nothing():
    before = {env_id: gym.registry[env_id] for env_id in IDS}
    importlib.reload(rigid_envs)
    assert {env_id: gym.registry[env_id] for env_id in IDS} == before
    assert all(gym.registry[env_id] is before[env_id] for env_id in IDS)


def test_make_with_the_module_in_the_id_imports_the_package():
    code = (
        "import gymnasium as gym\n"
        "env = gym.make('rigid_envs:RigidEnvs/BallPark-v0')\n"
        "envs = gym.make_vec('rigid_envs:RigidEnvs/BallPark-v0', num_envs=2)\n"
        "print(env.spec.id, type(envs).__name__)\n"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.stdout == "RigidEnvs/BallPark-v0 RigidVectorEnv\n", done.stderr


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
