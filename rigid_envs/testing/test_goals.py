"""Goal environments: a reward computed anew, for any pair of goals, is what a step would pay."""

from dataclasses import fields

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.testing.environments import (
    GOALS,
    actions,
    assert_same_bits,
    counted,
    fresh,
    ranges,
    single,
    task_of,
    vector,
    weights,
)

PARTS = {"observation", "achieved_goal", "desired_goal"}
goal_ids = pytest.mark.parametrize("env_id", GOALS)


def easy(env_id):
    """Goals so large that chance reaches them, drawn parameters, and weights with a sign."""
    task = task_of(env_id)
    tolerances = {f.name: 10.0 * getattr(task, f.name) for f in fields(task) if "tol" in f.name}
    signed = {f"weight_{term}": -0.7 + 0.1 * k for k, term in enumerate(weights(task))}
    return {**ranges(env_id), **tolerances, **signed}


def goals_of(observation):
    return observation["achieved_goal"], observation["desired_goal"]


def computed(env, observation):
    """Reward, terminated and truncated from the goals alone."""
    ways = (env.compute_reward, env.compute_terminated, env.compute_truncated)
    return tuple(way(*goals_of(observation), {}) for way in ways)


@goal_ids
def test_observation_has_three_parts_and_goals_are_alike(env_id):
    env, envs = single(env_id), vector(env_id, 3)
    n = task_of(env_id).n_goal
    assert set(env.observation_space) == set(envs.observation_space) == PARTS
    achieved, desired = goals_of(env.observation_space)
    assert achieved == desired
    assert achieved.shape == (n,)
    for observation in (env.reset(seed=0)[0], env.step(actions(env_id, 1, 1)[0, 0])[0]):
        assert set(observation) == PARTS
        assert {part.dtype for part in observation.values()} == {np.dtype(np.float32)}


@goal_ids
@counted("n_steps", 100_000)
def test_a_single_step_pays_what_is_computed_from_its_goals(env_id, n_steps):
    env = fresh(gym.make(env_id, max_episode_steps=10, **easy(env_id)))
    rewards, successes = set(), set()
    for action in actions(env_id, n_steps, 1)[:, 0]:
        observation, reward, terminated, truncated, info = env.step(action)
        again = computed(env.unwrapped, observation)
        assert [type(part) for part in again] == [float, bool, bool]
        assert_same_bits(again, (reward, terminated, False))  # the limit is the wrapper's
        rewards.add(str(reward))
        successes.add(info["is_success"])
        if terminated or truncated:
            env.reset()
    assert successes == {False, True}
    assert "-0.0" not in rewards


@goal_ids
@counted("n_steps", 5000)
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_step_of_many_rows_pays_what_is_computed_from_their_goals(env_id, mode, n_steps):
    n_rows = 100
    envs = fresh(vector(env_id, n_rows, autoreset_mode=mode, max_episode_steps=10, **easy(env_id)))
    ended = np.zeros(n_rows, dtype=np.bool_)
    for batch in actions(env_id, n_steps, n_rows):
        observations, rewards, terminated, truncated, infos = envs.step(batch)
        begun = ended if mode == "NextStep" else np.zeros_like(ended)  # nothing is paid for those
        ended = terminated | truncated
        if mode == "SameStep" and ended.any():
            last = infos["final_obs"]
            observations = {
                part: np.where(ended[:, None], last[part], observations[part]) for part in PARTS
            }
        again, *ends = computed(envs, observations)
        assert_same_bits(again[~begun], rewards[~begun])
        assert_same_bits(ends, [terminated, np.zeros_like(truncated)])


@goal_ids
def test_a_batch_of_any_shape_is_computed_as_its_rows_are(env_id):
    envs = vector(env_id, 60, **easy(env_id))
    observations = [envs.reset(seed=0)[0]]
    observations += [envs.step(batch)[0] for batch in actions(env_id, 4, 60)]
    achieved, desired = (np.stack([goals_of(o)[k] for o in observations]) for k in (0, 1))
    desired = np.roll(desired, 1, axis=0)  # of another step, as hindsight gives goals anew
    desired[2:] = achieved[2:]
    table = envs.compute_reward(achieved, desired, None)
    assert table.shape == (5, 60)
    assert table.dtype == np.float64
    assert not table[2:].any()  # no term costs anything at the goal itself
    assert table[:2].any()
    for shape in ((300,), (5, 60), (1, 300), (3, 5, 20)):
        reward = envs.compute_reward(*(g.reshape(*shape, -1) for g in (achieved, desired)), [{}])
        assert_same_bits(reward, table.reshape(shape))
        for way in (envs.compute_terminated, envs.compute_truncated):
            ends = way(*(g.reshape(*shape, -1) for g in (achieved, desired)), [{}])
            assert_same_bits(ends, np.zeros(shape, dtype=np.bool_))
    env = single(env_id, **easy(env_id))
    for k in range(5):
        rows = [
            env.compute_reward(*goals, {}) for goals in zip(achieved[k], desired[k], strict=True)
        ]
        assert_same_bits(np.array(rows), table[k])


@goal_ids
def test_kind_of_array_and_info_do_not_matter(env_id):
    env = single(env_id)
    goals = goals_of(env.reset(seed=0)[0])
    kept = [goal.copy() for goal in goals]
    expected = env.compute_reward(*goals, {})
    kinds = (list, tuple, lambda g: g.astype(np.float64), lambda g: np.stack([g, g], axis=1)[:, 0])
    for kind in kinds:
        for info in ({}, None, {"is_success": True}, np.array([{}])):
            assert_same_bits(env.compute_reward(*map(kind, goals), info), expected)
    assert_same_bits(list(goals), kept)


@goal_ids
def test_goals_of_another_shape_are_refused(env_id):
    env, n = single(env_id), task_of(env_id).n_goal
    good = np.zeros(n, dtype=np.float32)
    for bad in (good[:-1], np.zeros(n + 1), np.zeros((2, n)), np.zeros((n, 1)), 0.0, [], [good, 1]):
        for goals in ((bad, good), (good, bad)):
            with pytest.raises(ValueError):
                env.compute_reward(*goals, {})
    for bad in (good[:-1], 0.0, np.zeros((3, n + 1))):
        with pytest.raises(ValueError, match=rf"expected \(\.\.\., {n}\)"):
            env.compute_reward(bad, bad, {})


@goal_ids
def test_the_desired_goal_is_another_one_in_each_episode_and_kept_within(env_id):
    envs = vector(env_id, 50, max_episode_steps=7)
    last = envs.reset(seed=0)[0]["desired_goal"]
    ended = np.zeros(50, dtype=np.bool_)
    goals = [last]
    for batch in actions(env_id, 30, 50):
        observations, _, terminated, truncated, _ = envs.step(batch)
        now = observations["desired_goal"]
        assert_same_bits(now[~ended], last[~ended])
        assert (now[ended] != last[ended]).any(axis=-1).all()
        goals.append(now[ended])
        last, ended = now, terminated | truncated
    drawn = np.vstack(goals)
    assert len(np.unique(drawn, axis=0)) == len(drawn)
