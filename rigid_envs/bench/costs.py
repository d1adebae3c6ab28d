"""Time per step of every environment, against the median of all environments."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigid_envs import ENVIRONMENTS
from rigid_envs.bench.interleaved import Throughput

__all__ = ["FORMS", "Cost", "costs"]

FORMS = {"bare": "bare step", "4096": "row of 4096"}
"""Forms in which environments are compared, by column of the report."""

_LEAST = 3  # environments below which a median says nothing


@dataclass(frozen=True)
class Cost:
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


def costs(speeds: Sequence[Throughput]) -> list[Cost]:
    """Costs of our environments, in every form that three or more were measured in."""
    found = []
    for column in FORMS:
        ours = [s for s in speeds if s.column == column and f"RigidEnvs/{s.name}" in ENVIRONMENTS]
        if len(ours) >= _LEAST:
            found += _compared(ours)
    return found


def _compared(speeds: Sequence[Throughput]) -> list[Cost]:
    times = 1.0 / np.array([speed.samples for speed in speeds])
    ratios = times / np.median(times, axis=0)
    made = []
    for speed, time, ratio in zip(speeds, times, ratios, strict=True):
        low, median, high = np.percentile(ratio, (25, 50, 75)).tolist()
        seconds = float(np.median(time))
        made.append(Cost(speed.name, speed.column, seconds, median, (low, high)))
    return made
