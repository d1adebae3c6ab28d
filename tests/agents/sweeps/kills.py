"""Sweeps whose processes are killed at random, and what must not have changed by it."""

import json
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import tests.agents.drift  # noqa: F401, registers the environment
from agents.sweeps.sweep import Training
from rigid_envs.scores.records import read_record
from tests.agents.sessions import assert_same_files, small


def trainings(folder: Path, n: int, updates: int) -> list[Training]:
    """So many runs, each with a seed of its own."""
    return [
        Training(
            small(folder, run_name=f"run_{k}", seed=k, total_timesteps=512 * updates),
            folder / "records",
            20,
        )
        for k in range(n)
    ]


def worker(run: Path) -> int | None:
    """The process that works in a run, or did."""
    try:
        return int(json.loads((run / "run.lock").read_bytes())["pid"])
    except (OSError, ValueError):
        return None


def workers(folder: Path) -> list[int]:
    """The processes that train now."""
    pids = [worker(lock.parent) for lock in folder.glob("ppo/*/run.lock")]
    return [pid for pid in pids if pid is not None and _trains(pid)]


def stop_once(run: Path) -> None:
    """Stop, by SIGSTOP, the process that trains there, when it has a checkpoint."""
    while not list(run.glob("checkpoints/*.safetensors")):
        time.sleep(0.05)
    pid = worker(run)
    assert pid is not None
    os.kill(pid, signal.SIGSTOP)


def _trains(pid: int) -> bool:
    try:
        return "State:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


def kill_some(
    folder: Path,
    start: Callable[[], Any],
    kills: int,
    seed: int,
    others: Callable[[np.random.Generator], bool] = lambda rng: False,
) -> dict[str, int]:
    """Run a sweep, and kill its workers and itself at random until it is through.

    Args:
        folder: Of its runs.
        start: Starts the sweep, as a process.
        kills: How many.
        seed: Of the moments and victims.
        others: Kills something else instead, sometimes; whether it did.

    Returns:
        Kills of each kind.
    """
    rng, done = np.random.default_rng(seed), {"worker": 0, "sweep": 0, "other": 0}
    sweep = start()
    while sum(done.values()) < kills:
        time.sleep(float(rng.uniform(0.1, 1.5)))
        assert sweep.exitcode is None, f"the sweep ended after {done} with {sweep.exitcode}"
        found = workers(folder)
        if others(rng):
            done["other"] += 1
        elif rng.random() < 0.3:
            sweep.kill()
            sweep.join()
            done["sweep"] += 1
            sweep = start()
        elif found:
            os.kill(int(rng.choice(found)), signal.SIGKILL)
            done["worker"] += 1
    sweep.join(600)
    assert sweep.exitcode == 0
    return done


def assert_as_undisturbed(killed: list[Training], alone: list[Training]) -> None:
    """Each run and record of a sweep is, to the bit, what the same training gives alone.

    Args:
        killed: Trainings of the sweep.
        alone: The same in another folder, not yet trained.
    """
    for training, other in zip(killed, alone, strict=True):
        assert other.run() is None
        assert_same_files(training.folder, other.folder)
        record, undisturbed = read_record(training.file), read_record(other.file)
        assert record.policy_sha256 == undisturbed.policy_sha256
        assert (record.config, record.curve) == (undisturbed.config, undisturbed.curve)
        np.testing.assert_array_equal(record.costs, undisturbed.costs)
        np.testing.assert_array_equal(record.successes, undisturbed.successes)
