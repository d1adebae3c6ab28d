"""Sweeps go on to the bit where processes die or hang; a training that works is let be."""

import multiprocessing
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from agents.sweeps import sweep as module
from agents.sweeps.sweep import Patience, Processes, Training, train_all
from tests.agents.sweeps.kills import assert_as_undisturbed, kill_some, stop_once, trainings
from tests.fixtures import Capture, Patch


class Clock:
    """Time that goes on when it is told to."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Watched:
    """A training that writes when it is told to."""

    def __init__(self) -> None:
        self.sign, self.used = 0.0, True

    def last_sign(self) -> float:
        return self.sign

    def is_in_use(self) -> bool:
        return self.used


@pytest.fixture
def clock(monkeypatch: Patch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(module, "monotonic", clock)
    return clock


def looks(patience: Patience, clock: Clock, running: Any, n: int) -> list[list[int]]:
    """What it says, each second."""
    found = []
    for _ in range(n):
        clock.now += 1.0
        found.append(patience.lost(running))
    return found


def test_one_that_writes_nothing_is_lost_and_is_counted_anew(clock: Clock) -> None:
    silent, busy = Watched(), Watched()
    patience, said = Patience(10.0), []
    for _ in range(30):
        busy.sign += 1.0
        said += looks(patience, clock, {3: silent, 5: busy}, 1)
    # the first look only takes note; the eleventh after it is later than 10 s
    assert [k for k, numbers in enumerate(said) if numbers] == [11, 22]
    assert said[11] == said[22] == [3]


def test_one_that_waits_in_a_queue_is_not_lost(clock: Clock) -> None:
    queued = Watched()
    queued.used = False
    assert not any(looks(Patience(10.0), clock, {0: queued}, 100))


def test_one_that_began_again_is_counted_anew(clock: Clock) -> None:
    patience, silent = Patience(10.0), Watched()
    assert not any(looks(patience, clock, {0: silent}, 10))
    assert not any(looks(patience, clock, {}, 1))
    assert not any(looks(patience, clock, {0: silent}, 11))


def test_time_in_which_the_sweep_was_stopped_too_does_not_count(clock: Clock) -> None:
    patience, silent = Patience(10.0), Watched()
    looks(patience, clock, {0: silent}, 2)
    clock.now += 1e5
    assert patience.lost({0: silent}) == []


@pytest.mark.long
def test_a_training_that_hangs_is_killed_and_goes_on_to_the_bit(
    tmp_path: Path, capsys: Capture
) -> None:
    hung, alone = (trainings(tmp_path / name, 2, 60) for name in ("hung", "alone"))
    stopper = threading.Thread(target=stop_once, args=(hung[0].folder,), daemon=True)
    stopper.start()
    status = train_all(hung, Processes(2, ["tests.agents.drift"]), quiet=True, patience=5.0)
    assert status == 0 and not stopper.is_alive()
    said = capsys.readouterr().out
    assert "hung/ppo/run_0: has written nothing for too long" in said
    assert "run_0: its process was ended by SIGKILL; goes on from its last checkpoint" in said
    assert_as_undisturbed(hung, alone)


_context = multiprocessing.get_context("forkserver")


def sweep(all_trainings: Sequence[Training]) -> None:
    raise SystemExit(train_all(all_trainings, Processes(2, ["tests.agents.drift"])))


@pytest.mark.long
@pytest.mark.parametrize(("n", "updates", "kills"), [(4, 300, 3), (8, 500, 20)])
def test_runs_are_those_of_an_undisturbed_sweep(
    tmp_path: Path, n: int, updates: int, kills: int
) -> None:
    killed, alone = (trainings(tmp_path / name, n, updates) for name in ("killed", "alone"))

    def start() -> multiprocessing.process.BaseProcess:
        process = _context.Process(target=sweep, args=(killed,))
        process.start()
        return process

    done = kill_some(tmp_path / "killed", start, kills, seed=0)
    print(f"kills: {done}")
    assert_as_undisturbed(killed, alone)
