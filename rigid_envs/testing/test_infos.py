"""Info, reward and time limit say the same things at every step, in every shell."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from numpy.testing import assert_equal

from rigid_envs.engine.layout import CLOCK
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import (
    ROLLING,
    actions,
    flat,
    rich,
    single,
    still,
    task_of,
    vector,
    weights,
)

FLAGS = {"is_success", "action_clipped", "physics_error"}


def expected_types(env_id):
    terms = {f"reward/{term}": float for term in task_of(env_id).terms}
    grip = {"normal_force": float, "needed_friction": float, "slips": bool}
    kinds = {"cost": float, **terms, **dict.fromkeys(FLAGS, bool)}
    return kinds | grip if env_id in ROLLING else kinds


def test_info_has_the_same_keys_and_types_at_reset_and_at_every_step(env_id):
    env = single(env_id, **rich(env_id))
    ended = True
    for action in actions(env_id, 30, 1)[:, 0]:
        if ended:
            (_, info), ended = env.reset(), False
        else:
            _, _, ended, _, info = env.step(action)
        assert {key: type(value) for key, value in info.items()} == expected_types(env_id)


def test_infos_of_many_rows_have_the_keys_of_one_with_masks(env_id):
    for mode in ["NextStep", "SameStep"]:
        envs = vector(env_id, 3, autoreset_mode=mode, max_episode_steps=4, **rich(env_id))
        _, infos = envs.reset(seed=0)
        for batch in actions(env_id, 30, 3):
            kinds = expected_types(env_id)
            plain = {key for key in infos if "final_" not in key}
            assert plain == {*kinds, *(f"_{key}" for key in kinds)}
            for key, kind in kinds.items():
                assert infos[key].dtype == np.dtype(kind)
                assert infos[key].shape == infos[f"_{key}"].shape == (3,)
                assert infos[f"_{key}"].dtype == bool
                assert infos[f"_{key}"].all()
            *_, infos = envs.step(batch)


def test_infos_on_request_are_those_that_are_given_otherwise(env_id):
    for mode in ["NextStep", "SameStep"]:
        settings = {"autoreset_mode": mode, "max_episode_steps": 4} | rich(env_id)
        asked = vector(env_id, 3, infos_on_request=True, **settings)
        given = vector(env_id, 3, **settings)
        (seen, nothing), (other, infos) = asked.reset(seed=0), given.reset(seed=0)
        assert nothing == {}
        assert_equal([seen, asked.infos()], [other, infos])
        n_full = 0
        for batch in actions(env_id, 10, 3):
            *ours, nothing = asked.step(batch)
            *theirs, infos = given.step(batch)
            assert_equal(ours, theirs)
            if nothing:
                n_full += 1
                assert_equal(nothing, infos)
            last = {key: value for key, value in infos.items() if "final_" not in key}
            assert_equal(asked.infos(), last)
        assert (n_full > 0) == (mode == "SameStep")
        (_, nothing), (_, infos) = asked.reset(), given.reset()
        assert nothing == {}
        assert_equal(asked.infos(), infos)


def test_infos_on_request_are_refused_where_there_are_none(env_id):
    envs = vector(env_id, 2, infos_on_request=True)
    with pytest.raises(ResetNeeded, match="infos before the first reset"):
        envs.infos()
    envs.reset(seed=0)
    envs.close()
    with pytest.raises(ClosedEnvironmentError, match="infos after close"):
        envs.infos()


def test_info_is_blank_at_reset(env_id):
    env = single(env_id)
    env.reset(seed=0)
    env.step(actions(env_id, 1, 1)[0, 0])
    assert not any(env.reset()[1].values())


def test_types_are_those_of_the_interface(env_id):
    env = single(env_id)
    observation, _ = env.reset(seed=0)
    for action in actions(env_id, 20, 1)[:, 0]:
        assert type(flat(observation)) is np.ndarray
        assert flat(observation).dtype == np.float32
        assert env.observation_space.contains(observation)
        observation, reward, terminated, truncated, _ = env.step(action)
        assert [type(reward), type(terminated), type(truncated)] == [float, bool, bool]
        if terminated:
            observation, _ = env.reset()
    envs = vector(env_id, 3)
    envs.reset(seed=0)
    observations, *others, _ = envs.step(actions(env_id, 1, 3)[0])
    assert envs.observation_space.contains(observations)
    dtypes = [array.dtype for array in (flat(observations), *others)]
    assert dtypes == [np.float32, np.float64, bool, bool]


def test_reward_is_the_weighted_sum_of_its_terms(env_id):
    other = {f"weight_{term}": 0.7 + 0.3 * k for k, term in enumerate(task_of(env_id).terms)}
    for config in ({}, other):
        envs = vector(env_id, 500, **config)
        envs.reset(seed=0)
        for batch in actions(env_id, 40, 500):
            _, rewards, *_, infos = envs.step(batch)
            parts = [w * infos[f"reward/{term}"] for term, w in weights(envs.task).items()]
            scale = np.sum(np.abs(parts), axis=0)
            # each product and each sum is rounded once, there and here
            rounding = 3 * len(parts) * 2.0**-53
            assert (np.abs(rewards - np.sum(parts, axis=0)) <= rounding * scale + 1e-300).all()


def test_terms_do_not_depend_on_the_weights(env_id):
    silent = {f"weight_{term}": 0.0 for term in task_of(env_id).terms}
    envs, mute = vector(env_id, 50), vector(env_id, 50, **silent)
    envs.reset(seed=0)
    mute.reset(seed=0)
    for batch in actions(env_id, 20, 50):
        *_, infos = envs.step(batch)
        _, rewards, *_, others = mute.step(batch)
        assert not rewards.any()
        for key in expected_types(env_id):
            np.testing.assert_array_equal(infos[key], others[key])


def begun(envs, action):
    """State of a start that the action does not lead to an end."""
    for seed in range(100):
        envs.reset(seed=seed)
        state = envs.get_state()
        if not envs.step(action)[2].any():
            return state
    raise AssertionError("every start leads to an end")


def test_time_limit_truncates_exactly_and_never_terminates(env_id):
    limit = ENVIRONMENTS[env_id].max_episode_steps
    assert gym.make(env_id).spec.max_episode_steps == limit
    envs, action = vector(env_id, 3), still(env_id, 3)
    state = begun(envs, action)
    for elapsed in range(max(0, limit - 5), limit):
        # where the episode began, but for the clock: a motion that goes nowhere ends only in time
        state["clock"][:, CLOCK.elapsed] = elapsed
        envs.set_state(state)
        _, _, terminated, truncated, _ = envs.step(action)
        assert not terminated.any()
        assert (truncated == (elapsed + 1 == limit)).all()
