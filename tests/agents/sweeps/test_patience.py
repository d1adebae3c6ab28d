"""Sweeps go on to the bit where processes or nodes die or hang; a training that works is let be."""

import json
import multiprocessing
import os
import signal
import threading
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.sweeps import sweep as module
from agents.sweeps.sweep import PATIENCE, Patience, Processes, Training, train_all
from rigid_envs.scores.records import read_record
from tests.agents.sessions import assert_same_files, small, wait_for


def trainings(folder, n, updates):
    """So many runs, each with a seed of its own."""
    return [
        Training(
            small(folder, run_name=f"run_{k}", seed=k, total_timesteps=512 * updates),
            folder / "records",
            20,
        )
        for k in range(n)
    ]


def worker(run):
    """The process that works in a run, or did."""
    try:
        return int(json.loads((run / "run.lock").read_bytes())["pid"])
    except (OSError, ValueError):
        return None


def workers(folder):
    """The processes that train now."""
    pids = [worker(lock.parent) for lock in folder.glob("ppo/*/run.lock")]
    return [pid for pid in pids if pid is not None and _trains(pid)]


def stop_once(run):
    """Stop, by SIGSTOP, the process that trains there, when it has a checkpoint."""
    wait_for(lambda: list(run.glob("checkpoints/*.safetensors")))
    os.kill(worker(run), signal.SIGSTOP)


def _trains(pid):
    try:
        return "State:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


def kill_some(folder, start, kills, seed, others):
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


def assert_as_undisturbed(killed, alone):
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


class Watched:
    """A training that writes when it is told to."""

    sign, used = 0.0, True

    def last_sign(self):
        return self.sign

    def is_in_use(self):
        return self.used


@pytest.fixture
def clock(monkeypatch):
    """Time that goes on when it is told to."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(module, "monotonic", lambda: clock.now)
    return clock


def looks(patience, clock, running, n):
    """What it says, each second."""
    found = []
    for _ in range(n):
        clock.now += 1.0
        found.append(patience.lost(running))
    return found


def test_one_that_writes_nothing_is_lost_and_is_counted_anew(clock):
    silent, busy = Watched(), Watched()
    patience, said = Patience(10.0), []
    for _ in range(30):
        busy.sign += 1.0
        said += looks(patience, clock, {3: silent, 5: busy}, 1)
    # the first look only takes note; the eleventh after it is later than 10 s
    assert [k for k, numbers in enumerate(said) if numbers] == [11, 22]
    assert said[11] == said[22] == [3]


def test_one_that_waits_in_a_queue_is_not_lost(clock):
    queued = Watched()
    queued.used = False
    assert not any(looks(Patience(10.0), clock, {0: queued}, 100))


def test_one_that_began_again_is_counted_anew(clock):
    patience, silent = Patience(10.0), Watched()
    assert not any(looks(patience, clock, {0: silent}, 10))
    assert not any(looks(patience, clock, {}, 1))
    assert not any(looks(patience, clock, {0: silent}, 11))


def test_time_in_which_the_sweep_was_stopped_too_does_not_count(clock):
    patience, silent = Patience(10.0), Watched()
    looks(patience, clock, {0: silent}, 2)
    clock.now += 1e5
    assert patience.lost({0: silent}) == []


_context = multiprocessing.get_context("spawn")


@pytest.fixture(params=["processes", "ray"])
def cluster(request):
    """Two nodes of Ray on this machine, of which the second can be killed, or none."""
    if request.param == "processes":
        yield None
        return
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    yield cluster
    cluster.shutdown()


def sweep(address, all_trainings, patience):
    """On Ray where there is an address."""
    from agents.sweeps.cluster import RayTasks

    drift = ["tests.agents.drift"]
    workers = RayTasks(address, drift) if address else Processes(2, drift)
    raise SystemExit(train_all(all_trainings, workers, patience=patience))


def started(cluster, all_trainings, patience=PATIENCE):
    """A sweep in a process of its own."""
    address = cluster.address if cluster else ""
    process = _context.Process(target=sweep, args=(address, all_trainings, patience))
    process.start()
    return process


@pytest.mark.long
def test_a_training_that_hangs_is_killed_and_goes_on_to_the_bit(tmp_path, cluster, capfd):
    hung, alone = (trainings(tmp_path / name, 2, 60) for name in ("hung", "alone"))
    stopper = threading.Thread(target=stop_once, args=(hung[0].folder,), daemon=True)
    stopper.start()
    process = started(cluster, hung, patience=10.0)
    process.join(300)
    assert process.exitcode == 0 and not stopper.is_alive()
    said = capfd.readouterr().out
    assert "hung/ppo/run_0: has written nothing for too long" in said
    assert cluster or "SIGKILL; goes on from its last checkpoint" in said
    assert_as_undisturbed(hung, alone)


@pytest.mark.long
@pytest.mark.parametrize(("n", "updates", "kills"), [(4, 300, 3), (8, 500, 20)])
def test_runs_are_those_of_an_undisturbed_sweep(tmp_path, cluster, n, updates, kills):
    killed, alone = (trainings(tmp_path / name, n, updates) for name in ("killed", "alone"))
    second = [cluster.add_node(num_cpus=1)] if cluster else []

    def kill_node(rng):
        if not second or rng.random() < 0.7:
            return False
        cluster.remove_node(second.pop(), allow_graceful=False)
        second.append(cluster.add_node(num_cpus=1))
        return True

    begin = partial(started, cluster, killed)
    done = kill_some(tmp_path / "killed", begin, kills, seed=0, others=kill_node)
    print(f"kills: {done}")
    assert_as_undisturbed(killed, alone)
