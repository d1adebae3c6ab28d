"""Sweeps and searches: each training in a process of its own, with a record, and all go on."""

import dataclasses
import hashlib
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.cli.command_line import main
from agents.config.entries import config_from
from agents.config.reading import dump_yaml, read_yaml
from agents.config.search import read_search
from agents.evaluation.reports import evaluate
from agents.storage.logs import read_evaluations
from agents.storage.runs import Run, open_run, read_config
from agents.sweeps import sweep as module
from agents.sweeps.sweep import Processes, Training, train_all
from agents.training.recording import is_complete, publish
from agents.training.trainer import Session, train
from rigid_envs import load
from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import DamagedFileError
from rigid_envs.scores.records import read_record
from tests.agents.sessions import SMALL, begun, rows, small, wait_for
from tests.loading.payloads import harmful
from tests.programs import printed, python

DRIFT = "tests.agents.drift"
VERB = f"benchmark --allow-import {DRIFT} --ids Drift-v0"


def training(folder, name="a", n=20, **entries):
    config = small(folder, run_name=name, total_timesteps=512 * 6, **entries)
    return Training(config, folder / "records", n)


def sweep(*trainings, overwrite=False, imports=DRIFT):
    return train_all(trainings, Processes(2, [imports]), overwrite)


def place(folder, seed=0):
    return folder / "records" / "Drift-v0" / f"ppo_world_{seed}.json"


@pytest.mark.long
@pytest.mark.push
def test_a_record_says_how_a_policy_was_trained_and_what_came_of_it(tmp_path, capsys):
    # the first policy of the second one stays the best
    both = [training(tmp_path, n=50), training(tmp_path, "b", 50, seed=3, learning_rate=[0.0, 0.0])]
    assert sweep(*both) == 0
    assert len(re.findall(r"\d+\.\d s, \d+\.\d s of processors\n", capsys.readouterr().out)) == 2
    for each, name in zip(both, "ab", strict=True):
        config = each.config
        record, run = read_record(place(tmp_path, config.seed)), tmp_path / "ppo" / name
        found = evaluate(load(run / "best_model"), "Drift-v0", 50)
        np.testing.assert_array_equal(record.successes, found.successes)
        np.testing.assert_allclose(record.costs, found.costs, rtol=1e-5)
        assert (record.env_id, record.algo, record.frame) == ("Drift-v0", "ppo", "world")
        assert (record.seed, record.policy) == (config.seed, "ppo")
        assert config_from({**record.config, "log_dir": str(tmp_path), "run_name": name}) == config
        file = run / "best_model" / "policy.safetensors"
        assert record.policy_sha256 == hashlib.sha256(file.read_bytes()).hexdigest()
        assert record.training["timesteps"] == 512 * 6 >= record.training["policy_timesteps"]
        assert 0.0 < record.training["cpu_seconds"]
        assert 0.0 < record.training["seconds"]
        held_out = read_evaluations(run / "evaluations.npz")
        assert record.curve["timesteps"] == held_out["timesteps"].tolist()
        won, costs = held_out["successes"].astype(bool), held_out["costs"]
        means = held_out["results"].mean(axis=1)
        np.testing.assert_allclose(record.curve["return_mean"], means, rtol=1e-5)
        np.testing.assert_allclose(record.curve["success_rate"], won.mean(axis=1), rtol=1e-5)
        assert 0 < won[0].sum() < won.shape[1]
        paid = [row[own].mean() for row, own in zip(costs, won, strict=True)]
        np.testing.assert_allclose(record.curve["cost_mean"], paid, rtol=1e-5)
        assert not (run / "checkpoints").exists()
    assert record.training["policy_timesteps"] == record.curve["timesteps"][0] == 2560
    assert load(run / "best_model").document["timesteps"] == 2560


def listening(session):
    """TCP sockets on which a process of a session listens."""
    tables = [Path(f"/proc/net/{name}").read_text().splitlines()[1:] for name in ("tcp", "tcp6")]
    inodes = {line.split()[9] for table in tables for line in table if line.split()[3] == "0A"}
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            own = int((folder / "stat").read_text().rpartition(")")[2].split()[3]) == session
            links = [os.readlink(link) for link in (folder / "fd").iterdir()] if own else []
        except OSError:  # it has ended
            continue
        found += [link for link in links if link.removeprefix("socket:[")[:-1] in inodes]
    return found


