"""What Gymnasium prescribes: ids and checkers, the order of calls, infos and rewards."""

import json
import warnings
from functools import partial

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.utils.env_checker import check_env
from numpy.testing import assert_equal

from rigid_envs.engine.layout import CLOCK
from rigid_envs.envs.shells import RigidEnv, RigidGoalEnv, RigidGoalVectorEnv, RigidVectorEnv
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import (
    GOALS,
    ROLLING,
    actions,
    assert_same_bits,
    break_physics,
    fresh,
    ranges,
    rich,
    single,
    still,
    task_of,
    vector,
    weights,
)
from rigid_envs.watch.pictures import Window

# Ids are made and described as Gymnasium does it, and pass the checkers that others use.


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
def warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.fixture(autouse=True)
def windows_do_not_wait(monkeypatch):
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


# Calls in the wrong order raise, and say what to call.


MODES = ("NextStep", "SameStep", "Disabled")


def shells(env_id):
    """How environments of each kind are made, and an action for them."""
    one, three = actions(env_id, 1, 1)[0, 0], actions(env_id, 1, 3)[0]
    yield from ((partial(make, env_id), one) for make in (single, gym.make))
    yield from ((partial(vector, env_id, 3, autoreset_mode=mode), three) for mode in MODES)


def test_step_before_the_first_reset_raises(env_id):
    for make, action in shells(env_id):
        with pytest.raises(ResetNeeded, match="reset"):
            make().step(action)


def test_step_after_the_end_raises_until_reset(env_id):
    for make in [single, gym.make]:
        env = fresh(make(env_id))
        break_physics(env.unwrapped)
        action = actions(env_id, 1, 1)[0, 0]
        assert env.step(action)[2]
        for _ in range(2):
            with pytest.raises(ResetNeeded, match="reset"):
                env.step(action)
        env.reset()
        env.step(action)


def test_step_after_close_raises_until_reset(env_id):
    for make, action in shells(env_id):
        env, open_one = fresh(make()), fresh(make())
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
        env.close()
        assert getattr(env, "closed", True)  # which rows tell


def test_disabled_mode_refuses_to_step_a_finished_row_and_names_it(env_id):
    envs = fresh(vector(env_id, 5, autoreset_mode="Disabled"))
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
        together = fresh(vector(env_id, 3, autoreset_mode=mode))
        batch = actions(env_id, 1, 3)[0]
        assert_same_bits(envs.step(batch), together.step(batch))


# Info, reward and time limit say the same things at every step, in every shell.


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
    env = fresh(single(env_id))
    env.step(actions(env_id, 1, 1)[0, 0])
    assert not any(env.reset()[1].values())


def test_reward_is_the_weighted_sum_of_its_terms(env_id):
    other = {f"weight_{term}": 0.7 + 0.3 * k for k, term in enumerate(task_of(env_id).terms)}
    for config in ({}, other):
        envs = fresh(vector(env_id, 500, **config))
        for batch in actions(env_id, 40, 500):
            _, rewards, *_, infos = envs.step(batch)
            parts = [w * infos[f"reward/{term}"] for term, w in weights(envs.task).items()]
            scale = np.sum(np.abs(parts), axis=0)
            # each product and each sum is rounded once, there and here
            rounding = 3 * len(parts) * 2.0**-53
            assert (np.abs(rewards - np.sum(parts, axis=0)) <= rounding * scale + 1e-300).all()


def test_terms_do_not_depend_on_the_weights(env_id):
    silent = {f"weight_{term}": 0.0 for term in task_of(env_id).terms}
    envs, mute = fresh(vector(env_id, 50)), fresh(vector(env_id, 50, **silent))
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
