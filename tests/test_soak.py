"""Nothing grows while environments are made, used and dropped."""

import copy
import gc
import pickle
import time
from pathlib import Path
from typing import NamedTuple

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import actions

IDS = list(ENVIRONMENTS)
ROWS = 130


class Usage(NamedTuple):
    """Threads, open files and resident memory [MiB] of a process."""

    threads: int
    files: int
    memory: float


def usage():
    """Of this process; threads of the system, not only those that Python has started."""
    process = Path("/proc/self")
    status = (process / "status").read_text().split()
    memory = int(status[status.index("VmRSS:") + 1]) / 1024.0
    threads = int(status[status.index("Threads:") + 1])
    return Usage(threads, len(list((process / "fd").iterdir())), memory)


def cycle(k):
    """Environments of one id, single and vector; every other time they are not closed."""
    env_id = IDS[k % len(IDS)]
    batches = actions(env_id, 3, ROWS, seed=k)
    for mode in ("NextStep", "SameStep"):
        envs = gym.make_vec(env_id, ROWS, num_threads=2, autoreset_mode=mode)
        envs.reset(seed=k)
        for batch in batches:
            envs.step(batch)
        state = envs.unwrapped.get_state()
        envs.unwrapped.set_state(state)
        if k % 2:
            envs.close()
    env = gym.make(env_id)
    env.reset(seed=k)
    env.step(batches[0][0])
    for other in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        other.reset(seed=k)
        other.step(batches[1][0])
    with pytest.raises(ValueError):
        env.reset(options={"state": np.nan})
    if k % 2:
        env.close()


def after(n_rounds):
    """What is used after some rounds through a few ids."""
    for _ in range(n_rounds):
        for k in range(0, len(IDS), 5):
            cycle(k)
    gc.collect()
    return usage()


def no_more_threads_than(most):
    """Whether no more are left soon: those of a dropped environment end by themselves."""
    end = time.monotonic() + 30.0
    while (found := usage().threads) > most and time.monotonic() < end:
        time.sleep(0.01)
    return found <= most


@pytest.mark.parametrize(
    ("before", "n_rounds", "most"),
    [
        pytest.param(
            10, 60, 3.0, marks=(pytest.mark.long, pytest.mark.push)
        ),  # [MiB]; 600 environments dropped, of 0.2 MiB each
        pytest.param(10_000, 30_000, 1.0, marks=pytest.mark.long),  # about an hour
    ],
)
def test_threads_and_files_do_not_grow_and_memory_hardly_does(before, n_rounds, most):
    first = after(before)  # compiles, and fills caches
    last = after(n_rounds)
    assert no_more_threads_than(first.threads)
    assert last.files <= first.files
    assert last.memory - first.memory < most
