"""Interleaved timing: all workloads run in every round, so that drifts of the machine hit all.

Time is the CPU time of the process: other programs take from its caches and memory, but waiting
for them does not count.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Throughput", "Workload", "time_interleaved"]


@dataclass(frozen=True)
class Workload:
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


@dataclass
class Throughput:
    """Steps per second of one workload.

    Attributes:
        name: that of the workload.
        column: that of the workload.
        samples: one for every round [1/s].
    """

    name: str
    column: str
    samples: list[float] = field(default_factory=list)

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
    throughputs = [Throughput(workload.name, workload.column) for workload in workloads]
    shuffle = np.random.default_rng(0)
    for done in range(rounds):
        progress(done)
        speeds = np.empty(len(workloads))
        for k in shuffle.permutation(len(workloads)):
            speeds[k] = _speed(workloads[k], repeats[k])[0]
        for throughput, speed in zip(throughputs, speeds.tolist(), strict=True):
            throughput.samples.append(speed)
    progress(rounds)
    return throughputs


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
