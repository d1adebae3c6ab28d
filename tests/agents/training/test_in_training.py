"""What holds in training alone: hyperparameters of the task, and a price on cost."""

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from agents.config.entries import config_from
from agents.environments import make
from agents.training.rows import TrainingRows
from agents.training.trainer import train
from rigid_envs import load
from rigid_envs.base.checks import ConfigError
from tests.agents.drift import Drift
from tests.fixtures import Patch

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
        load(trained(tmp_path, name, train_kwargs=keywords) / "last_model")
        for name, keywords in (("a", {}), ("b", {"weight_effort": 9.0}), ("c", {"dt": 0.01}))
    ]
    assert {str(policy.document["env_kwargs"]) for policy in policies} == {"{}"}
    weights = [policy.arrays["layers.0.weight"].tobytes() for policy in policies]
    assert len(set(weights)) == 3


@pytest.mark.parametrize("pay", [{"price": 0.3}, {"bonus": 3.0}], ids=str)
def test_price_and_bonus_are_of_every_reward_of_training(pay: dict[str, float]) -> None:
    rows = [TrainingRows(make("RigidEnvs/BallGrid-v0", {}, 200)) for _ in range(2)]
    rng, n_ended, n_won = np.random.default_rng(0), 0, 0
    for env in rows:
        env.seed(0)
        env.reset()
    vars(rows[1]).update(pay)
    for _ in range(60):  # the limit is 50 steps
        actions = rng.integers(0, 4, 200)
        for env in rows:
            env.step_async(actions)
        (_, plain, dones, infos), (_, paid, *_) = (env.step_wait() for env in rows)
        won = np.array([info.get("is_success", False) for info in infos])  # success ends it
        # a move costs a quarter roll, the last one of an episode too
        expected = pay.get("bonus", 0.0) * won - pay.get("price", 0.0) * np.pi / 2
        np.testing.assert_allclose(paid - plain, expected, rtol=1e-5, atol=1e-6)
        n_ended, n_won = n_ended + dones.sum(), n_won + won.sum()
    assert n_ended and n_won


def test_a_price_changes_what_is_learnt_and_goes_along_a_line(tmp_path: Path) -> None:
    plain, priced = (
        load(trained(tmp_path, str(price), cost_price=price) / "last_model") for price in (0.0, 5.0)
    )
    assert (plain.arrays["layers.0.weight"] != priced.arrays["layers.0.weight"]).any()
    config = config_from({**SHORT, "total_timesteps": 1000, "cost_price": [1.0, 3.0]})
    assert [config.price_at(age) for age in (0, 500, 1000, 1100)] == [1.0, 2.0, 3.0, 3.0]


class Free(Drift):
    """The environment for tests, without cost."""

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        observation, infos = super().reset(**arguments)
        return observation, {"is_success": infos["is_success"]}


def test_a_price_is_refused_where_there_is_no_cost(tmp_path: Path, monkeypatch: Patch) -> None:
    spec = gym.envs.registration.EnvSpec("Free-v0", vector_entry_point=Free)
    monkeypatch.setitem(gym.registry, "Free-v0", spec)
    with pytest.raises(ConfigError, match=r"config\.cost_price.*no cost"):
        trained(tmp_path, "run", env_id="Free-v0", cost_price=1.0)
