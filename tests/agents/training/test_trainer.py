"""A training saves and evaluates when it is due, keeps the best policy, and logs what it says."""

import gc
import os
import warnings
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
import torch

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.environments import make
from agents.evaluation.reports import evaluate
from agents.storage.logs import read_evaluations
from agents.storage.runs import create_run
from agents.training import trainer, validation
from agents.training.rows import TrainingRows
from agents.training.trainer import train
from agents.training.validation import VALIDATION_SEED, Records, Spent, Stopwatch, Validation
from rigid_envs import load
from rigid_envs.base.checks import ConfigError
from rigid_envs.scores.starts import TEST_SEED, row_seeds
from tests.agents.drift import Drift
from tests.agents.sessions import rows, small
from tests.agents.trainings import begun


def trained(folder, updates, **entries):
    config = small(folder, total_timesteps=512 * updates, **entries)
    return train(config, quiet=True).folder


def test_without_a_number_checkpoints_are_due_as_often_as_they_cost_two_hundredths(
    tmp_path, monkeypatch
):
    now = [100.0]
    monkeypatch.setattr(trainer, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    training = begun(small(tmp_path, checkpoint_every=None))

    def due_after(seconds):
        before, now[0] = now[0], now[0] + seconds
        is_due = training.checkpoint_is_due()
        now[0] = before
        return is_due

    assert [due_after(each) for each in (0.0, 1.0, 1.9, 2.1, 100.0)] == [False] * 3 + [True] * 2
    write = trainer.save_newest

    def slow(*arguments):
        write(*arguments)
        now[0] += 3.0

    monkeypatch.setattr(trainer, "save_newest", slow)
    training.save()
    assert [due_after(each) for each in (3.0, 149.0, 151.0)] == [False, False, True]
    training.close()


@pytest.mark.parametrize("name", ["times.csv", "tensorboard"])
def test_logs_are_closed_again_where_one_cannot_be_opened(tmp_path, name):
    run = create_run(small(tmp_path))
    (run / name).mkdir() if name.endswith("csv") else (run / name).touch()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with pytest.raises(OSError, match=name):
            Records(run, run.config(), None)
        gc.collect()
    assert not [each for each in said if issubclass(each.category, ResourceWarning)]
    run.close()


def test_logs_are_on_the_disk_before_the_checkpoint_that_knows_of_them(tmp_path, monkeypatch):
    calls = []

    def fsync(descriptor):
        status = os.fstat(descriptor)
        calls.append((status.st_ino, status.st_size))

    def replace(old, new):
        calls.append(new.parent.name)
        rename(old, new)

    rename = os.replace
    training = begun(small(tmp_path))
    training.iterate()
    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "replace", replace)
    training.save()
    training.close()
    before = calls[: calls.index("checkpoints")]
    for name in ("progress", "monitor", "times"):
        status = (tmp_path / "ppo" / "r" / f"{name}.csv").stat()
        assert (status.st_ino, status.st_size) in before


def test_evaluations_are_logged_and_the_best_policy_is_the_first_of_the_best(tmp_path):
    # A rate so high that a policy gets worse: the last one is not the best.
    run = trained(tmp_path, 4, eval_every=512, learning_rate=0.1, seed=5)
    names = {"eval/success_rate": "successes", "eval/mean_reward": "results",
             "eval/mean_ep_length": "ep_lengths", "eval/mean_cost": "costs"}  # fmt: skip
    logged = rows(run / "progress.csv")
    found = read_evaluations(run / "evaluations.npz")
    for column, key in names.items():
        np.testing.assert_allclose([float(r[column]) for r in logged], found[key].mean(axis=1))
    scores = zip(found["successes"].mean(axis=1), found["results"].mean(axis=1), strict=True)
    ranked = [tuple(map(float, score)) for score in scores]
    first = found["timesteps"].tolist()[ranked.index(max(ranked))]
    document = load(run / "best_model").document
    assert (document["timesteps"], document["seed"]) == (first, 5)
    assert first < load(run / "last_model").document["timesteps"] == 512 * 4


def test_episodes_are_logged_at_the_age_of_all_rows_together(tmp_path):
    run = trained(tmp_path, 4, env_kwargs={"max_episode_steps": 10})
    episodes = rows(run / "monitor.csv")
    ages = [int(row["t"]) for row in episodes]
    assert ages == sorted(ages) and all(age % 16 == 0 for age in ages) and ages[-1] > 512 * 3
    # of each row the lengths of all episodes fill the run, but for the one that goes on
    total = sum(int(row["l"]) for row in episodes)
    assert 512 * 4 - 16 * 10 < total <= 512 * 4
    assert {row["is_success"] for row in episodes} <= {"0", "1"}


