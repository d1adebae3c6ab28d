"""The spread of the actions over a run, where a config says it."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.config.entries import config_from
from agents.training.trainer import train
from rigid_envs import load
from rigid_envs.base.checks import ConfigError

SHORT: dict[str, Any] = {
    "env_id": "RigidEnvs/SleepingTop-v0",
    "n_envs": 8,
    "n_steps": 8,
    "batch_size": 64,
    "n_epochs": 1,
    "eval_every": 1000,
    "eval_episodes": 2,
}


def test_the_spread_falls_by_equal_factors(tmp_path: Path) -> None:
    config = config_from(
        SHORT | {"log_dir": str(tmp_path), "total_timesteps": 192, "action_std": [0.8, 0.1]}
    )
    policy = load(train(config, quiet=True).folder / "last_model")
    # the last of three updates began after two thirds of the run
    expected = math.log(0.8) + 2 / 3 * math.log(0.1 / 0.8)
    np.testing.assert_allclose(policy.arrays["log_std"], expected, rtol=1e-6)


def test_a_spread_of_choices_is_refused(tmp_path: Path) -> None:
    entries = {"env_id": "RigidEnvs/BallGrid-v0", "action_std": [0.8, 0.1]}
    with pytest.raises(ConfigError, match=r"config\.action_std"):
        train(config_from(SHORT | entries | {"log_dir": str(tmp_path)}), quiet=True)
