"""Autoreset loses nothing: every end of an episode is told as the single environment tells it."""

from functools import cache
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import pytest

from tests.contracts.environments import (
    EARLY_ENDS,
    actions,
    assert_same_bits,
    row_of,
    single,
    vector,
)

SEED, HORIZON, N_ROWS, N_STEPS = 3, 5, 100, 500  # at most 5 steps long: 10 000 episodes at least


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
def table(env_id: str) -> Any:
    """Action of each row at its own k-th step, resets not counted."""
    return actions(env_id, N_STEPS, N_ROWS)


@cache
def alone(env_id: str) -> list[tuple[Any, list[Step]]]:
    """First observation and steps of every row, as single environments."""
    rows = []
    for row in range(N_ROWS):
        env = gym.make(env_id, **config_of(env_id))
        first, steps, elapsed = env.reset(seed=SEED + row), [], 0
        for action in table(env_id)[:, row]:
            result, elapsed = env.step(action), elapsed + 1
            assert result[3] == (elapsed == HORIZON)
            ended = result[2] or result[3]
            elapsed = 0 if ended else elapsed
            steps.append(Step(*result, env.reset() if ended else None))
        rows.append((first, steps))
    return rows


def assert_told(outputs: Any, row: int, step: Step) -> None:
    """Reward and ends of a row, each by itself."""
    _, rewards, terminated, truncated, _ = outputs
    told = (rewards[row].item(), terminated[row].item(), truncated[row].item())
    assert_same_bits(told, step[1:4])


def batch_of(env_id: str, counts: Any) -> Any:
    return table(env_id)[np.minimum(counts, N_STEPS - 1), np.arange(N_ROWS)]


def test_ten_thousand_episodes_end_in_both_ways_where_a_task_has_both(env_id):
    steps = [step for _, row in alone(env_id) for step in row]
    assert sum(step.terminated or step.truncated for step in steps) >= 10_000
    if env_id in EARLY_ENDS:
        ends = {(step.terminated, step.truncated) for step in steps}
        assert ends == {(False, False), (True, False), (False, True), (True, True)}


def test_next_step_mode_shows_the_last_observation_then_resets_whatever_the_action(env_id):
    envs = vector(env_id, N_ROWS, **config_of(env_id))
    envs.reset(seed=SEED)
    counts, ended = np.zeros(N_ROWS, dtype=np.int64), np.zeros(N_ROWS, dtype=np.bool_)
    while counts.min() < N_STEPS:
        batch = batch_of(env_id, counts)
        batch[ended] = np.where(np.arange(batch.shape[1]) % 2, 1e30, -0.123)
        outputs = envs.step(batch)
        for row in np.flatnonzero(counts < N_STEPS):
            steps = alone(env_id)[row][1]
            if ended[row]:
                observation, info = steps[counts[row] - 1].after
                blank = Step(observation, 0.0, False, False, info, None)
                assert_told(outputs, row, blank)
            else:
                blank = steps[counts[row]]
                assert_told(outputs, row, blank)
            assert_same_bits(outputs[0][row], blank.observation)
            assert_same_bits(row_of(outputs[4], row), blank.info)
        counts += ~ended
        ended = outputs[2] | outputs[3]


def test_same_step_mode_hands_over_the_last_observation_and_info(env_id):
    envs = vector(env_id, N_ROWS, autoreset_mode="SameStep", **config_of(env_id))
    envs.reset(seed=SEED)
    for k in range(N_STEPS):
        outputs = envs.step(table(env_id)[k])
        infos = outputs[4]
        ended = outputs[2] | outputs[3]
        assert ("final_obs" in infos) == ("final_info" in infos) == ended.any()
        if ended.any():
            for mask in ("_final_obs", "_final_info"):
                np.testing.assert_array_equal(infos[mask], ended)
        for row in range(N_ROWS):
            step = alone(env_id)[row][1][k]
            assert_told(outputs, row, step)
            now, info = step.after or (step.observation, step.info)
            assert_same_bits(outputs[0][row], now)
            assert_same_bits(row_of(infos, row), info)
            if ended[row]:
                assert_same_bits(infos["final_obs"][row], step.observation)
                assert_same_bits(row_of(infos["final_info"], row), step.info)


def test_disabled_mode_leaves_resets_to_the_caller(env_id):
    envs = vector(env_id, N_ROWS, autoreset_mode="Disabled", **config_of(env_id))
    envs.reset(seed=SEED)
    for k in range(N_STEPS):
        outputs = envs.step(table(env_id)[k])
        ended = outputs[2] | outputs[3]
        after = envs.reset(options={"reset_mask": ended})[0] if ended.any() else outputs[0]
        for row in range(N_ROWS):
            step = alone(env_id)[row][1][k]
            assert_told(outputs, row, step)
            assert_same_bits(outputs[0][row], step.observation)
            assert_same_bits(row_of(outputs[4], row), step.info)
            now = step.after[0] if step.after else step.observation
            assert_same_bits(after[row], now)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_results_of_a_step_are_not_touched_by_the_next(env_id, mode):
    envs = vector(env_id, 3, autoreset_mode=mode, max_episode_steps=2)
    results, kept = [envs.reset(seed=0)], []
    for batch in actions(env_id, 2, 3):
        kept.append([np.copy(part) for part in results[-1][:-1]])
        results.append(envs.step(batch))
    for result, before in zip(results[:-1], kept, strict=True):
        assert_same_bits(list(result[:-1]), before)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_without_a_limit_nothing_is_truncated(env_id, mode):
    for env in (single(env_id), vector(env_id, 2, autoreset_mode=mode, max_episode_steps=None)):
        env.reset(seed=0)
        for _ in range(1000):
            assert not np.any(env.step(np.zeros(env.action_space.shape, dtype=np.float32))[3])