@pytest.mark.long
@pytest.mark.push
def test_the_same_again_trains_nothing_and_another_config_is_refused(tmp_path):
    sweep(training(tmp_path))
    before = place(tmp_path).read_bytes()
    sweep(training(tmp_path))
    assert place(tmp_path).read_bytes() == before
    place(tmp_path).unlink()  # as if it had ended just before
    sweep(training(tmp_path))
    written = read_record(place(tmp_path))
    assert f'"seconds": {written.training["seconds"]}' in before.decode()
    other = training(tmp_path, gamma=0.5)
    with pytest.raises(ConfigError, match=r"ppo_world_0.json is of .*gamma: 0.99 -> 0.5.*--over"):
        sweep(training(tmp_path, "new", seed=1), other)
    place(tmp_path).unlink()
    with pytest.raises(ConfigError, match=r"ppo/a is of another config \(gamma: 0.99 -> 0.5\)"):
        sweep(other)
    assert not (tmp_path / "ppo" / "new").exists()
    assert sweep(other, overwrite=True) == 0
    assert read_record(place(tmp_path)).config["gamma"] == 0.5


@pytest.mark.long
@pytest.mark.push
def test_a_training_that_fails_leaves_no_record_and_lets_others_be(tmp_path, capsys):
    bad = training(tmp_path, "bad", env_kwargs={"bad_reward_at": 40}, seed=1)
    assert sweep(bad, training(tmp_path)) == 1
    out, err = capsys.readouterr()
    assert "agents: Drift-v0: reward of row 8" in err
    assert "[1/2] Drift-v0 ppo, seed 0: success" in out
    assert [path.stem for path in tmp_path.glob("records/Drift-v0/*")] == ["ppo_world_0"]


@pytest.mark.long
def test_a_training_that_dies_five_times_at_the_same_place_is_given_up(tmp_path, capsys):
    assert sweep(training(tmp_path), imports="tests.agents.deadly") == 1
    out, err = capsys.readouterr()
    assert out.count("was ended by SIGKILL; goes on from its last checkpoint") == 4
    assert "ppo/a: its process was ended by SIGKILL 5 times at the same place; given up" in err


@pytest.mark.long
def test_a_run_of_another_process_is_tried_again_later(tmp_path, monkeypatch):
    first, second = training(tmp_path), training(tmp_path, "b", seed=1)
    sweep(first)
    place(tmp_path).unlink()
    theirs = open_run(first.folder)
    is_in_use, answers, held = Training.is_in_use, [], [theirs]

    def ask(self):
        if held and place(tmp_path, 1).exists():
            held.pop().close()
        answers.append(is_in_use(self))
        return answers[-1]

    monkeypatch.setattr(Training, "is_in_use", ask)
    monkeypatch.setattr(module, "_PAUSE", 0.1)
    assert sweep(first, second) == 0
    assert answers[:2] == [True, False] and not answers[-1] and place(tmp_path).exists()