def test_bonus_and_price_are_those_of_the_age(tmp_path):
    pay = {"success_bonus": 3.0, "cost_price": [0.0, 2.0]}
    training = begun(small(tmp_path, **pay, total_timesteps=512 * 4))
    prices = []
    for _ in range(4):
        training.iterate()
        prices.append(training._adapter.price)
    training.close()
    assert prices == [0.0, 0.5, 1.0, 1.5]
    assert training._adapter.bonus == 3.0


def test_threads_of_torch_are_as_said(tmp_path):
    try:
        begun(small(tmp_path, torch_threads=2)).close()
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(1)


@pytest.mark.parametrize(
    ("steps", "told"), [(1024, "1,024 steps, then"), (600, "1,024 steps (600, rounded up to whole")]
)
def test_steps_that_are_rounded_up_are_told_before_the_training(tmp_path, capsys, steps, told):
    assert train(small(tmp_path, total_timesteps=steps)).timesteps == 1024
    first = capsys.readouterr().err.splitlines()[0]
    assert first.startswith(f"Drift-v0: ppo, {told}")


def test_leftovers_of_writes_are_swept_when_a_run_goes_on(tmp_path):
    run = trained(tmp_path, 2)
    leftover = run / "checkpoints" / ".000000000001536.safetensors.77.tmp"
    leftover.touch()
    train(run, quiet=True)
    assert not leftover.exists()


def test_time_and_processor_time_of_all_sessions_are_added(monkeypatch):
    wall, processor = [100.0], [7.0]
    fake = SimpleNamespace(perf_counter=lambda: wall[0], process_time=lambda: processor[0])
    monkeypatch.setattr(validation, "time", fake)
    running = Stopwatch(1000.0, 500.0)
    wall[0], processor[0] = 130.0, 9.0
    assert running.spent() == Spent(1030.0, 502.0)


def test_speed_is_that_of_each_update(tmp_path, monkeypatch):
    wall = [100.0]
    fake = SimpleNamespace(perf_counter=lambda: wall[0], process_time=lambda: 0.0)
    monkeypatch.setattr(validation, "time", fake)
    training = begun(small(tmp_path))
    for seconds in (8.0, 2.0, 4.0):
        wall[0] += seconds
        training.iterate()
    training.close()
    speeds = [float(row["steps_per_second"]) for row in rows(tmp_path / "ppo" / "r" / "times.csv")]
    assert speeds == [512 / 8, 512 / 2, 512 / 4]


def test_another_machine_is_told_of_when_a_run_goes_on(tmp_path, monkeypatch, capsys):
    run = trained(tmp_path, 2)
    capsys.readouterr()
    train(run)
    assert "not the machine" not in capsys.readouterr().err
    other = trainer.manifest() | {"machine": "pdp11"}
    monkeypatch.setattr(trainer, "manifest", lambda: other)
    train(run)
    assert "not its bits: machine: " in capsys.readouterr().err


def constant(obs):
    """Always the same action."""
    return np.tile(np.array([0.1, 0.0], dtype=np.float32), (len(obs), 1))


def validated(**entries):
    return Validation(config_from({"env_id": "Drift-v0", "eval_episodes": 20, **entries}))


@pytest.mark.parametrize("seed", [0, 1, TEST_SEED, VALIDATION_SEED])
def test_training_validation_and_test_share_no_start(tmp_path, monkeypatch, seed):
    seen = {}

    def play(policy, venv, seeds):
        seen["validation"] = seeds
        return played(policy, venv, seeds)

    def seeded(self, seeds):
        seen["train"] = seeds
        return seed_rows(self, seeds)

    played, seed_rows = validation.play, TrainingRows.seed
    monkeypatch.setattr(validation, "play", play)
    monkeypatch.setattr(TrainingRows, "seed", seeded)
    training = begun(small(tmp_path, n_envs=64, eval_every=1, eval_episodes=100, seed=seed))
    training.iterate()
    training.close()
    tested = row_seeds(TEST_SEED, 1000, "test")
    assert len({*tested, *seen["train"], *seen["validation"]}) == 1000 + 64 + 100
    assert seen["train"] == row_seeds(seed, 64, "train")  # each run has its own


def test_the_first_of_equally_good_policies_is_the_best():
    evaluations = validated()
    _, better = evaluations.run(lambda venv: constant, 1)
    assert better
    best = evaluations.best
    _, better = evaluations.run(lambda venv: constant, 2)
    assert not better and evaluations.best == best
    evaluations.close()


