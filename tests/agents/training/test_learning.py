"""Each algorithm with a memory learns an easy version of the task that it is there for."""

from pathlib import Path
from typing import Any

import pytest

from agents.config.entries import config_from
from agents.evaluation.reports import evaluate
from agents.training.trainer import train
from rigid_envs import load

EASY: dict[str, dict[str, Any]] = {
    "choices": {
        "algo": "dqn",
        "env_id": "RigidEnvs/BallGrid-v0",
        "env_kwargs": {"start_cells": 1},
        "total_timesteps": 40_000,
        "learning_starts": 3_000,
        "learning_rate": 3e-3,
        "gamma": 0.95,
        "activation": "relu",
        "target_update_interval": 1_000,
    },
    # Any attitude will do: what is left is to roll to a point, paid for only when there.
    "goals": {
        "algo": "sac",
        "env_id": "RigidEnvs/BallParkGoal-v0",
        "env_kwargs": {"start_half_width": 1, "position_tolerance": 0.4, "angle_tolerance": 3.2},
        "total_timesteps": 13_000,
        "learning_starts": 6_400,
        "batch_size": 128,
        "gradient_steps": 8,
        "learning_rate": 3e-3,
        "gamma": 0.9,
        "activation": "relu",
    },
}


@pytest.mark.long
@pytest.mark.parametrize("name", [pytest.param("choices", marks=pytest.mark.push), "goals"])
def test_learning_beats_chance_by_far(tmp_path: Path, name: str) -> None:
    values = EASY[name]
    outcome = train(
        config_from(values | {"log_dir": str(tmp_path), "eval_episodes": 10}), quiet=True
    )
    env_id, env_kwargs = values["env_id"], values["env_kwargs"]
    policy = load(outcome.folder / "last_model")
    learnt = evaluate(policy, env_id, 200, env_kwargs=env_kwargs)
    chance = evaluate(None, env_id, 200, env_kwargs=env_kwargs)
    # Measured: 100 % of choices and 67 % of goals, chance 4 % and 2 %.
    assert learnt.successes.mean() > 0.3 and chance.successes.mean() < 0.1
    assert learnt.values["return"].mean() > chance.values["return"].mean()