@pytest.mark.long
@pytest.mark.parametrize(
    "number", [pytest.param(signal.SIGTERM, marks=pytest.mark.push), signal.SIGINT, signal.SIGKILL]
)
def test_a_command_listens_nowhere_and_leaves_no_process_behind_and_goes_on(tmp_path, number):
    words = f"{VERB} --algo ppo --steps 1.5e5 --episodes 20 --seeds 0-1 --jobs 2 --out {tmp_path}"
    command = ["-m", "agents", *words.split()]
    locks = [tmp_path / "ppo" / f"Drift-v0_world_{seed}" / "run.lock" for seed in (0, 1)]
    first = subprocess.Popen(
        [sys.executable, *command], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    wait_for(lambda: all((lock.parent / "progress.csv").is_file() for lock in locks))
    assert listening(first.pid) == []
    os.killpg(first.pid, number) if number == signal.SIGINT else first.send_signal(number)
    _, err = first.communicate(timeout=60)
    assert first.returncode == (-number if number == signal.SIGKILL else 128 + number)
    assert "Traceback" not in err
    if number != signal.SIGKILL:
        assert err.count("finishing this update, then saving") == 1
    pids = [json.loads(lock.read_bytes())["pid"] for lock in locks]
    wait_for(lambda: not any(Path(f"/proc/{pid}").exists() for pid in pids))
    assert all(any((lock.parent / "checkpoints").iterdir()) for lock in locks)
    again = printed(*command)
    assert "[2/2] " in again and "records: " in again


@pytest.mark.long
@pytest.mark.push
def test_the_verb_trains_what_it_is_told(tmp_path, capsys):
    out = tmp_path / "out"
    words = f"{VERB} --steps 1e4 --episodes 20 --quiet".split()
    assert main([*words, "--algo", "ppo", "--seeds", "2", "--out", str(out)]) == 0
    assert f"records: {out / 'records'}" in capsys.readouterr().out
    assert read_record(place(out, 2)).training["timesteps"] == 16384  # 256 rows, 64 steps
    assert (out / "ppo" / "Drift-v0_world_2" / "best_model").exists()
    assert main([*words, "--seeds", "many", "--out", str(out)]) == 2
    assert main([*words, "--jobs", "0", "--out", str(out)]) == 2


def asked(monkeypatch, words):
    """The trainings of a command, none of which is begun."""
    found = []

    def note(trainings, *arguments, **options):
        found.extend(trainings)
        return 1

    monkeypatch.setattr("agents.sweeps.sweep.train_all", note)
    assert main(words.split()) == 1
    return found


@pytest.mark.parametrize(
    ("words", "n"),
    [
        ("benchmark --seeds 1,1 --ids BallPark", 1),
        ("benchmark --seeds 0-2,1,2-3 --ids BallPark BallPark RigidEnvs/BallPark-v0", 4),
    ],
)
def test_what_is_named_twice_is_trained_once(monkeypatch, words, n):
    found = asked(monkeypatch, words)
    assert len(found) == n
    assert len({each.folder for each in found}) == len({each.file for each in found}) == n


@pytest.mark.parametrize("text", ["", ",", "3-1", "1-", "-1", "1-2-3", "many", "0x2", "1.5"])
def test_seeds_that_name_no_training_are_refused(text, capsys):
    assert main(["benchmark", f"--seeds={text}"]) == 2
    assert f"--seeds = {text!r}; expected seeds as 0-9 or 0,2,5" in capsys.readouterr().err


def begun_with(folder, times, **entries):
    """A run that was begun, with this clock."""
    run = begun(config_from({"log_dir": str(folder), "run_name": "r", **entries}))
    if times is not None:
        (run / "times.csv").write_text(times)
    return Run(run.folder)


HEADER = "time/total_timesteps,seconds,cpu_seconds,steps_per_second\n"
UNFINISHED = [None, "", HEADER, f"{HEADER}4096,1,1,9\n", f"{HEADER}4096,1,1,9\n8191,2,2,9\n"]


@pytest.mark.parametrize("times", UNFINISHED)
def test_a_run_that_has_not_made_its_last_step_is_not_complete(tmp_path, times, monkeypatch):
    """It is neither published nor recorded: a sweep goes on with it."""
    entries = {"env_id": "RigidEnvs/BallPark-v0", "total_timesteps": 8192}
    run = begun_with(tmp_path, times, **entries)
    assert not is_complete(run)
    with pytest.raises(ConfigError, match="expected a complete run"):
        publish(run, tmp_path / "published")
    assert not (tmp_path / "published").exists()
    stopped = Session(run.folder, 4096, 1.0, 15)
    monkeypatch.setattr(module, "train_in", lambda run, quiet: stopped)
    training = Training(run.config(), tmp_path / "records", 2)
    assert training.run() == 15  # by a signal, before it is done
    assert not training.is_done() and not (tmp_path / "records").exists()


@pytest.mark.parametrize("last", [8192, 12288])  # the last update is made in full
def test_a_run_is_complete_from_its_last_step_on(tmp_path, last):
    times = f"{HEADER}4096,1,1,9\n{last},2,2,9\n"
    assert is_complete(begun_with(tmp_path, times, total_timesteps=8192))


RECIPE = SMALL | {
    "algo": "ppo",
    "total_timesteps": 512 * 60,
    "learning_rate": [{"low": 5e-4, "high": 4e-3, "log": True}, 1e-4],
    "net_arch": {"choices": [[16], [8, 8]]},
}


def test_what_stands_in_the_folder_of_a_search_is_not_run(tmp_path):
    pytest.importorskip("ray")
    pytest.importorskip("optuna")
    from agents.sweeps.search import search_recipe

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
def test_a_search_that_is_killed_goes_on(tmp_path):
    search, out = tmp_path / "search.yaml", tmp_path / "out"
    search.write_text(dump_yaml({"trials": 5, "seeds": [0, 1], "recipe": RECIPE}))
    words = ["-m", "agents", "search", search, "--out", out, "--jobs", "2"]
    command = [*words, "--allow-import", "tests.agents.drift"]
    first = subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    wait_for(lambda: list(out.glob("trials/*/ppo/seed_1/progress.csv")))
    assert first.poll() is None
    first.send_signal(signal.SIGKILL)
    first.wait()
    begun = set(out.glob("trials/*"))
    again = printed(*command)
    assert len(rows(out / "trials.csv")) == 5
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
