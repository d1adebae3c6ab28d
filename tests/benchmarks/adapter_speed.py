"""Time of a step of Stable-Baselines3's rows: the adapter beside their `make_vec_env`.

Run as a program: ``python -m tests.benchmarks.adapter_speed [--rows 256] [ID ...]``. Both step the
same episodes in turns, on one thread, with drawn actions, resets included; the time is the median
over the rounds, the ratio the median of those of each round.
"""

import argparse
import time
from typing import Any

import numpy as np
from stable_baselines3.common.env_util import make_vec_env as their_make_vec_env

from rigid_envs.envs.lookup import checked_id
from rigid_envs.sb3.adapter import make_vec_env

STEPS, ROUNDS = 50, 40
IDS = ("BallPark", "IntermediateAxis", "DiskRollRandom", "BallParkGoal", "BallGrid")


def times(env_id: str, rows: int) -> np.ndarray[Any, Any]:
    """Seconds of a step of all rows, shape (rounds, 2): the adapter, and their function."""
    envs: Any = (make_vec_env(env_id, rows, seed=0), their_make_vec_env(env_id, rows, seed=0))
    space = envs[0].action_space
    space.seed(0)
    actions = np.array([[space.sample() for _ in range(rows)] for _ in range(STEPS)])
    for env in envs:
        env.reset()
        env.step(actions[0])  # compiles what is not compiled
    found = np.empty((ROUNDS, 2))
    for k in range(ROUNDS):
        for side, env in enumerate(envs):
            begin = time.perf_counter()
            for action in actions:
                env.step(action)
            found[k, side] = (time.perf_counter() - begin) / STEPS
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ids", nargs="*", default=IDS, metavar="ID")
    parser.add_argument("--rows", type=int, default=256)
    options = parser.parse_args()
    print(f"{options.rows} rows{'':12}adapter  their rows   ratio")
    for env_id in map(checked_id, options.ids):
        found = times(env_id, options.rows)
        ours, theirs = 1e6 * np.median(found, axis=0)
        ratio = np.median(found[:, 1] / found[:, 0])
        print(f"{env_id.split('/')[1]:18}{ours:6.0f} us{theirs:9.0f} us{ratio:8.1f}")


if __name__ == "__main__":
    main()
