"""Time of an action: compiled policy beside the same one in torch, in one interleaved run.

Run as a program: ``python -m tests.benchmarks.policy_speed [NAME]``. Prints the least time of one
call of `predict`, for one observation and for 500 together, on one thread.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from agents.policies import load_policy
from rigid_envs import load
from rigid_envs.scores.trained import FOLDER, StoredPolicy

CALLS, ROUNDS = 50, 100


def seconds(call: Callable[[], object]) -> float:
    """Time of one call."""
    begin = time.perf_counter()
    for _ in range(CALLS):
        call()
    return (time.perf_counter() - begin) / CALLS


def times(policy: StoredPolicy, other: StoredPolicy, rows: int) -> tuple[float, float]:
    """Least times of both [s], taken in turns: what else runs on the machine only adds to them."""
    obs = np.random.default_rng(0).normal(size=(rows, policy.n_obs)).astype(np.float32)
    obs = obs[0] if rows == 1 else obs
    policies = (policy, other)
    each = [[seconds(lambda p=p: p.predict(obs)) for p in policies] for _ in range(ROUNDS)]
    one, two = (min(column) for column in zip(*each, strict=True))
    return one, two


def main(path: Path) -> None:
    """Print the table."""
    torch.set_num_threads(1)
    compiled, plain = load(path), load_policy(path)
    print("observations   compiled      torch   ratio")
    for rows in (1, 500):
        one, two = times(compiled, plain, rows)
        print(f"{rows:12}{1e6 * one:8.1f} us{1e6 * two:8.1f} us{two / one:8.1f}")


if __name__ == "__main__":
    main(FOLDER / f"{(sys.argv[1:] or ['BallPark-v0'])[0]}.safetensors")
