"""Sweeps whose processes are killed at random lose nothing, to the bit."""

import multiprocessing
from collections.abc import Sequence
from pathlib import Path

import pytest

from agents.sweeps.sweep import Processes, Training, train_all
from tests.agents.sweeps.kills import assert_as_undisturbed, kill_some, trainings

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
