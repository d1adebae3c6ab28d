"""The measurements of `rigid-envs bench`."""

from collections.abc import Sequence

from rigid_envs.catalogue import one_of_each
from rigid_envs.cli.bench.accuracy import free_run
from rigid_envs.cli.bench.costs import costs
from rigid_envs.cli.bench.environments import gymnasium_contestants, our_contestants
from rigid_envs.cli.bench.goals import goals
from rigid_envs.cli.bench.mujoco_body import is_installed, mujoco_contestants, opponents
from rigid_envs.cli.bench.race import race
from rigid_envs.cli.bench.report import Figures
from rigid_envs.cli.bench.startup import startup
from rigid_envs.cli.progress import tell
from rigid_envs.provenance import provenance

__all__ = ["Figures", "bench"]


def bench(ids: Sequence[str], quick: bool = False) -> Figures:
    """Measure speed, accuracy and start-up.

    Args:
        ids: the environments to measure.
        quick: few rounds and one start: a minute, for a first look.
    """
    rounds, seconds = (12, 0.01) if quick else (50, 0.02)
    where = provenance()  # before: the load is that of the others
    tell("accuracy")
    runs = [free_run(0.05, duration) for duration in (60.0, 6000.0)]
    rivals = opponents() if is_installed() else []
    tell("first steps of new processes")
    starts = [startup(i, 1, 1 if quick else 3) for i in (ids[:1] if quick else one_of_each(ids))]
    tell("warming up")
    contestants = [*our_contestants(ids), *gymnasium_contestants(), *mujoco_contestants(rivals)]
    results = race(contestants, rounds, seconds, lambda k: tell(f"round {k} of {rounds}"))
    tell("")
    compared = costs(results)
    found = goals(results, rivals, compared, runs, starts)
    return Figures(where, rounds, seconds, results, rivals, compared, runs, starts, found)
