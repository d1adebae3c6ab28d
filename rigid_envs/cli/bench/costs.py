"""What a step of every environment costs, beside the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigid_envs import ENVIRONMENTS
from rigid_envs.cli.bench.race import Result

__all__ = ["FORMS", "Cost", "costs"]

FORMS = {"bare": "bare step", "4096": "row of 4096"}
"""The columns of the race in which environments are compared, and what they measure."""

_LEAST = 3  # environments that have a median worth the name


@dataclass(frozen=True)
class Cost:
    """Time of one environment step.

    Attributes:
        name: of which environment.
        column: in which form.
        seconds: median over the rounds [s].
        ratio: to the median of all environments in the same round, median over the rounds.
        quartiles: of that ratio.
    """

    name: str
    column: str
    seconds: float
    ratio: float
    quartiles: tuple[float, float]


def costs(results: Sequence[Result]) -> list[Cost]:
    """Costs of our environments in every form, if there are enough to compare."""
    found = []
    for column in FORMS:
        ours = [r for r in results if r.column == column and f"RigidEnvs/{r.name}" in ENVIRONMENTS]
        if len(ours) >= _LEAST:
            found += _compared(ours)
    return found


def _compared(results: Sequence[Result]) -> list[Cost]:
    times = 1.0 / np.array([result.samples for result in results])
    ratios = times / np.median(times, axis=0)
    made = []
    for result, time, ratio in zip(results, times, ratios, strict=True):
        low, middle, high = np.percentile(ratio, (25, 50, 75)).tolist()
        seconds = float(np.median(time))
        made.append(Cost(result.name, result.column, seconds, middle, (low, high)))
    return made
