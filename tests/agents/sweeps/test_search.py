"""A search of hyperparameters whose command is killed goes on, and each trial is what it says."""

import csv
import dataclasses
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.config.reading import dump_yaml, read_yaml
from agents.config.search import read_search
from agents.storage.runs import read_config
from agents.sweeps.search import search_recipe
from agents.training.trainer import train
from rigid_envs.base.files import DamagedFileError
from tests.agents.sessions import SMALL
from tests.loading.payloads import harmful
from tests.programs import printed, python

RECIPE = SMALL | {
    "algo": "ppo",
    "total_timesteps": 512 * 60,
    "learning_rate": [{"low": 5e-4, "high": 4e-3, "log": True}, 1e-4],
    "net_arch": {"choices": [[16], [8, 8]]},
}


def test_what_stands_in_the_folder_of_a_search_is_not_run(tmp_path: Path) -> None:
    (tmp_path / "search.yaml").write_text(dump_yaml({"trials": 1, "recipe": RECIPE}))
    search, mark = read_search(tmp_path / "search.yaml"), tmp_path / "mark"
    for k, content in enumerate(harmful(mark)):
        out = tmp_path / str(k)
        out.mkdir()
        for name in ("optuna.journal", "tuner.pkl", "searcher-state.pkl"):
            (out / name).write_bytes(content + b"\n" + content)
        with pytest.raises(DamagedFileError, match=r"optuna\.journal"):
            search_recipe(search, out)
    assert not mark.exists()


@pytest.mark.long
def test_a_search_that_is_killed_goes_on(tmp_path: Path) -> None:
    search, out = tmp_path / "search.yaml", tmp_path / "out"
    search.write_text(dump_yaml({"trials": 5, "seeds": [0, 1], "recipe": RECIPE}))
    words = ["-m", "agents", "search", search, "--out", out, "--jobs", "2"]
    command = [*words, "--allow-import", "tests.agents.drift"]
    first = subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    deadline = time.perf_counter() + 300
    while not list(out.glob("trials/*/ppo/seed_1/progress.csv")):
        assert first.poll() is None and time.perf_counter() < deadline
        time.sleep(0.1)
    first.send_signal(signal.SIGKILL)
    first.wait()
    begun = set(out.glob("trials/*"))
    again = printed(*command)
    assert len(list(csv.DictReader((out / "trials.csv").open()))) == 5
    assert begun <= set(out.glob("trials/*"))
    best = read_yaml(out / "best_0.yaml")
    assert str(out / "best_0.yaml") in again and config_from(best).env_id == "Drift-v0"
    runs = sorted(out.glob("trials/*/ppo/seed_*"))
    assert len(runs) == 10
    rates = {read_config(run / "config.yaml").learning_rate for run in runs}
    assert len(rates) == 5 and tuple(best["learning_rate"]) in rates
    for run in runs:
        config = read_config(run / "config.yaml")
        config = dataclasses.replace(config, log_dir=str(tmp_path), run_name=run.parts[-3])
        alone = train(config, overwrite=True, quiet=True).folder
        for name in ("progress.csv", "best_model/policy.safetensors"):
            assert (run / name).read_bytes() == (alone / name).read_bytes()

    before = (out / "trials.csv").read_bytes()
    printed(*command)
    assert (out / "trials.csv").read_bytes() == before
    search.write_text(dump_yaml({"trials": 6, "seeds": [0, 1], "recipe": RECIPE}))
    other = python(*command)
    assert other.returncode == 2 and "is of another search; --out" in other.stderr
