"""Trainings with several seeds, shared between processes, and a record of each."""

import hashlib
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.cli.command_line import main
from agents.config.by_algorithm import config_from
from agents.config.recipes import config_for
from agents.evaluation.evaluate import evaluate
from agents.policies.policy_file import load_policy
from agents.storage.runs import open_run
from agents.training import benchmark as module
from agents.training.benchmark import train_all
from agents.training.trainer import Outcome
from rigid_envs.errors import ConfigError
from rigid_envs.scores.records import read_record
from tests.agents.sessions import SMALL

FEW = SMALL | {"total_timesteps": 512 * 6}


def config(folder: Path, name: str = "a", **entries: Any) -> Any:
    return config_from(FEW | {"log_dir": str(folder), "run_name": name} | entries)


def place(folder: Path, seed: int = 0) -> Path:
    return folder / "Drift-v0" / f"ppo_world_{seed}.json"


def test_a_record_says_how_a_policy_was_trained_and_what_came_of_it(tmp_path: Path) -> None:
    records = tmp_path / "records"
    configs = [config(tmp_path), config(tmp_path, "b", seed=3)]
    assert train_all(configs, records, 50, True) == 0
    for each, name in zip(configs, "ab", strict=True):
        record, run = read_record(place(records, each.seed)), tmp_path / "ppo" / name
        found = evaluate(load_policy(run / "best_model"), "Drift-v0", 50)
        np.testing.assert_array_equal(record.successes, found.successes)
        np.testing.assert_allclose(record.costs, found.costs, rtol=1e-5)
        assert (record.env_id, record.algo, record.frame) == ("Drift-v0", "ppo", "world")
        assert (record.seed, record.policy) == (each.seed, "ppo")
        assert config_from({**record.config, "log_dir": str(tmp_path), "run_name": name}) == each
        file = run / "best_model" / "policy.safetensors"
        assert record.policy_sha256 == hashlib.sha256(file.read_bytes()).hexdigest()
        assert record.training["timesteps"] == 512 * 6 >= record.training["policy_timesteps"]
        assert 0.0 < record.training["cpu_seconds"]
        assert 0.0 < record.training["seconds"]
        with np.load(run / "evaluations.npz") as held_out:
            assert record.curve["timesteps"] == held_out["timesteps"].tolist()
            means = held_out["results"].mean(axis=1)
        np.testing.assert_allclose(record.curve["return_mean"], means, rtol=1e-5)
        assert not (run / "checkpoints").exists()


def test_the_same_again_trains_nothing_anew(tmp_path: Path) -> None:
    train_all([config(tmp_path)], tmp_path, 20, True)
    before = place(tmp_path).read_bytes()
    train_all([config(tmp_path)], tmp_path, 20, True)
    assert place(tmp_path).read_bytes() == before
    place(tmp_path).unlink()  # as if it had ended just before
    train_all([config(tmp_path)], tmp_path, 20, True)
    written = read_record(place(tmp_path))
    assert f'"seconds": {written.training["seconds"]}' in before.decode()


def test_another_config_is_refused_before_anything_is_trained_or_trained_anew(
    tmp_path: Path,
) -> None:
    train_all([config(tmp_path)], tmp_path, 20, True)
    other = config(tmp_path, gamma=0.5)
    with pytest.raises(ConfigError, match=r"ppo_world_0.json is of .*gamma: 0.99 -> 0.5.*--over"):
        train_all([config(tmp_path, "new", seed=1), other], tmp_path, 20, True)
    place(tmp_path).unlink()
    with pytest.raises(ConfigError, match=r"ppo/a is of another config \(gamma: 0.99 -> 0.5\)"):
        train_all([other], tmp_path, 20, True)
    assert not (tmp_path / "ppo" / "new").exists()
    assert train_all([other], tmp_path, 20, True, overwrite=True) == 0
    assert read_record(place(tmp_path)).config["gamma"] == 0.5


def test_a_training_that_fails_leaves_no_record_and_lets_others_be(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = config(tmp_path, "bad", env_kwargs={"bad_reward_at": 40}, seed=1)
    assert train_all([bad, config(tmp_path)], tmp_path, 20, True) == 1
    assert "error: Drift-v0: reward of row 8" in capsys.readouterr().err
    assert [path.stem for path in tmp_path.glob("Drift-v0/*")] == ["ppo_world_0"]


def test_a_signal_ends_all_and_keeps_what_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    train_in, stopped = module.train_in, config(tmp_path, "stopped", seed=1)

    def stop(run: Any, quiet: bool) -> Outcome:
        if run.config() == stopped:
            return Outcome(run.folder, 512, 1.0, signal.SIGTERM)
        return train_in(run, quiet)

    monkeypatch.setattr(module, "train_in", stop)
    last = config(tmp_path, "c", seed=2)
    assert train_all([config(tmp_path), stopped, last], tmp_path, 20, True) == 128 + signal.SIGTERM
    assert place(tmp_path).exists() and not place(tmp_path, 2).exists()


def test_a_run_of_another_process_is_tried_again_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = config(tmp_path), config(tmp_path, "b", seed=1)
    train_all([first], tmp_path, 20, True)
    place(tmp_path).unlink()
    theirs, pauses = open_run(tmp_path / "ppo" / "a"), []

    def pause(seconds: float) -> None:
        assert place(tmp_path, 1).exists()
        pauses.append(seconds)
        theirs.close()

    monkeypatch.setattr(module, "sleep", pause)
    assert train_all([first, second], tmp_path, 20, True) == 0
    assert len(pauses) == 1 and place(tmp_path).exists()


@pytest.mark.parametrize(
    ("env_id", "algo", "entries"),
    [
        ("RigidEnvs/BallPark-v0", "ppo", {"env_kwargs": {"frame": "reduced"}}),
        ("RigidEnvs/BallParkGoal-v0", "ppo", {"env_kwargs": {"frame": "reduced"}}),
        ("tests.agents.drift:Drift-v0", "ppo", {"env_kwargs": {}, "n_envs": 256}),
    ],
)
def test_an_environment_gets_its_own_config_or_an_algorithm_that_suits_it(
    env_id: str, algo: str, entries: dict[str, Any]
) -> None:
    config = config_for(env_id, {"seed": 7})
    assert (config.env_id, config.algo, config.seed) == (env_id, algo, 7)
    assert {name: getattr(config, name) for name in entries} == entries


def test_the_verb_trains_what_it_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = ["benchmark", "--ids", "Drift-v0", "--steps", "2e4", "--episodes", "20", "--quiet"]
    assert main([*words, "--algo", "ppo", "--seeds", "0,2-3", "--out", str(out)]) == 0
    assert f"records: {out / 'records'}" in capsys.readouterr().out
    for seed in (0, 2, 3):
        record = read_record(place(out / "records", seed))
        assert record.training["timesteps"] == 2 * 16384  # two updates of 256 rows, 64 steps
        assert (out / "ppo" / f"Drift-v0_world_{seed}" / "best_model").exists()
    assert main([*words, "--seeds", "many", "--out", str(out)]) == 2
