"""Environments as workloads: ours, and Gymnasium's CartPole and Pendulum as peers."""

import time
from collections.abc import Callable, Sequence
from itertools import cycle, islice
from typing import Any

import gymnasium
import numpy as np

from rigid_envs.bench.interleaved import Workload
from rigid_envs.kernels.layout import CLOCK

__all__ = [
    "COLUMNS",
    "FREE_BODY",
    "ON_REQUEST",
    "gymnasium_workloads",
    "our_workloads",
    "staggered",
    "vector_workload",
]

COLUMNS = ("made", "bare", "N = 1", "16", "256", "4096", "2 threads")
"""Single as `gymnasium.make` gives it and without its wrappers; N rows; 4096 rows in 2 threads."""

FREE_BODY = "IntermediateAxis-v0"
"""Compared in all forms: MuJoCo can simulate a free body too."""

ON_REQUEST = {"16, infos on request": 16, "256, infos on request": 256}
"""Further forms of `FREE_BODY`, without infos but those that are asked for."""

_ROWS = {"N = 1": 1, "16": 16, "256": 256, "4096": 4096}
_N_ACTIONS = 1 << 12  # actions that are drawn before and used in turn


def our_workloads(ids: Sequence[str]) -> list[Workload]:
    """Every id in all forms of `COLUMNS`."""
    workloads = []
    for env_id in ids:
        name = env_id.removeprefix("RigidEnvs/")
        workloads += _singles(env_id, name)
        for column, n in _ROWS.items():
            workloads.append(Workload(name, column, vector_workload(staggered(env_id, n, 1))))
        pair = vector_workload(staggered(env_id, 4096, 2))
        workloads.append(Workload(name, "2 threads", pair, time.perf_counter))
        if name == FREE_BODY:
            workloads += _on_request(env_id)
    return workloads


def _on_request(env_id: str) -> list[Workload]:
    return [
        Workload(FREE_BODY, column, vector_workload(staggered(env_id, n, 1, infos_on_request=True)))
        for column, n in ON_REQUEST.items()
    ]


def gymnasium_workloads() -> list[Workload]:
    """CartPole and Pendulum, single and in `SyncVectorEnv`; CartPole's NumPy vector environment."""
    workloads = []
    for env_id in ("CartPole-v1", "Pendulum-v1"):
        workloads += _singles(env_id, env_id)
        for column in ("16", "256"):
            sync = gymnasium.make_vec(env_id, _ROWS[column], "sync")
            sync.reset(seed=0)
            workloads.append(Workload(f"{env_id}, sync", column, vector_workload(sync)))
    for column, n in _ROWS.items():
        native = gymnasium.make_vec("CartPole-v1", n, "vector_entry_point")
        native.reset(seed=0)
        workloads.append(Workload("CartPole-v1, NumPy", column, vector_workload(native)))
    return workloads


def _singles(env_id: str, name: str) -> list[Workload]:
    return [
        Workload(name, "made", _single(gymnasium.make(env_id), env_id)),
        Workload(name, "bare", _single(gymnasium.make(env_id).unwrapped, env_id)),
    ]


def _single(env: gymnasium.Env[Any, Any], env_id: str) -> Callable[[int], int]:
    """Runs whole episodes: a reset, then steps up to the end or the time limit."""
    limit = gymnasium.spec(env_id).max_episode_steps
    env.action_space.seed(0)
    actions = cycle([env.action_space.sample() for _ in range(_N_ACTIONS)])
    env.reset(seed=0)

    def run(episodes: int) -> int:
        steps = 0
        for _ in range(episodes):
            env.reset()
            for action in islice(actions, limit):
                _, _, terminated, truncated, _ = env.step(action)
                steps += 1
                if terminated or truncated:
                    break
        return steps

    return run


def vector_workload(envs: Any) -> Callable[[int], int]:
    """Runs steps of all rows; a step in which a row resets itself counts as one."""
    n_rows: int = envs.num_envs
    envs.action_space.seed(0)
    n_batches = max(16, _N_ACTIONS // n_rows)
    actions = cycle([envs.action_space.sample() for _ in range(n_batches)])

    def run(steps: int) -> int:
        for action in islice(actions, steps):
            envs.step(action)
        return steps * n_rows

    return run


def staggered(env_id: str, n: int, n_threads: int, **config: Any) -> Any:
    """A vector environment of n rows whose episodes end in different steps."""
    limit = gymnasium.spec(env_id).max_episode_steps or 1
    config |= {"num_threads": n_threads}
    envs: Any = gymnasium.make_vec(env_id, n, "vector_entry_point", **config)
    envs.reset(seed=0)
    state = envs.get_state()
    state["clock"][:, CLOCK.elapsed] = np.arange(n) * limit // n
    envs.set_state(state)
    return envs
