"""The shell of many rows: spaces, modes, and what it hands out."""

import copy
import warnings

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from rigid_envs.envs.goal import RigidGoalEnv, RigidGoalVectorEnv
from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import (
    CONTINUOUS,
    GOALS,
    IDS,
    actions,
    assert_same_bits,
    flat,
    still,
)


@pytest.fixture(params=IDS)
def env_id(request):
    return request.param


def rows(env_id, **settings):
    """Rows as their class makes them: without a spec."""
    kind = RigidGoalVectorEnv if env_id in GOALS else RigidVectorEnv
    return kind(ENVIRONMENTS[env_id].task, **settings)


def row(env_id):
    """The single environment."""
    return (RigidGoalEnv if env_id in GOALS else RigidEnv)(ENVIRONMENTS[env_id].task)


def test_spaces_are_those_of_the_single_environment_in_a_batch(env_id):
    envs, env = rows(env_id, num_envs=5), row(env_id)
    assert envs.single_action_space == env.action_space
    assert envs.single_observation_space == env.observation_space
    assert envs.action_space == batch_space(env.action_space, 5)
    assert envs.observation_space == batch_space(env.observation_space, 5)


def test_mode_is_given_as_a_word_or_a_member_and_told_in_the_metadata(env_id):
    for mode in AutoresetMode:
        for given in (mode, mode.value):
            envs = rows(env_id, num_envs=2, autoreset_mode=given)
            assert envs.metadata["autoreset_mode"] is mode
        assert RigidVectorEnv.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


def test_number_of_rows_may_be_any_positive_integer(env_id):
    for n in [1, np.int64(3), 65]:
        envs = rows(env_id, num_envs=n, num_threads=np.int64(2))
        observations, _ = envs.reset(seed=0)
        assert type(envs.num_envs) is int
        assert flat(observations).shape == (n, len(envs.task.observations()))
        assert envs.observation_space.contains(observations)


def test_what_is_handed_out_does_not_lead_back_into_the_rows(env_id):
    for mode in AutoresetMode:
        envs, quiet = (
            rows(env_id, num_envs=3, max_episode_steps=2, autoreset_mode=mode) for _ in range(2)
        )
        overwrite(envs.reset(seed=0)[0])
        quiet.reset(seed=0)
        batch = still(env_id, 3)
        kept = batch.copy()
        for _ in range(2):
            results, expected = envs.step(batch), quiet.step(batch)
            assert_same_bits(results, expected)
            overwrite(results)
            envs.y[...] = 9.0
        assert_same_bits(envs.get_state(), quiet.get_state())
        assert_same_bits(envs.infos(), quiet.infos())
        one = {"reset_mask": np.array([False, True, False])}
        assert_same_bits(envs.reset(options=one), quiet.reset(options=one))
        assert_same_bits(batch, kept)


def test_what_was_handed_out_stays_as_it_is(env_id):
    for mode in AutoresetMode:
        envs = rows(env_id, num_envs=3, max_episode_steps=2, autoreset_mode=mode)
        results = [
            envs.reset(seed=0),
            *(envs.step(still(env_id, 3)) for _ in range(2)),
            envs.infos(),
        ]
        kept = copy.deepcopy(results)
        state = envs.get_state()
        envs.reset(options={"reset_mask": np.array([True, False, False])})
        envs.infos()
        envs.set_state(state)
        envs.reset()
        envs.step(still(env_id, 3))
        assert_same_bits(results, kept)


def overwrite(result):
    """Other values in all that is not told to be constant."""
    if isinstance(result, dict):
        for key, part in result.items():
            if not key.startswith("_"):
                overwrite(part)
    elif isinstance(result, tuple):
        for part in result:
            overwrite(part)
    else:
        result[...] = 9


def test_masks_of_infos_cannot_be_written_to(env_id):
    envs = rows(env_id, num_envs=3)
    _, infos = envs.reset(seed=0)
    with pytest.raises(ValueError, match="read-only"):
        infos["_cost"][0] = False


@pytest.mark.parametrize("env_id", CONTINUOUS)
def test_batches_of_any_layout_give_the_same_bits(env_id):
    batch = actions(env_id, 1, 70)[0]
    wide = np.zeros((70, 2 * batch.shape[1]), dtype=np.float32)
    wide[:, ::2] = batch
    layouts = (batch, np.asfortranarray(batch), wide[:, ::2], batch.astype(float), batch.tolist())
    results = []
    for layout in layouts:
        envs = rows(env_id, num_envs=70)
        envs.reset(seed=0)
        results.append(flat(envs.step(layout)[0]).tobytes())
    assert set(results) == {results[0]}


def test_resetting_running_rows_ends_their_episodes_quietly(env_id):
    envs = rows(env_id, num_envs=3, max_episode_steps=3)
    envs.reset(seed=0)
    batch = still(env_id, 3)
    envs.step(batch)
    envs.step(batch)
    envs.reset(options={"reset_mask": np.array([False, True, False])})
    assert envs.step(batch)[3].tolist() == [True, False, True]
    assert envs.step(batch)[3].tolist() == [False, False, False]
    assert envs.step(batch)[3].tolist() == [False, True, False]


def test_time_limits_that_are_no_positive_integer_are_refused(env_id):
    for limit in [0, -1, 2.5, True, "10", np.nan]:
        with pytest.raises(ValueError, match=r"^config\.max_episode_steps: .*expected"):
            rows(env_id, num_envs=2, max_episode_steps=limit)


def test_a_seed_is_that_of_the_generator_as_gymnasium_has_it(env_id):
    for seed in [7, np.int64(7)]:
        envs = rows(env_id, num_envs=2)
        envs.reset(seed=3)
        envs.reset(seed=seed)
        assert envs.np_random_seed == 7 and type(envs.np_random_seed) is int
        drawn = envs.np_random.random()
        envs.reset(seed=seed)
        assert envs.np_random.random() == drawn


def test_call_gives_a_value_for_each_row_as_vectors_of_single_environments_do() -> None:
    envs = rows(IDS[0], num_envs=3)
    envs.reset(seed=0)
    with warnings.catch_warnings(record=True):  # there is no render_mode
        warnings.simplefilter("always")
        assert envs.call("render") == (None, None, None)
    assert envs.call("render_mode") == (None, None, None)
    with pytest.raises(AttributeError, match=r"call\('get_state'\); expected 'render'"):
        envs.call("get_state")
    with pytest.raises(AttributeError, match="nothing"):
        envs.call("nothing")
