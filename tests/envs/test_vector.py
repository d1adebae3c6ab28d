"""The shell of many rows: spaces, modes, and what it hands out."""

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from rigid_envs.envs import RigidEnv, RigidVectorEnv

TASKS = ("IntermediateAxis", "SleepingTop", "BallPark")


@pytest.fixture(params=TASKS)
def task(request):
    return f"rigid_envs.tasks:{request.param}"


def test_spaces_are_those_of_the_single_environment_in_a_batch(task):
    envs, env = RigidVectorEnv(task, num_envs=5), RigidEnv(task)
    assert envs.single_action_space == env.action_space
    assert envs.single_observation_space == env.observation_space
    assert envs.action_space == batch_space(env.action_space, 5)
    assert envs.observation_space == batch_space(env.observation_space, 5)


@pytest.mark.parametrize("mode", AutoresetMode)
def test_mode_is_given_as_a_word_or_a_member_and_told_in_the_metadata(task, mode):
    for given in (mode, mode.value):
        envs = RigidVectorEnv(task, num_envs=2, autoreset_mode=given)
        assert envs.metadata["autoreset_mode"] is mode
    assert RigidVectorEnv.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


@pytest.mark.parametrize("n", [1, np.int64(3), 65])
def test_number_of_rows_may_be_any_positive_integer(task, n):
    envs = RigidVectorEnv(task, num_envs=n, num_threads=np.int64(2))
    observations, _ = envs.reset(seed=0)
    assert type(envs.num_envs) is int
    assert observations.shape == (n, *envs.single_observation_space.shape)
    assert envs.observation_space.contains(observations)


def test_systems_are_those_of_the_rows(task):
    envs = RigidVectorEnv(task, num_envs=3)
    envs.reset(seed=0)
    assert envs.systems == [envs.task.system()] * 3
    assert envs.y.shape == (3, len(envs.systems[0].state_entries))


@pytest.mark.parametrize("mode", AutoresetMode)
def test_what_is_handed_out_does_not_lead_back_into_the_rows(task, mode):
    envs, quiet = (
        RigidVectorEnv(task, num_envs=3, max_episode_steps=2, autoreset_mode=mode) for _ in range(2)
    )
    observations, _ = envs.reset(seed=0)
    quiet.reset(seed=0)
    observations[...] = 9.0
    batch = np.full(envs.action_space.shape, 0.5, dtype=np.float32)
    for _ in range(2):
        *results, infos = envs.step(batch)
        expected = quiet.step(batch)
        for result, other in zip(results, expected, strict=False):
            np.testing.assert_array_equal(result, other)
            result[...] = True
        for key, values in infos.items():
            if isinstance(values, np.ndarray) and values.flags.writeable and key[0] != "_":
                values[...] = True
        envs.y[...] = 9.0
    assert envs.get_state()["y"].tobytes() == quiet.get_state()["y"].tobytes()
    assert (batch == 0.5).all()


def test_masks_of_infos_cannot_be_written_to(task):
    envs = RigidVectorEnv(task, num_envs=3)
    _, infos = envs.reset(seed=0)
    with pytest.raises(ValueError, match="read-only"):
        infos["_cost"][0] = False


def test_batches_of_any_layout_give_the_same_bits(task):
    shape = (70, *RigidVectorEnv(task).single_action_space.shape)
    batch = np.random.default_rng(0).uniform(-1, 1, shape).astype(np.float32)
    wide = np.zeros((70, 2 * shape[1]), dtype=np.float32)
    wide[:, ::2] = batch
    layouts = (batch, np.asfortranarray(batch), wide[:, ::2], batch.astype(float), batch.tolist())
    results = []
    for layout in layouts:
        envs = RigidVectorEnv(task, num_envs=70)
        envs.reset(seed=0)
        results.append(envs.step(layout)[0].tobytes())
    assert set(results) == {results[0]}


def test_resetting_running_rows_ends_their_episodes_quietly(task):
    envs = RigidVectorEnv(task, num_envs=3, max_episode_steps=3)
    envs.reset(seed=0)
    batch = np.zeros(envs.action_space.shape, dtype=np.float32)
    envs.step(batch)
    envs.step(batch)
    envs.reset(options={"reset_mask": np.array([False, True, False])})
    assert envs.step(batch)[3].tolist() == [True, False, True]
    assert envs.step(batch)[3].tolist() == [False, False, False]
    assert envs.step(batch)[3].tolist() == [False, True, False]


@pytest.mark.parametrize("limit", [0, -1, 2.5, True, "10", np.nan])
def test_time_limits_that_are_no_positive_integer_are_refused(task, limit):
    with pytest.raises(ValueError, match=r"^config\.max_episode_steps: .*expected"):
        RigidVectorEnv(task, num_envs=2, max_episode_steps=limit)
