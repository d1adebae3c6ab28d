"""Ids are made and described as Gymnasium does it, and pass the checkers that others use."""

import json
import warnings
from collections.abc import Iterator

import gymnasium as gym
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

from rigid_envs.envs.goal import RigidGoalEnv, RigidGoalVectorEnv
from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.testing.environments import GOALS, assert_same_bits, ranges, rich, single, vector
from rigid_envs.watch.window import Window


def test_an_id_is_of_the_kind_that_its_task_asks_for(env_id):
    kinds = (RigidGoalEnv, RigidGoalVectorEnv) if env_id in GOALS else (RigidEnv, RigidVectorEnv)
    assert (type(single(env_id)), type(vector(env_id, 2))) == kinds
    assert type(gym.make_vec(env_id, num_envs=2)) is kinds[1]  # native unless asked otherwise


def test_spec_survives_json(env_id):
    for configured in [False, True]:
        config = rich(env_id) if configured else {}
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


# Checkers: every warning is an error.


@pytest.fixture(autouse=True)
def warnings_are_errors() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.fixture(autouse=True)
def windows_do_not_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody watches: pictures are not shown in real time."""
    show = Window.show
    monkeypatch.setattr(Window, "show", lambda self, picture, _: show(self, picture, 0.0))


def test_gymnasium_checker_passes_without_a_warning(env_id):
    for make_config in [lambda _: {}, rich]:
        check_env(single(env_id, **make_config(env_id)))


def test_sb3_checker_passes_without_a_warning(env_id):
    for make_config in [lambda _: {}, rich]:
        pytest.importorskip("stable_baselines3")
        from stable_baselines3.common.env_checker import check_env as check_for_sb3

        check_for_sb3(single(env_id, **make_config(env_id)))
        if env_id not in GOALS:  # there it looks for compute_reward on the wrapper itself
            check_for_sb3(gym.make(env_id, **make_config(env_id)))


def test_making_a_vector_environment_warns_of_nothing(env_id):
    for mode in ("vector_entry_point", "sync"):
        gym.make_vec(env_id, num_envs=2, vectorization_mode=mode).close()
