"""The speed and accuracy that this project holds itself to.

    python -m tests.benchmarks.targets [--quick]

Runs the benchmark, the comparisons with C and with PufferLib's drone, and sets each figure beside
its target; the status is 1 if one is missed. Needs gcc, and downloads PufferLib's source package.
"""

import argparse
import sys
from dataclasses import dataclass

from rigid_envs.envs.lookup import one_of_each
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.bench import bench
from rigid_envs.tools.bench.measuring import FORMS
from rigid_envs.tools.cli.words import tell
from rigid_envs.tools.pages.tables import table
from tests.benchmarks.kernel_vs_c import compare
from tests.benchmarks.pufferlib_drone import DRONE
from tests.benchmarks.pufferlib_drone import compare as compare_with_drones

_ROWS = "CartPole-v1, NumPy"
_SPEED = {
    ("IntermediateAxis-v0", "single, made", "CartPole-v1"): 4.5,
    ("IntermediateAxis-v0", "single, bare", "CartPole-v1"): 7.0,
    ("IntermediateAxis-v0", "N = 16", _ROWS): 14.0,
    ("IntermediateAxis-v0", "N = 256", _ROWS): 6.0,
    ("IntermediateAxis-v0", "N = 16, infos on request", _ROWS): 14.0,
    ("IntermediateAxis-v0", "N = 256, infos on request", _ROWS): 6.0,
    ("IntermediateAxis-v0", "N = 4096", _ROWS): 1.8,
    ("BallPark-v0", "N = 4096", _ROWS): 1.5,
    ("SleepingTop-v0", "N = 4096", _ROWS): 1.0,
    ("IntermediateAxis-v0", "N = 256", DRONE): 1.25,
}
_AGAINST_ONE_THREAD = 1.6
_AGAINST_MUJOCO = 900.0
_AGAINST_MEDIAN = 3.0
_OVER_C = 1.2
_WARM, _COLD = 1.0, 4.0  # [s]
MINUTE = {"omega_end": 2e-9}
SIX_THOUSAND_SECONDS = {"L_squared": 2e-13, "energy": 2e-9, "omega_end": 2e-7}
"""Largest errors of a torque-free run in steps of 0.05 s, see `FreeRun`."""


@dataclass(frozen=True)
class Target:
    """A figure and what it has to reach.

    Attributes:
        text: name of the figure.
        value: its measured value.
        limit: what it has to reach.
        at_least: whether the limit is a lower one.
    """

    text: str
    value: float
    limit: float
    at_least: bool = False

    @property
    def is_met(self):
        """Whether the limit is reached."""
        return self.value >= self.limit if self.at_least else self.value <= self.limit


def targets(figures):
    """Every target that the figures say something about."""
    minute, long = figures.runs
    return [
        *map(_speed, figures.ratios),
        *_dearest(figures.costs),
        *_errors(long, SIX_THOUSAND_SECONDS),
        *_errors(minute, MINUTE),
        *_startups(figures.startups),
    ]


def _speed(ratio):
    other = _AGAINST_ONE_THREAD if ratio.peer == ratio.name else _AGAINST_MUJOCO
    limit = _SPEED.get((ratio.name, ratio.form, ratio.peer), other)
    text = f"{ratio.name}, {ratio.form}, against {ratio.peer}"
    return Target(text, ratio.median, limit, at_least=True)


def over_c(loops):
    """The kernels' loop over the faster one in C, of a system."""
    ratio = 1.0 / min(loop.ratio for loop in loops[1:])
    return Target("kernels of the free body, time over that of C", ratio, _OVER_C)


def _dearest(costs):
    """The dearest environment in every form, against the median of all."""
    dearest = [
        max((cost for cost in costs if cost.column == column), key=lambda cost: cost.ratio)
        for column in dict.fromkeys(cost.column for cost in costs)
    ]
    return [
        Target(f"dearest {FORMS[cost.column]} ({cost.name})", cost.ratio, _AGAINST_MEDIAN)
        for cost in dearest
    ]


def _errors(run, limits):
    return [
        Target(f"{name} of a free body, {run.duration:g} s", getattr(run, name), limit)
        for name, limit in limits.items()
    ]


def _startups(startups):
    cold, warm = (max(startup.medians[k] for startup in startups) for k in (0, 1))
    return [
        Target("import to first step, compiled before [s]", warm, _WARM),
        Target("import to first step, empty cache [s]", cold, _COLD),
    ]


def main():
    """Measure, and print the targets."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("--quick", action="store_true", help="a first look, a minute")
    quick = parser.parse_args().quick
    rounds = 20 if quick else 200
    found = [
        *targets(bench(list(ENVIRONMENTS), one_of_each(), quick, tell)),
        over_c(compare(rounds)["free body"]),
        _speed(compare_with_drones(rounds)),
    ]
    rows = [
        (
            target.text,
            f"{target.value:.3g}",
            f"{'>=' if target.at_least else '<='} {target.limit:g}",
            "met" if target.is_met else "missed",
        )
        for target in found
    ]
    print(table(("figure", "measured", "target", ""), rows, "<>>", indent=0))
    return 0 if all(target.is_met for target in found) else 1


if __name__ == "__main__":
    sys.exit(main())
