"""Workloads, in one interleaved run."""

import time
from collections.abc import Callable, Sequence
from itertools import cycle, islice
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import numpy.typing as npt

from rigid_envs.engine.layout import CLOCK
from rigid_envs.tasks.registry import ENVIRONMENTS

# Interleaved timing: all workloads run in every round, so that drifts of the machine hit all.
#
# Time is the CPU time of the process: other programs take from its caches and memory, but waiting
# for them does not count.


class Workload(NamedTuple):
    """Something that is timed.

    Attributes:
        name: row of the report.
        column: column of the report.
        run: repeats it a number of times; returns the number of environment steps taken.
        clock: seconds; CPU time of the process is wrong where there are several threads.
    """

    name: str
    column: str
    run: Callable[[int], int]
    clock: Callable[[], float] = time.process_time


class Throughput(NamedTuple):
    """Steps per second of one workload.

    Attributes:
        name: that of the workload.
        column: that of the workload.
        samples: one for every round [1/s].
    """

    name: str
    column: str
    samples: list[float]

    @property
    def median(self) -> float:
        """Median over the rounds [1/s]."""
        return float(np.median(self.samples))

    @property
    def quartiles(self) -> tuple[float, float]:
        """First and third quartile over the rounds [1/s]."""
        low, high = np.percentile(self.samples, (25, 75))
        return float(low), float(high)

    def ratio(self, other: "Throughput") -> npt.NDArray[Any]:
        """Ratio of this to the other in each round, shape (rounds,)."""
        return np.divide(self.samples, other.samples)


def time_interleaved(
    workloads: Sequence[Workload],
    rounds: int,
    seconds: float,
    progress: Callable[[int], None] = lambda _: None,
) -> list[Throughput]:
    """Time all workloads once per round, in a new random order in each round.

    Args:
        workloads: what is timed.
        rounds: samples per workload.
        seconds: aimed time of a workload per round [s]; at least one repetition.
        progress: called with the number of rounds done.

    Returns:
        One throughput per workload, in their order; sample k of all is from the same round.
    """
    repeats = [_repeats_in(workload, seconds) for workload in workloads]
    speeds = np.empty((len(workloads), rounds))
    shuffle = np.random.default_rng(0)
    for done in range(rounds):
        progress(done)
        for k in shuffle.permutation(len(workloads)):
            speeds[k, done] = _speed(workloads[k], repeats[k])[0]
    progress(rounds)
    rows = zip(workloads, speeds.tolist(), strict=True)
    return [Throughput(workload.name, workload.column, row) for workload, row in rows]


def _repeats_in(workload: Workload, seconds: float) -> int:
    """Number of repetitions that takes about that long; compiles and warms up as well."""
    workload.run(1)
    repeats = 1
    while (took := _speed(workload, repeats)[1]) < 0.3 * seconds:
        repeats *= 4
    return max(1, round(repeats * seconds / took))


def _speed(workload: Workload, repeats: int) -> tuple[float, float]:
    """Steps per second, and seconds."""
    start = workload.clock()
    steps = workload.run(repeats)
    took = workload.clock() - start
    return steps / took, took


# Environments as workloads: ours, and Gymnasium's CartPole and Pendulum as peers.

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
        for column, n in ON_REQUEST.items() if name == FREE_BODY else ():
            run = vector_workload(staggered(env_id, n, 1, infos_on_request=True))
            workloads.append(Workload(name, column, run))
    return workloads


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


def staggered(env_id: str, n: int, n_threads: int, /, **config: Any) -> Any:
    """A vector environment of n rows whose episodes end in different steps."""
    limit = gymnasium.spec(env_id).max_episode_steps or 1
    config |= {"num_threads": n_threads}
    envs: Any = gymnasium.make_vec(env_id, n, "vector_entry_point", **config)
    envs.reset(seed=0)
    state = envs.get_state()
    state["clock"][:, CLOCK.elapsed] = np.arange(n) * limit // n
    envs.set_state(state)
    return envs


# Time per step of every environment, against the median of all environments.

FORMS = {"bare": "bare step", "4096": "row of 4096"}
"""Forms in which environments are compared, by column of the report."""

_LEAST = 3  # environments below which a median says nothing


class StepTime(NamedTuple):
    """Time of one environment step.

    Attributes:
        name: the environment.
        column: its form, a key of `FORMS`.
        seconds: median over the rounds [s].
        ratio: to the median of all environments in the same round; median over the rounds.
        quartiles: first and third of that ratio, over the rounds.
    """

    name: str
    column: str
    seconds: float
    ratio: float
    quartiles: tuple[float, float]


def costs(speeds: Sequence[Throughput]) -> list[StepTime]:
    """Costs of our environments, in every form that three or more were measured in."""
    found = []
    for column in FORMS:
        ours = [s for s in speeds if s.column == column and f"RigidEnvs/{s.name}" in ENVIRONMENTS]
        if len(ours) >= _LEAST:
            found += _compared(ours)
    return found


def _compared(speeds: Sequence[Throughput]) -> list[StepTime]:
    times = 1.0 / np.array([speed.samples for speed in speeds])
    ratios = times / np.median(times, axis=0)
    made = []
    for speed, spent, ratio in zip(speeds, times, ratios, strict=True):
        low, median, high = np.percentile(ratio, (25, 50, 75)).tolist()
        seconds = float(np.median(spent))
        made.append(StepTime(speed.name, speed.column, seconds, median, (low, high)))
    return made