def test_success_counts_before_return_and_return_before_nothing():
    evaluations = validated(eval_episodes=2, cost_price=[0.0, 2.0])
    for won, results, costs, best in (
        ([0, 1], [5.0, 6.0], [0.0, 1.0], (0.5, 4.5)),
        ([1, 1], [1.0, 2.0], [1.0, 1.0], (1.0, -0.5)),  # more success with less return
        ([1, 1], [1.0, 2.0], [0.5, 0.5], (1.0, 0.5)),  # the same success at less cost
    ):
        columns = {"successes": won, "results": results, "costs": costs, "ep_lengths": [3, 4]}
        arrays = {key: np.array([column]) for key, column in columns.items()}
        evaluations.found = {"timesteps": np.array([1]), **arrays}
        assert evaluations.best == best
    assert (1.0, 0.5) > (1.0, -0.5) > (0.5, 4.5)
    evaluations.close()


def test_it_is_due_where_an_update_passes_a_multiple_and_at_the_end():
    config = config_from({"env_id": "Drift-v0", "eval_every": 1000, "total_timesteps": 3100,
                          "n_envs": 8, "n_steps": 32, "batch_size": 64})  # fmt: skip
    evaluations = Validation(config)
    pairs = [(0, 999), (0, 1000), (999, 1001), (1000, 1999), (2999, 3001), (3001, 3099)]
    due = [evaluations.is_due(before, now, 3100) for before, now in pairs]
    assert due == [False, True, True, False, True, False]
    assert evaluations.is_due(3001, 3100, 3100) and evaluations.is_due(3001, 3257, 3100)
    # of updates of 256 steps: those that end behind 1000, 2000, 3000, and the last one
    assert evaluations.ages(13, config) == [1024, 2048, 3072, 3328]
    evaluations.close()


def top(folder, name, **entries):
    values = {"env_id": "RigidEnvs/SleepingTop-v0", "eval_every": 512, **entries}
    return trained(folder, 2, run_name=name, **values)


def test_they_change_what_is_learnt_and_not_what_is_evaluated(tmp_path):
    frozen = {"learning_rate": [0.0, 0.0]}
    plain = top(tmp_path, "plain", **frozen)
    priced = top(tmp_path, "priced", **frozen, train_kwargs={"weight_effort": 9.0})
    found, others = (read_evaluations(run / "evaluations.npz") for run in (plain, priced))
    for key, column in found.items():  # of the same policy, which did not learn
        np.testing.assert_array_equal(column, others[key])
    policies = [
        load(top(tmp_path, name, train_kwargs=keywords) / "last_model")
        for name, keywords in (("a", {}), ("b", {"weight_effort": 9.0}), ("c", {"dt": 0.01}))
    ]
    assert {str(policy.document["env_kwargs"]) for policy in policies} == {"{}"}
    weights = [policy.arrays["layers.0.weight"].tobytes() for policy in policies]
    assert len(set(weights)) == 3


@pytest.mark.parametrize("pay", [{"price": 0.3}, {"bonus": 3.0}], ids=str)
def test_price_and_bonus_are_of_every_reward_of_training(pay):
    envs = [TrainingRows(make("RigidEnvs/BallGrid-v0", {}, 200)) for _ in range(2)]
    rng, n_ended, n_won = np.random.default_rng(0), 0, 0
    for env in envs:
        env.seed(0)
        env.reset()
    vars(envs[1]).update(pay)
    for _ in range(60):  # the limit is 50 steps
        actions = rng.integers(0, 4, 200)
        for env in envs:
            env.step_async(actions)
        (_, plain, dones, infos), (_, paid, *_) = (env.step_wait() for env in envs)
        won = np.array([info.get("is_success", False) for info in infos])  # success ends it
        # a move costs a quarter roll, the last one of an episode too
        expected = pay.get("bonus", 0.0) * won - pay.get("price", 0.0) * np.pi / 2
        np.testing.assert_allclose(paid - plain, expected, rtol=1e-5, atol=1e-6)
        n_ended, n_won = n_ended + dones.sum(), n_won + won.sum()
    assert n_ended and n_won


def test_a_price_goes_along_a_line_and_stays_at_its_end():
    config = config_from({"total_timesteps": 1000, "cost_price": [1.0, 3.0]})
    assert [config.price_at(age) for age in (0, 500, 1000, 1100)] == [1.0, 2.0, 3.0, 3.0]


class Free(Drift):
    """The environment for tests, without cost."""

    def reset(self, **arguments):
        observation, infos = super().reset(**arguments)
        return observation, {"is_success": infos["is_success"]}


def test_a_price_is_refused_where_there_is_no_cost(tmp_path, monkeypatch):
    spec = gym.envs.registration.EnvSpec("Free-v0", vector_entry_point=Free)
    monkeypatch.setitem(gym.registry, "Free-v0", spec)
    with pytest.raises(ConfigError, match=r"config\.cost_price.*no cost"):
        top(tmp_path, "run", env_id="Free-v0", cost_price=1.0)


EASY = {
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
def test_learning_beats_chance_by_far(tmp_path, name):
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
