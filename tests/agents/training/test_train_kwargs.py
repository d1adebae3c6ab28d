"""Hyperparameters of the task that hold in training alone."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.config.by_algorithm import config_from
from agents.policies.policy_file import load_policy
from agents.training.trainer import train
from rigid_envs.errors import ConfigError

SHORT: dict[str, Any] = {
    "env_id": "RigidEnvs/SleepingTop-v0",
    "n_envs": 8,
    "n_steps": 8,
    "batch_size": 64,
    "n_epochs": 1,
    "total_timesteps": 128,
    "eval_every": 64,
    "eval_episodes": 20,
}


def trained(folder: Path, name: str, **entries: Any) -> Path:
    values = {**SHORT, **entries, "log_dir": str(folder), "run_name": name}
    return train(config_from(values), quiet=True).folder


def evaluations(run: Path) -> dict[str, Any]:
    with np.load(run / "evaluations.npz") as file:
        return dict(file)


def test_they_change_what_is_learnt_and_not_what_is_evaluated(tmp_path: Path) -> None:
    frozen = {"learning_rate": [0.0, 0.0]}
    plain = trained(tmp_path, "plain", **frozen)
    priced = trained(tmp_path, "priced", **frozen, train_kwargs={"weight_effort": 9.0})
    for key, column in evaluations(plain).items():  # of the same policy, which did not learn
        np.testing.assert_array_equal(column, evaluations(priced)[key])
    policies = [
        load_policy(trained(tmp_path, name, train_kwargs=keywords) / "last_model")
        for name, keywords in (("a", {}), ("b", {"weight_effort": 9.0}), ("c", {"dt": 0.01}))
    ]
    assert {str(policy.document["env_kwargs"]) for policy in policies} == {"{}"}
    weights = [policy.arrays["layers.0.weight"].tobytes() for policy in policies]
    assert len(set(weights)) == 3


def test_they_go_over_those_of_the_evaluation(tmp_path: Path) -> None:
    config = config_from({**SHORT, "env_kwargs": {"dt": 0.02}, "train_kwargs": {"dt": 0.01}})
    assert config.training_kwargs == {"dt": 0.01}


@pytest.mark.parametrize(
    ("keywords", "expected"),
    [
        ({"weight_effort": "x"}, r"config\.train_kwargs\.weight_effort: "),
        ({"wait_effort": 1.0}, r"config\.train_kwargs.*wait_effort"),
        ({"frame": "reduced"}, r"config\.train_kwargs: .*spaces"),
    ],
)
def test_those_that_cannot_be_are_refused(
    tmp_path: Path, keywords: dict[str, Any], expected: str
) -> None:
    with pytest.raises(ConfigError, match=expected):
        trained(tmp_path, "run", train_kwargs=keywords)
    assert not (tmp_path / "ppo" / "run").exists()
