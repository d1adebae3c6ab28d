"""Measuring several things side by side, so that a drift of the machine hits them all equally.

Time is the CPU time of the process: who else uses the machine takes from its caches and memory, but
waiting for others does not count.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Contestant", "Result", "race"]


@dataclass(frozen=True)
class Contestant:
    """Something that can be done again and again.

    Attributes:
        name: what it is: a row of the report.
        column: in which form: a column of the report.
        burst: does it a number of times; returns the number of environment steps taken.
        clock: the time that counts [s]; CPU time is of no use where there are several threads.
    """

    name: str
    column: str
    burst: Callable[[int], int]
    clock: Callable[[], float] = time.process_time


@dataclass
class Result:
    """Steps per second of one contestant, one sample for every round."""

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

    def ratio(self, other: "Result") -> npt.NDArray[Any]:
        """This over another, round by round: shape (rounds,)."""
        return np.divide(self.samples, other.samples)


def race(
    contestants: Sequence[Contestant],
    rounds: int,
    seconds: float,
    progress: Callable[[int], None] = lambda _: None,
) -> list[Result]:
    """Let every contestant take its turn in every round, in an order drawn anew each time.

    Args:
        contestants: who takes part.
        rounds: samples for each of them.
        seconds: aimed length of a turn [s]; one burst is the least.
        progress: told the number of rounds done.

    Returns:
        One result for each contestant, in their order; sample k of all is of the same round.
    """
    times = [_bursts_in(contestant, seconds) for contestant in contestants]
    results = [Result(contestant.name, contestant.column) for contestant in contestants]
    shuffle = np.random.default_rng(0)
    for done in range(rounds):
        progress(done)
        speeds = np.empty(len(contestants))
        for k in shuffle.permutation(len(contestants)):
            speeds[k] = _speed(contestants[k], times[k])[0]
        for result, speed in zip(results, speeds.tolist(), strict=True):
            result.samples.append(speed)
    progress(rounds)
    return results


def _bursts_in(contestant: Contestant, seconds: float) -> int:
    """How many bursts last about that long; compiles and warms up on the way."""
    contestant.burst(1)
    times = 1
    while (took := _speed(contestant, times)[1]) < 0.3 * seconds:
        times *= 4
    return max(1, round(times * seconds / took))


def _speed(contestant: Contestant, times: int) -> tuple[float, float]:
    """Steps per second, and seconds."""
    start = contestant.clock()
    steps = contestant.burst(times)
    took = contestant.clock() - start
    return steps / took, took
