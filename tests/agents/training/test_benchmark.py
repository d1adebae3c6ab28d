"""One table of all trainings beside chance, which says of each number where it comes from."""

import json
import signal
from pathlib import Path
from typing import Any

import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.cli.command_line import main
from agents.config.by_algorithm import config_from
from agents.config.recipes import config_for
from agents.evaluation.evaluate import evaluate
from agents.policies.policy_file import load_policy
from agents.training import benchmark as module
from agents.training.benchmark import train_all
from agents.training.trainer import Outcome
from rigid_envs.scores.starts import TEST_SEED
from tests.agents.sessions import SMALL

FEW = SMALL | {"total_timesteps": 512 * 6}


def config(folder: Path, name: str = "a", **entries: Any) -> Any:
    return config_from(FEW | {"log_dir": str(folder), "run_name": name} | entries)


def rows(folder: Path) -> Any:
    return json.loads((folder / "benchmark.json").read_text())["rows"]


def test_a_row_has_the_figures_of_policy_and_chance_on_the_same_starts(tmp_path: Path) -> None:
    assert train_all([config(tmp_path), config(tmp_path, "b", seed=3)], tmp_path, 50, True) == 0
    for row, name in zip(rows(tmp_path), "ab", strict=True):
        policy = load_policy(tmp_path / "ppo" / name / "best_model")
        learnt, chance = (evaluate(actor, "Drift-v0", 50, TEST_SEED) for actor in (policy, None))
        assert row["policy"]["return_mean"] == learnt.values["return"].mean()
        assert row["policy"]["success_rate"] == learnt.successes.mean()
        assert row["random_policy"]["return_mean"] == chance.values["return"].mean()
        assert row["random_policy"]["success_rate"] == chance.successes.mean()
        assert row["run_timesteps"] == 512 * 6 >= row["training_timesteps"]
        assert row["training_seed"] == (3 if name == "b" else 0)
        keys = {"versions", "git_commit", "git_dirty", "command", "kernel_hash", "policy_sha256",
                "test_seed", "machine", "training_seconds"}  # fmt: skip
        assert keys <= row.keys()
    header, rule, *lines, blank, note, second_note = (
        (tmp_path / "benchmark.md").read_text().splitlines()
    )
    assert {line.count("|") for line in (header, rule, *lines)} == {9}
    assert len(lines) == 2 and blank == ""
    shown = [cell.strip() for cell in lines[0].split("|")[1:-1]]
    figures = rows(tmp_path)[0]
    chance, learnt = figures["random_policy"], figures["policy"]
    assert shown[:-1] == [
        "`Drift-v0`",
        "PPO",
        *(f"{100 * chance['success_rate']:.1f} %", f"{chance['return_mean']:.2f}"),
        *(f"{100 * learnt['success_rate']:.1f} %", f"{learnt['return_mean']:.2f}"),
        "3,072",
    ]
    assert "training seed 0" in note and "training seed 3" in second_note


def test_the_same_again_trains_nothing_anew_and_other_entries_are_refused(tmp_path: Path) -> None:
    train_all([config(tmp_path)], tmp_path, 20, True)
    before = (tmp_path / "ppo" / "a" / "progress.csv").read_bytes()
    figures = rows(tmp_path)[0]["policy"]
    assert train_all([config(tmp_path)], tmp_path, 20, True) == 0
    assert (tmp_path / "ppo" / "a" / "progress.csv").read_bytes() == before
    assert rows(tmp_path)[0]["policy"] == figures
    with pytest.raises(ValueError, match=r"another config \(gamma: 0.99 -> 0.5\).*--out"):
        train_all([config(tmp_path, gamma=0.5)], tmp_path, 20, True)


def test_a_training_that_fails_leaves_out_its_row_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = config(tmp_path, "bad", env_kwargs={"bad_reward_at": 40})
    assert train_all([bad, config(tmp_path)], tmp_path, 20, True) == 1
    assert "error: Drift-v0: reward of row 8" in capsys.readouterr().err
    assert [row["config"] for row in rows(tmp_path)] == [{}]


def test_a_signal_ends_all_and_keeps_what_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    train_in, stopped = module.train_in, config(tmp_path, "stopped")

    def stop(run: Any, quiet: bool) -> Outcome:
        if run.config() == stopped:
            return Outcome(run.folder, 512, 1.0, signal.SIGTERM)
        return train_in(run, quiet)

    monkeypatch.setattr(module, "train_in", stop)
    status = train_all([config(tmp_path), stopped, config(tmp_path, "c")], tmp_path, 20, True)
    assert status == 128 + signal.SIGTERM
    assert len(rows(tmp_path)) == 1


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
    assert main([*words, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert (out / "benchmark.md").read_text() in said and str(out) in said
    assert rows(out)[0]["run_timesteps"] == 2 * 16384  # two updates of 256 rows, 64 steps
    assert (out / "ppo" / "Drift-v0" / "results.json").exists()
