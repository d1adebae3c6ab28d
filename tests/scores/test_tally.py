"""The figures of one episode are those that an evaluation counts."""

from dataclasses import fields
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.starts import Tally, metrics_of, play
from rigid_envs.tasks.registry import ENVIRONMENTS

IDS = [f"RigidEnvs/{name}-v0" for name in ("BallPark", "DiskRoll", "SleepingTop", "BallGrid")]


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("seed", [3, 4])
def test_an_episode_counts_as_in_an_evaluation(env_id: str, seed: int) -> None:
    env = gym.make(env_id)
    env.action_space.seed(seed)
    env.reset(seed=seed)
    record: Any = ENVIRONMENTS[env_id]
    tally, actions, over = Tally([seed], record.error, record.max_episode_steps), [], False
    while not over:
        actions.append(env.action_space.sample())
        _, reward, terminated, truncated, info = env.step(actions[-1])
        tally.add(reward, terminated, truncated, info)
        assert tally.success == info["is_success"]
        over = terminated or truncated
    left = iter(actions)
    theirs = play(lambda _: np.array([next(left)]), make_rows(env_id, 1), [seed], record.error)
    ours = tally.episodes()
    for field in fields(ours):
        if field.name != "bounds":
            assert np.array_equal(getattr(ours, field.name), getattr(theirs, field.name))
    task: Any = env.unwrapped.task  # type: ignore[attr-defined]
    for metric in metrics_of(env_id):
        assert tally.value(metric, task) == metric.values(theirs, task)[0]


def test_metrics_of_the_cost_have_its_unit() -> None:
    units = {
        env_id: metrics_of(env_id)[0].unit(make_rows(env_id, 1).task)
        for env_id in ("RigidEnvs/BallPark-v0", "RigidEnvs/SleepingTop-v0", "RigidEnvs/DiskRoll-v0")
    }
    assert list(units.values()) == ["m", "N m s", ""]
