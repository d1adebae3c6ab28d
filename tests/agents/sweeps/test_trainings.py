"""Which trainings a command asks for, and when one of them counts as done."""

from pathlib import Path
from typing import Any

import pytest

from agents.cli.command_line import main
from agents.config.entries import config_from
from agents.storage.runs import Run
from agents.sweeps import sweep as module
from agents.sweeps.sweep import Training
from agents.training.recording import is_complete, publish
from agents.training.trainer import Session
from rigid_envs.base.checks import ConfigError
from tests.agents.sessions import begun
from tests.fixtures import Capture, Patch


def asked(monkeypatch: Patch, words: str) -> list[Training]:
    """The trainings of a command, none of which is begun."""
    found: list[Training] = []

    def note(trainings: list[Training], *arguments: Any, **options: Any) -> int:
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
def test_what_is_named_twice_is_trained_once(monkeypatch: Patch, words: str, n: int) -> None:
    found = asked(monkeypatch, words)
    assert len(found) == n
    assert len({each.folder for each in found}) == len({each.file for each in found}) == n


@pytest.mark.parametrize("text", ["", ",", "3-1", "1-", "-1", "1-2-3", "many", "0x2", "1.5"])
def test_seeds_that_name_no_training_are_refused(text: str, capsys: Capture) -> None:
    assert main(["benchmark", f"--seeds={text}"]) == 2
    assert f"--seeds = {text!r}; expected seeds as 0-9 or 0,2,5" in capsys.readouterr().err


def begun_with(folder: Path, times: str | None, **entries: Any) -> Run:
    """A run that was begun, with this clock."""
    run = begun(config_from({"log_dir": str(folder), "run_name": "r", **entries}))
    if times is not None:
        (run / "times.csv").write_text(times)
    return Run(run.folder)


HEADER = "time/total_timesteps,seconds,cpu_seconds,steps_per_second\n"
UNFINISHED = [None, "", HEADER, f"{HEADER}4096,1,1,9\n", f"{HEADER}4096,1,1,9\n8191,2,2,9\n"]


@pytest.mark.parametrize("times", UNFINISHED)
def test_a_run_that_has_not_made_its_last_step_is_not_complete(
    tmp_path: Path, times: str | None, monkeypatch: Patch
) -> None:
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
def test_a_run_is_complete_from_its_last_step_on(tmp_path: Path, last: int) -> None:
    times = f"{HEADER}4096,1,1,9\n{last},2,2,9\n"
    assert is_complete(begun_with(tmp_path, times, total_timesteps=8192))
