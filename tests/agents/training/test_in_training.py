"""What holds in training alone: hyperparameters of the task, and a price on cost."""

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from agents.config.entries import config_from
from agents.environments import TrainingRows, make
from agents.training.trainer import train
from agents.training.validation import Validation
from rigid_envs import load
from rigid_envs.base.checks import ConfigError
from tests.agents.drift import Drift

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


def test_the_price_of_cost_is_taken_from_every_reward_of_training() -> None:
    rows = [TrainingRows(make("RigidEnvs/BallGrid-v0", {}, 50)) for _ in range(2)]
    rng, lengths = np.random.default_rng(0), []
    for env, price in zip(rows, (0.0, 0.3), strict=True):
        env.seed(0)
        env.reset()
        env.price = price
    for _ in range(60):  # the limit is 50 steps
        rows[0].step_async(actions := rng.integers(0, 4, 50))
        rows[1].step_async(actions)
        (_, full, dones, _), (_, less, *_) = (env.step_wait() for env in rows)
        # a move costs a quarter roll, the last one of an episode too
        np.testing.assert_allclose(full - less, 0.3 * np.pi / 2, rtol=1e-5)
        lengths.append(dones)
    assert np.any(lengths)


def test_the_bonus_is_paid_in_the_steps_that_succeed() -> None:
    rows = [TrainingRows(make("RigidEnvs/BallGrid-v0", {}, 200)) for _ in range(2)]
    rng, n_paid = np.random.default_rng(0), 0
    for env, bonus in zip(rows, (0.0, 3.0), strict=True):
        env.seed(0)
        env.reset()
        env.bonus = bonus
    for _ in range(60):
        rows[0].step_async(actions := rng.integers(0, 4, 200))
        rows[1].step_async(actions)
        (_, plain, _, infos), (_, more, *_) = (env.step_wait() for env in rows)
        won = np.array([info.get("is_success", False) for info in infos])  # success ends it
        np.testing.assert_allclose(more - plain, 3.0 * won, atol=1e-12)
        n_paid += won.sum()
    assert n_paid


def test_a_price_changes_what_is_learnt_and_goes_along_a_line(tmp_path: Path) -> None:
    plain, priced = (
        load(trained(tmp_path, str(price), cost_price=price) / "last_model") for price in (0.0, 5.0)
    )
    assert (plain.arrays["layers.0.weight"] != priced.arrays["layers.0.weight"]).any()
    config = config_from({**SHORT, "total_timesteps": 1000, "cost_price": [1.0, 3.0]})
    assert [config.price_at(age) for age in (0, 500, 1000, 1100)] == [1.0, 2.0, 3.0, 3.0]


def test_the_best_policy_is_chosen_by_the_price_at_the_end() -> None:
    validation = Validation(config_from({**SHORT, "eval_episodes": 1, "cost_price": [0.0, 2.0]}))
    found = {"timesteps": [64, 128], "results": [5.0, 6.0], "costs": [0.0, 1.0]}
    found |= {"successes": [1.0, 1.0], "ep_lengths": [300, 300]}
    validation.restore({key: np.reshape(each, (2, -1)) for key, each in found.items()})
    validation.close()
    assert validation.best == (1.0, 5.0)


@pytest.mark.parametrize("key", ["cost_price", "success_bonus"])
def test_pay_is_refused_where_goals_are_seen_in_hindsight(tmp_path: Path, key: str) -> None:
    values = {"env_id": "RigidEnvs/BallParkGoal-v0", "algo": "sac", "log_dir": str(tmp_path)}
    with pytest.raises(ConfigError, match=rf"config\.{key}.*n_sampled_goal"):
        train(config_from({**values, key: 1.0}), quiet=True)


class Free(Drift):
    """The environment for tests, without cost."""

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        observation, infos = super().reset(**arguments)
        return observation, {"is_success": infos["is_success"]}


def test_a_price_is_refused_where_there_is_no_cost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = gym.envs.registration.EnvSpec("Free-v0", vector_entry_point=Free)
    monkeypatch.setitem(gym.registry, "Free-v0", spec)
    with pytest.raises(ConfigError, match=r"config\.cost_price.*no cost"):
        trained(tmp_path, "run", env_id="Free-v0", cost_price=1.0)
