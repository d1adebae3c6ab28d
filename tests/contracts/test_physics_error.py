"""A state that is no longer physics ends the episode, and never reaches the agent."""

import numpy as np
import pytest

from tests.contracts.environments import actions, assert_same_bits, rich, single, task_of, vector

N_QUATERNION = 4


def broken_states(env_id, y):
    """States with one entry that no physics leads to."""
    for k in range(len(y)):
        for value in (np.nan, np.inf, -np.inf, 1e12, -1e200):
            if k < N_QUATERNION and np.isfinite(value):
                continue  # the attitude is brought back to unit length: no harm done
            broken = y.copy()
            broken[k] = value
            yield broken


@pytest.mark.parametrize("configured", [False, True], ids=["default", "rich"])
def test_a_broken_state_ends_the_episode_without_a_reward(env_id, configured):
    env = single(env_id, **(rich(env_id) if configured else {}))
    env.reset(seed=0)
    state = env.get_state()
    for y in broken_states(env_id, state["y"]):
        env.set_state({**state, "y": y})
        observation, reward, terminated, truncated, info = env.step(actions(env_id, 1, 1)[0, 0])
        assert env.observation_space.contains(observation)
        assert (reward, terminated, truncated) == (0.0, True, False)
        assert info["physics_error"]
        assert not info["is_success"]
        assert info["cost"] == 0.0
        assert [info[f"reward/{term}"] for term in env.task.terms] == [0.0] * len(env.task.terms)
        assert np.isfinite(env.y).all()
        observation, info = env.reset()
        assert env.observation_space.contains(observation)
        assert not info["physics_error"]


def test_an_attitude_of_any_length_is_harmless(env_id):
    env = single(env_id)
    env.reset(seed=0)
    state = env.get_state()
    for k in range(N_QUATERNION):
        for value in (1e12, -1e200):
            y = state["y"].copy()
            y[k] = value
            env.set_state({**state, "y": y})
            observation, reward, _, _, _ = env.step(actions(env_id, 1, 1)[0, 0])
            assert env.observation_space.contains(observation)
            assert np.isfinite(reward)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_broken_row_does_not_touch_the_others(env_id, mode):
    n, broken_row = 70, 65
    envs, whole = (vector(env_id, n, autoreset_mode=mode, **rich(env_id)) for _ in range(2))
    envs.reset(seed=0)
    whole.reset(seed=0)
    state = envs.get_state()
    state["y"][broken_row, -1] = np.nan
    envs.set_state(state)
    others = np.arange(n) != broken_row
    for k, batch in enumerate(actions(env_id, 5, n)):
        ours, expected = envs.step(batch), whole.step(batch)
        for a, b in zip(ours[:4], expected[:4], strict=True):
            assert_same_bits(a[others], b[others])
        assert ours[2][broken_row] == (k == 0)
        assert np.isfinite(ours[1]).all()
        assert envs.observation_space.contains(ours[0])
    assert not envs.get_state()["y"].tobytes() == state["y"].tobytes()


def test_states_of_every_size_below_the_limit_are_observed_in_space(env_id):
    system = task_of(env_id).system_type
    n_state = len(system.state_entries)
    env = single(env_id)
    env.reset(seed=0)
    state = env.get_state()
    for k in range(N_QUATERNION, n_state):
        for exponent in range(-300, 9, 4):
            y = state["y"].copy()
            y[k] = 10.0**exponent
            env.set_state({**state, "y": y})
            observation, reward, _, _, _ = env.step(actions(env_id, 1, 1)[0, 0])
            assert env.observation_space.contains(observation)
            assert np.isfinite(reward)
