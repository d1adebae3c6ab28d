"""Training sessions in processes of their own, which tests can kill.

Forked from a server that has imported torch and SB3 once: a session starts in a moment.
"""

import csv
import multiprocessing
import multiprocessing.forkserver
import sys
import time
import traceback

import numpy as np

from agents.config.entries import config_from
from agents.storage.runs import create_run

SMALL = {
    "env_id": "Drift-v0",
    "n_envs": 16,
    "n_steps": 32,
    "batch_size": 128,
    "n_epochs": 2,
    "learning_rate": [1e-3, 0.0],
    "net_arch": [16],
    "total_timesteps": 512 * 40,
    "eval_every": 2500,
    "eval_episodes": 8,
    "checkpoint_every": 3,
}
"""A run of 40 updates in about a second."""


def small(folder, **entries):
    """The config of a small run in a folder, with these entries."""
    return config_from({**SMALL, "log_dir": str(folder), "run_name": "r", **entries})


def begun(config):
    """A run that was begun, and left before its first step."""
    run = create_run(config)
    run.begin()
    run.close()
    return run


_context = multiprocessing.get_context("forkserver")
multiprocessing.forkserver.set_forkserver_preload(["tests.agents.preloaded"])


SAME = (
    "progress.csv",
    "monitor.csv",
    "last_model/policy.safetensors",
    "last_model/policy.json",
    "best_model/policy.safetensors",
)
"""Files of a run that have the same bytes however often it was killed."""


def assert_same_files(run, other):
    """What two runs have logged, learnt and found is the same, to the bit."""
    for name in SAME:
        assert (run / name).read_bytes() == (other / name).read_bytes(), run / name
    with np.load(run / "evaluations.npz") as a, np.load(other / "evaluations.npz") as b:
        assert a.files == b.files
        for key in a.files:
            np.testing.assert_array_equal(a[key], b[key])


def rows(path):
    """What a run has logged in a file."""
    with path.open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def start(values, resume=None):
    """Begin a session: a new run of these config entries, or an old one."""
    process = _context.Process(target=_session, args=(values, resume))
    process.start()
    return process


def start_writer(path, size):
    """Begin to write a file of so many numbers, over and over."""
    process = _context.Process(target=_write, args=(path, size))
    process.start()
    return process


def finish(process, timeout=60):
    """Wait for a session; its exit status, negative for a signal that killed it."""
    process.join(timeout)
    assert process.exitcode is not None, "the session did not end"
    return process.exitcode


def wait_for(condition):
    """Wait until something is the case, which takes seconds."""
    deadline = time.perf_counter() + 300
    while not condition():
        assert time.perf_counter() < deadline
        time.sleep(0.002)


def _session(values, resume):
    import tests.agents.drift  # noqa: F401, registers the environment
    from agents.training.trainer import train

    try:
        outcome = train(resume or config_from(values or {}), quiet=True)
    except Exception:
        traceback.print_exc()
        sys.exit(1)
    sys.exit(0 if outcome.stopped_by is None else 128 + outcome.stopped_by)


def _write(path, size):
    from rigid_envs.base.files import save_tensors

    for k in range(10**9):
        save_tensors(path, {"a": np.full(size, k)}, {"k": k})
