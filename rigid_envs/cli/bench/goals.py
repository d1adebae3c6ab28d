"""What the speed and accuracy of this package have to be, and what a run of the bench found."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigid_envs.cli.bench.accuracy import FreeRun
from rigid_envs.cli.bench.costs import FORMS, Cost
from rigid_envs.cli.bench.mujoco_body import Opponent
from rigid_envs.cli.bench.race import Result
from rigid_envs.cli.bench.startup import Startup

__all__ = ["FLAGSHIP", "Goal", "goals"]

FLAGSHIP = "IntermediateAxis-v0"
"""The free body: the environment that the ratios are about."""

_RATIOS = (
    ("single, made", "made", "CartPole-v1", 4.5),
    ("single, bare", "bare", "CartPole-v1", 7.0),
    ("N = 16", "16", "CartPole-v1, NumPy", 14.0),
    ("N = 256", "256", "CartPole-v1, NumPy", 5.0),
    ("N = 4096", "4096", "CartPole-v1, NumPy", 1.6),
)
_AGAINST_MUJOCO = 900.0
_AGAINST_MEDIAN = 3.0
_WARM, _COLD = 1.0, 5.0  # [s]


@dataclass(frozen=True)
class Goal:
    """One figure with its target.

    Attributes:
        text: what was measured.
        value: the figure.
        target: what it has to reach.
        at_least: whether it has to be at least the target, or else at most.
        unit: of both.
        quartiles: of the figure over the rounds, where it has any.
    """

    text: str
    value: float
    target: float
    at_least: bool
    unit: str
    quartiles: tuple[float, float] | None = None

    @property
    def is_met(self) -> bool:
        """Whether the target is reached."""
        return self.value >= self.target if self.at_least else self.value <= self.target


def goals(
    results: Sequence[Result],
    opponents: Sequence[Opponent],
    costs: Sequence[Cost],
    runs: Sequence[FreeRun],
    startups: Sequence[Startup],
) -> list[Goal]:
    """Every goal that the figures at hand say something about."""
    return [
        *_ratios(results, opponents),
        *_costs(costs),
        *_accuracy(runs),
        *_startups(startups),
    ]


def _ratios(results: Sequence[Result], opponents: Sequence[Opponent]) -> list[Goal]:
    rivals = [
        (f"{what}, against {rival}", column, rival, least) for what, column, rival, least in _RATIOS
    ]
    exact = [opponent for opponent in opponents if opponent.integrator == "RK4"]
    for opponent in exact[-1:]:  # the one that holds our error for longest
        text = f"N = 4096, against {opponent.name}, equal error"
        rivals.append((text, "4096", opponent.name, _AGAINST_MUJOCO))
    found = {(result.name, result.column): result for result in results}
    made = []
    for text, column, rival, least in rivals:
        ours, theirs = found.get((FLAGSHIP, column)), found.get((rival, column))
        if ours and theirs:
            made.append(_ratio(text, ours, theirs, least))
    return made


def _costs(costs: Sequence[Cost]) -> list[Goal]:
    """The dearest environment in every form."""
    dearest = [
        max((cost for cost in costs if cost.column == column), key=lambda cost: cost.ratio)
        for column in dict.fromkeys(cost.column for cost in costs)
    ]
    return [
        Goal(
            f"dearest {FORMS[cost.column]} ({cost.name}) against the median",
            *(cost.ratio, _AGAINST_MEDIAN, False, "x", cost.quartiles),
        )
        for cost in dearest
    ]


def _ratio(text: str, ours: Result, theirs: Result, least: float) -> Goal:
    low, middle, high = np.percentile(ours.ratio(theirs), (25, 50, 75)).tolist()
    return Goal(text, middle, least, True, "x", (low, high))


def _accuracy(runs: Sequence[FreeRun]) -> list[Goal]:
    minute, long = runs
    return [
        Goal("|L|^2 of a free body, dt 0.05, over 6000 s", long.L_squared, 2e-13, False, "1"),
        Goal("its energy, over 6000 s", long.energy, 2e-9, False, "1"),
        Goal("its omega against the closed form, at 60 s", minute.omega_end, 2e-9, False, "rad/s"),
        Goal("its omega against the closed form, at 6000 s", long.omega_end, 2e-7, False, "rad/s"),
    ]


def _startups(startups: Sequence[Startup]) -> list[Goal]:
    cold, warm = (max(s.medians[k] for s in startups) for k in (0, 1))
    return [
        Goal("import to first step, compiled before", warm, _WARM, False, "s"),
        Goal("import to first step, empty cache", cold, _COLD, False, "s"),
    ]
