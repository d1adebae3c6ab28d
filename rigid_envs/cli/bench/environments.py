"""The environments in the race: ours, and those of Gymnasium beside them."""

import time
from collections.abc import Callable, Sequence
from itertools import cycle, islice
from typing import Any

import gymnasium
import numpy as np

from rigid_envs.cli.bench.race import Contestant
from rigid_envs.kernels.layout import CLOCK

__all__ = ["COLUMNS", "gymnasium_contestants", "our_contestants", "staggered"]

COLUMNS = ("made", "bare", "N = 1", "16", "256", "4096", "2 threads")
"""Single as `gymnasium.make` gives it and without its wrappers; N rows; 4096 rows in 2 threads."""

_ROWS = {"N = 1": 1, "16": 16, "256": 256, "4096": 4096}
_N_ACTIONS = 1 << 12  # entries of the bank that actions are taken from in turn
_NATIVE = {"vectorization_mode": "vector_entry_point"}


def our_contestants(ids: Sequence[str]) -> list[Contestant]:
    """Every id single, and native with 1 to 4096 rows."""
    contestants = []
    for env_id in ids:
        name = env_id.removeprefix("RigidEnvs/")
        contestants += _singles(env_id, name)
        for column, n in _ROWS.items():
            contestants.append(Contestant(name, column, _vector(staggered(env_id, n, 1))))
        pair = _vector(staggered(env_id, 4096, 2))
        contestants.append(Contestant(name, "2 threads", pair, time.perf_counter))
    return contestants


def gymnasium_contestants() -> list[Contestant]:
    """CartPole (single, synchronous, its NumPy vector environment) and Pendulum."""
    contestants = []
    for env_id in ("CartPole-v1", "Pendulum-v1"):
        contestants += _singles(env_id, env_id)
        for column in ("16", "256"):
            sync = gymnasium.make_vec(env_id, _ROWS[column], "sync")
            sync.reset(seed=0)
            contestants.append(Contestant(f"{env_id}, sync", column, _vector(sync)))
    for column, n in _ROWS.items():
        native = gymnasium.make_vec("CartPole-v1", n, "vector_entry_point")
        native.reset(seed=0)
        contestants.append(Contestant("CartPole-v1, NumPy", column, _vector(native)))
    return contestants


def _singles(env_id: str, name: str) -> list[Contestant]:
    return [
        Contestant(name, "made", _single(gymnasium.make(env_id), env_id)),
        Contestant(name, "bare", _single(gymnasium.make(env_id).unwrapped, env_id)),
    ]


def _single(env: gymnasium.Env[Any, Any], env_id: str) -> Callable[[int], int]:
    """Whole episodes, each begun with a reset, ended by the environment or its time limit."""
    limit = gymnasium.spec(env_id).max_episode_steps
    env.action_space.seed(0)
    actions = cycle([env.action_space.sample() for _ in range(_N_ACTIONS)])
    env.reset(seed=0)

    def burst(episodes: int) -> int:
        steps = 0
        for _ in range(episodes):
            env.reset()
            for action in islice(actions, limit):
                _, _, terminated, truncated, _ = env.step(action)
                steps += 1
                if terminated or truncated:
                    break
        return steps

    return burst


def _vector(envs: Any) -> Callable[[int], int]:
    """Steps of all rows; they reset themselves, and a step that resets a row counts as a step."""
    n_rows: int = envs.num_envs
    envs.action_space.seed(0)
    n_batches = max(16, _N_ACTIONS // n_rows)
    actions = cycle([envs.action_space.sample() for _ in range(n_batches)])

    def burst(steps: int) -> int:
        for action in islice(actions, steps):
            envs.step(action)
        return steps * n_rows

    return burst


def staggered(env_id: str, n: int, n_threads: int) -> Any:
    """Rows whose episodes end in turn, not all in the same step."""
    limit = gymnasium.spec(env_id).max_episode_steps or 1
    envs: Any = gymnasium.make_vec(env_id, n, "vector_entry_point", num_threads=n_threads)
    envs.reset(seed=0)
    state = envs.get_state()
    state["clock"][:, CLOCK.elapsed] = np.arange(n) * limit // n
    envs.set_state(state)
    return envs
