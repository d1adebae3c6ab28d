"""One round of making, using and dropping environments, and what a process uses."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import NamedTuple

import gymnasium as gym
import numpy as np

import rigid_envs
from rigid_envs.testing.environments import actions

IDS = list(rigid_envs.ENVIRONMENTS)
ROWS = 130


class Usage(NamedTuple):
    """Threads, open files and resident memory [MiB] of a process."""

    threads: int
    files: int
    memory: float

    @classmethod
    def of_this_process(cls) -> Usage:
        """Threads of the system, not only those that Python has started."""
        process = Path("/proc/self")
        status = (process / "status").read_text().split()
        memory = int(status[status.index("VmRSS:") + 1]) / 1024.0
        threads = int(status[status.index("Threads:") + 1])
        return cls(threads, len(list((process / "fd").iterdir())), memory)

    def __str__(self) -> str:
        return f"threads {self.threads:3d}  files {self.files:3d}  memory {self.memory:8.1f} MiB"


def cycle(k: int) -> None:
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
    try:
        env.reset(options={"state": np.nan})
    except ValueError:
        pass
    if k % 2:
        env.close()
