"""A search of hyperparameters whose command is killed goes on, and each trial is what it says."""

import csv
import json
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.cli.command_line import main
from agents.config.entries import config_from
from agents.config.reading import dump_yaml, read_yaml
from agents.config.search import read_search
from agents.training.trainer import train
from tests.agents.sessions import SMALL

RECIPE = SMALL | {
    "algo": "ppo",
    "total_timesteps": 512 * 60,
    "learning_rate": [{"low": 5e-4, "high": 4e-3, "log": True}, 1e-4],
    "net_arch": {"choices": [[16], [8, 8]]},
}


class Trap:
    """Unpickled, it leaves a flag."""

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (Path("flag"),)


def test_a_folder_of_a_search_is_not_unpickled_unless_the_user_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ray = pytest.importorskip("ray")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(ray, "init", lambda *_, **__: None)
    Path("search.yaml").write_text(dump_yaml({"trials": 5, "seeds": [0], "recipe": RECIPE}))
    kept = tmp_path / "out/tune"
    kept.mkdir(parents=True)
    for name in ("tuner.pkl", "trainable.pkl", "experiment_state-1.json"):
        (kept / name).write_bytes(pickle.dumps(Trap()))
    words = ["search", "search.yaml", "--out", "out", "--allow_import", "tests.agents.drift"]
    assert main(words) == 2
    assert not Path("flag").exists()


@pytest.mark.long
def test_a_search_that_is_killed_goes_on(tmp_path: Path) -> None:
    search_file, out = tmp_path / "search.yaml", tmp_path / "out"
    search_file.write_text(dump_yaml({"trials": 5, "seeds": [0, 1], "recipe": RECIPE}))
    words = [sys.executable, "-m", "agents", "search", search_file, "--out", out, "--jobs", "2"]
    command = [*words, "--allow_import", "tests.agents.drift"]
    first = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.perf_counter() + 120
    while not list(out.glob("trials/*/trial.json")):
        assert first.poll() is None and time.perf_counter() < deadline
        time.sleep(0.1)
    first.send_signal(signal.SIGKILL)
    first.wait()
    other = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert other.returncode == 2 and "--resume goes on with it, if" in other.stderr
    command.append("--resume")
    again = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert again.returncode == 0, again.stderr
    rows = list(csv.DictReader((out / "trials.csv").open()))
    assert len(rows) == 5
    best = read_yaml(out / "best_0.yaml")
    assert str(out / "best_0.yaml") in again.stdout
    assert best["env_id"] == "Drift-v0" and best["total_timesteps"] == 512 * 60
    assert str(best["learning_rate"][0]) in {row["learning_rate.0"] for row in rows}

    search = read_search(search_file)
    # A trial that began less than a moment before the kill may have left a folder and no more.
    done = list(out.glob("trials/*/trial.json"))
    assert len(done) == 5
    for file in done:
        trial, values = file.parent, json.loads(file.read_text())["values"]
        for seed in search.seeds:
            config = search.config(values, seed=seed, log_dir=str(tmp_path), run_name=f"{seed}")
            train(config, overwrite=True, quiet=True)
            for name in ("progress.csv", "best_model/policy.safetensors"):
                ours, theirs = trial / "ppo" / f"seed_{seed}", tmp_path / "ppo" / f"{seed}"
                assert (ours / name).read_bytes() == (theirs / name).read_bytes()

    search_file.write_text(dump_yaml({"trials": 6, "seeds": [0, 1], "recipe": RECIPE}))
    other = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert other.returncode == 2 and "is of another search; --out" in other.stderr
    assert config_from(best).env_id == "Drift-v0"
