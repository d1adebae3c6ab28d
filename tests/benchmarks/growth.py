"""How the time of a row grows: with the number of rows, and with options; all take turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_envs.tools.bench.measuring import Workload, staggered, time_interleaved, vector_workload

IDS = ("IntermediateAxis", "BallPark")
SIZES = (1, 16, 256, 4096, 2**16, 2**20)
OPTIONS = {
    "none": {},
    "action noise": {"action_noise": 0.1},
    "observation noise": {"observation_noise": 0.1},
    "delay of 3 periods": {"action_delay": 3},
    "random radius": {"radius": (0.8, 1.2)},
    "random radius, observed": {"radius": (0.8, 1.2), "observe_params": True},
    "attitude as Euler angles": {"rotation": "euler"},
    "attitude as a matrix": {"rotation": "matrix"},
}
"""Of `BallPark`, 4096 rows."""

_TURN = 0.02  # [s]


@dataclass(frozen=True)
class Growth:
    """Time of a row in one of several forms.

    Attributes:
        name: of the environment.
        form: number of rows, or options.
        nanoseconds: median.
        ratio: to the time in the first form, median over the rounds.
        quartiles: first and third.
    """

    name: str
    form: str
    nanoseconds: float
    ratio: float
    quartiles: tuple[float, float]


def by_size(rounds):
    """Every id with every number of rows, against one row.

    Args:
        rounds: of interleaved timing.
    """
    return [
        growth
        for name in IDS
        for growth in _measured(name, {f"{n}": (n, {}) for n in SIZES}, rounds)
    ]


def by_option(rounds):
    """`BallPark` with options, against none.

    Args:
        rounds: of interleaved timing.
    """
    return _measured("BallPark", {text: (4096, given) for text, given in OPTIONS.items()}, rounds)


def _measured(name, forms, rounds):
    workloads = [
        Workload(name, form, vector_workload(staggered(f"RigidEnvs/{name}-v0", n, 1, **given)))
        for form, (n, given) in forms.items()
    ]
    rates = np.array([result.samples for result in time_interleaved(workloads, rounds, _TURN)])
    return growth_of(name, forms, 1e9 / rates)


def growth_of(name, forms, nanoseconds):
    """Every form against the first.

    Args:
        name: of the environment.
        forms: number of rows, or options.
        nanoseconds: time of a row of every form in every round, shape (forms, rounds).
    """
    found = []
    for form, times in zip(forms, nanoseconds, strict=True):
        low, ratio, high = np.percentile(times / nanoseconds[0], (25, 50, 75)).tolist()
        found.append(Growth(name, form, float(np.median(times)), ratio, (low, high)))
    return found
