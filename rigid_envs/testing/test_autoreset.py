"""Autoreset loses nothing: every end of an episode is told as the single environment tells it."""

import copy
import itertools
from collections import Counter
from functools import cache
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.engine.layout import CLOCK
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import (
    DISCRETE,
    EARLY_ENDS,
    GOALS,
    IDS,
    OWN,
    actions,
    assert_same_bits,
    counted,
    pick,
    row_of,
    share,
    single,
    still,
    task_of,
    vector,
)

SEED, HORIZON, N_ROWS = 3, 4, 20
MODES = ("NextStep", "SameStep", "Disabled")

episodes = counted("n_episodes", 10_000)  # of at most HORIZON steps each


class Step(NamedTuple):
    """One step of one row; `after` is what the reset returns that follows an end."""

    observation: Any
    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, Any]
    after: Any


def config_of(env_id: str) -> dict[str, Any]:
    return {**EARLY_ENDS.get(env_id, {}), "max_episode_steps": HORIZON}


@cache
def table(env_id: str, n_episodes: int) -> Any:
    """Action of each row at its own k-th step, resets not counted."""
    return actions(env_id, HORIZON * -(-n_episodes // N_ROWS), N_ROWS)


@cache
def alone(env_id: str, n_episodes: int) -> list[list[Step]]:
    """Steps of every row, as a single environment."""
    rows = []
    env = gym.make(env_id, **config_of(env_id))
    for row in range(N_ROWS):
        env.reset(seed=SEED + row)
        steps, elapsed = [], 0
        for action in table(env_id, n_episodes)[:, row]:
            result, elapsed = env.step(action), elapsed + 1
            assert result[3] == (elapsed == HORIZON)
            ended = result[2] or result[3]
            elapsed = 0 if ended else elapsed
            steps.append(Step(*result, env.reset() if ended else None))
        rows.append(steps)
    return rows


def assert_told(outputs: Any, row: int, step: Step) -> None:
    """Reward and ends of a row, each by itself."""
    _, rewards, terminated, truncated, _ = outputs
    told = (rewards[row].item(), terminated[row].item(), truncated[row].item())
    assert_same_bits(told, step[1:4])


def senseless(env_id: str, batch: Any) -> Any:
    """Other actions, none of which may matter."""
    if env_id in DISCRETE:
        return (batch + 1) % task_of(env_id).n_choices
    return np.full_like(batch, 1e30) * (np.arange(batch.shape[1]) % 2) - 0.123


def ends_of(env_id: str) -> Counter[tuple[bool, bool]]:
    """How many episodes were terminated, truncated, both."""
    steps = (step for row in alone(env_id, share(10_000)) for step in row)
    return Counter((step.terminated, step.truncated) for step in steps if step.after)


@pytest.mark.skipif(not set(OWN) <= set(IDS), reason="counts over all ids of this package")
def test_ten_thousand_episodes_end_in_every_way():
    ends = sum(map(ends_of, IDS), Counter())
    assert ends.total() >= 10_000
    assert set(ends) == {(True, False), (False, True), (True, True)}


def test_episodes_end_early_where_a_task_can_end(env_id):
    ends = ends_of(env_id)
    assert ends[False, True]
    assert bool(ends[True, False]) == (env_id in EARLY_ENDS), "EARLY_ENDS must say how"


@episodes
def test_next_step_mode_shows_the_last_observation_then_resets_whatever_the_action(
    env_id, n_episodes
):
    rows, batches = alone(env_id, n_episodes), table(env_id, n_episodes)
    n_steps = len(batches)
    envs = vector(env_id, N_ROWS, **config_of(env_id))
    envs.reset(seed=SEED)
    counts, ended = np.zeros(N_ROWS, dtype=np.int64), np.zeros(N_ROWS, dtype=np.bool_)
    while counts.min() < n_steps:
        batch = batches[np.minimum(counts, n_steps - 1), np.arange(N_ROWS)]
        batch[ended] = senseless(env_id, batch)[ended]
        outputs = envs.step(batch)
        for row in np.flatnonzero(counts < n_steps):
            steps = rows[row]
            if ended[row]:
                observation, info = steps[counts[row] - 1].after
                blank = Step(observation, 0.0, False, False, info, None)
            else:
                blank = steps[counts[row]]
            assert_told(outputs, row, blank)
            assert_same_bits(pick(outputs[0], row), blank.observation)
            assert_same_bits(row_of(outputs[4], row), blank.info)
        counts += ~ended
        ended = outputs[2] | outputs[3]


@episodes
def test_same_step_mode_hands_over_the_last_observation_and_info(env_id, n_episodes):
    envs = vector(env_id, N_ROWS, autoreset_mode="SameStep", **config_of(env_id))
    envs.reset(seed=SEED)
    for k, batch in enumerate(table(env_id, n_episodes)):
        outputs = envs.step(batch)
        infos = outputs[4]
        ended = outputs[2] | outputs[3]
        assert ("final_obs" in infos) == ("final_info" in infos) == ended.any()
        if ended.any():
            assert isinstance(infos["final_obs"], dict) == (env_id in GOALS)
            for mask in ("_final_obs", "_final_info"):
                np.testing.assert_array_equal(infos[mask], ended)
        for row in range(N_ROWS):
            step = alone(env_id, n_episodes)[row][k]
            assert_told(outputs, row, step)
            now, info = step.after or (step.observation, step.info)
            assert_same_bits(pick(outputs[0], row), now)
            assert_same_bits(row_of(infos, row), info)
            if ended[row]:
                assert_same_bits(pick(infos["final_obs"], row), step.observation)
                assert_same_bits(row_of(infos["final_info"], row), step.info)


@episodes
def test_disabled_mode_leaves_resets_to_the_caller(env_id, n_episodes):
    envs = vector(env_id, N_ROWS, autoreset_mode="Disabled", **config_of(env_id))
    envs.reset(seed=SEED)
    for k, batch in enumerate(table(env_id, n_episodes)):
        outputs = envs.step(batch)
        ended = outputs[2] | outputs[3]
        after = envs.reset(options={"reset_mask": ended})[0] if ended.any() else outputs[0]
        for row in range(N_ROWS):
            step = alone(env_id, n_episodes)[row][k]
            assert_told(outputs, row, step)
            assert_same_bits(pick(outputs[0], row), step.observation)
            assert_same_bits(row_of(outputs[4], row), step.info)
            now = step.after[0] if step.after else step.observation
            assert_same_bits(pick(after, row), now)


def test_results_of_a_step_are_not_touched_by_the_next(env_id):
    for mode in MODES:
        envs = vector(env_id, 3, autoreset_mode=mode, max_episode_steps=2)
        results, kept = [envs.reset(seed=0)], []
        for batch in actions(env_id, 2, 3):
            kept.append(copy.deepcopy(results[-1]))
            results.append(envs.step(batch))
        assert_same_bits(results[:-1], kept)


def test_without_a_limit_nothing_is_truncated(env_id):
    """However long an episode has lasted: the clock is put near the limit and far beyond.

    No further than where steps are refused, because rates may leave the stability envelope.
    """
    rows = [vector(env_id, 2, autoreset_mode=mode, max_episode_steps=None) for mode in MODES]
    for before, env in itertools.product((3, 10**9), (single(env_id), *rows)):
        far = max(ENVIRONMENTS[env_id].max_episode_steps - before, before)
        action = still(env_id, 2) if env in rows else still(env_id, 1)[0]
        env.reset(seed=0)
        state = env.get_state()
        state["clock"][..., CLOCK.elapsed] = min(far, task_of(env_id).stable_steps() - 6)
        env.set_state(state)
        for _ in range(6):
            _, _, terminated, truncated, _ = env.step(action)
            assert not np.any(truncated)
            if np.any(terminated):
                break
