"""A training saves when it is due, keeps the best policy, and logs what it says."""

import csv
import itertools
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

import tests.agents.drift  # noqa: F401, registers the environment
from agents.storage.runs import create_run
from agents.training import trainer
from agents.training import validation as clock
from agents.training.trainer import Trainer, train
from agents.training.validation import Progress, Spent, Stopwatch
from rigid_envs import load
from tests.agents.sessions import small
from tests.fixtures import Capture, Patch


def begun(folder: Path, **entries: Any) -> Trainer:
    run = create_run(small(folder, **entries))
    run.begin()
    return Trainer(run, run.config(), Progress(True))


def trained(folder: Path, updates: int, **entries: Any) -> Path:
    config = small(folder, total_timesteps=512 * updates, **entries)
    return train(config, quiet=True).folder


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def test_without_a_number_checkpoints_are_due_as_often_as_they_cost_two_hundredths(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    now = [100.0]
    monkeypatch.setattr(trainer, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    training = begun(tmp_path, checkpoint_every=None)

    def due_after(seconds: float) -> bool:
        before, now[0] = now[0], now[0] + seconds
        is_due = training.checkpoint_is_due()
        now[0] = before
        return is_due

    assert [due_after(each) for each in (0.0, 1.0, 1.9, 2.1, 100.0)] == [False] * 3 + [True] * 2
    write = trainer.save_newest

    def slow(*arguments: Any) -> None:
        write(*arguments)
        now[0] += 3.0

    monkeypatch.setattr(trainer, "save_newest", slow)
    training.save()
    assert [due_after(each) for each in (3.0, 149.0, 151.0)] == [False, False, True]
    training.close()


def test_with_a_number_checkpoints_are_due_after_so_many_updates(tmp_path: Path) -> None:
    training = begun(tmp_path, checkpoint_every=3)
    due = []
    for _ in range(7):
        training.iterate()
        due.append(training.checkpoint_is_due())
    training.close()
    assert due == [False, False, True, False, False, True, False]


def test_a_default_run_that_is_killed_has_a_checkpoint(tmp_path: Path, monkeypatch: Patch) -> None:
    ticks = itertools.count(step=0.5)
    monkeypatch.setattr(trainer, "time", SimpleNamespace(perf_counter=lambda: next(ticks)))
    monkeypatch.setattr(trainer, "_SHARE", 1.0)
    iterate, made = Trainer.iterate, []

    def killed(self: Trainer) -> None:
        if len(made) == 20:
            raise KeyboardInterrupt
        made.append(self)
        iterate(self)

    monkeypatch.setattr(Trainer, "iterate", killed)
    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path, 40, checkpoint_every=None)
    assert len(list((tmp_path / "ppo" / "r" / "checkpoints").iterdir())) == 2


def test_logs_are_on_the_disk_before_the_checkpoint_that_knows_of_them(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    calls: list[Any] = []

    def fsync(descriptor: int) -> None:
        status = os.fstat(descriptor)
        calls.append((status.st_ino, status.st_size))

    def replace(old: Path, new: Path) -> None:
        calls.append(new.parent.name)
        rename(old, new)

    rename = os.replace
    training = begun(tmp_path)
    training.iterate()
    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "replace", replace)
    training.save()
    training.close()
    before = calls[: calls.index("checkpoints")]
    for name in ("progress", "monitor", "times"):
        status = (tmp_path / "ppo" / "r" / f"{name}.csv").stat()
        assert (status.st_ino, status.st_size) in before


def test_the_best_policy_is_the_first_of_the_best_evaluation(tmp_path: Path) -> None:
    run = trained(tmp_path, 20, eval_every=512, learning_rate=3e-3)
    with np.load(run / "evaluations.npz") as file:
        scores = zip(file["successes"].mean(axis=1), file["results"].mean(axis=1), strict=True)
        ages = file["timesteps"].tolist()
    ranked = [tuple(map(float, score)) for score in scores]
    first = ages[ranked.index(max(ranked))]
    assert load(run / "best_model").document["timesteps"] == first
    assert load(run / "last_model").document["timesteps"] == 512 * 20


def test_logged_evaluations_are_those_of_the_file(tmp_path: Path) -> None:
    run = trained(tmp_path, 6, eval_every=512, seed=5)
    logged = rows(run / "progress.csv")
    names = {"eval/success_rate": "successes", "eval/mean_reward": "results",
             "eval/mean_ep_length": "ep_lengths", "eval/mean_cost": "costs"}  # fmt: skip
    with np.load(run / "evaluations.npz") as file:
        for column, key in names.items():
            np.testing.assert_allclose([float(r[column]) for r in logged], file[key].mean(axis=1))
    assert load(run / "best_model").document["seed"] == 5


def test_episodes_are_logged_at_the_age_of_all_rows_together(tmp_path: Path) -> None:
    run = trained(tmp_path, 4, env_kwargs={"max_episode_steps": 10})
    episodes = rows(run / "monitor.csv")
    ages = [int(row["t"]) for row in episodes]
    assert ages == sorted(ages) and all(age % 16 == 0 for age in ages) and ages[-1] > 512 * 3
    # of each row the lengths of all episodes fill the run, but for the one that goes on
    total = sum(int(row["l"]) for row in episodes)
    assert 512 * 4 - 16 * 10 < total <= 512 * 4
    assert {row["is_success"] for row in episodes} <= {"0", "1"}


def test_bonus_and_price_are_those_of_the_age(tmp_path: Path) -> None:
    training = begun(tmp_path, success_bonus=3.0, cost_price=[0.0, 2.0], total_timesteps=512 * 4)
    prices = []
    for _ in range(4):
        training.iterate()
        prices.append(training._adapter.price)
    training.close()
    assert prices == [0.0, 0.5, 1.0, 1.5]
    assert training._adapter.bonus == 3.0


def test_threads_of_torch_are_as_said(tmp_path: Path) -> None:
    try:
        begun(tmp_path, torch_threads=2).close()
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(1)


def test_leftovers_of_writes_are_swept_when_a_run_goes_on(tmp_path: Path) -> None:
    run = trained(tmp_path, 2)
    leftover = run / "checkpoints" / ".000000000001536.safetensors.77.tmp"
    leftover.touch()
    train(run, quiet=True)
    assert not leftover.exists()


def test_time_and_processor_time_of_all_sessions_are_added(monkeypatch: Patch) -> None:
    wall, processor = [100.0], [7.0]
    fake = SimpleNamespace(perf_counter=lambda: wall[0], process_time=lambda: processor[0])
    monkeypatch.setattr(clock, "time", fake)
    running = Stopwatch(Spent(1000.0, 500.0))
    wall[0], processor[0] = 130.0, 9.0
    assert running.spent() == Spent(1030.0, 502.0)


def test_speed_is_that_of_each_update(tmp_path: Path, monkeypatch: Patch) -> None:
    wall = [100.0]
    fake = SimpleNamespace(perf_counter=lambda: wall[0], process_time=lambda: 0.0)
    monkeypatch.setattr(clock, "time", fake)
    training = begun(tmp_path)
    for seconds in (8.0, 2.0, 4.0):
        wall[0] += seconds
        training.iterate()
    training.close()
    speeds = [float(row["steps_per_second"]) for row in rows(tmp_path / "ppo" / "r" / "times.csv")]
    assert speeds == [512 / 8, 512 / 2, 512 / 4]


def test_another_machine_is_told_of_when_a_run_goes_on(
    tmp_path: Path, monkeypatch: Patch, capsys: Capture
) -> None:
    run = trained(tmp_path, 2)
    capsys.readouterr()
    train(run)
    assert "not the machine" not in capsys.readouterr().err
    other = trainer.manifest() | {"machine": "pdp11"}
    monkeypatch.setattr(trainer, "manifest", lambda: other)
    train(run)
    assert "not its bits: machine: " in capsys.readouterr().err
