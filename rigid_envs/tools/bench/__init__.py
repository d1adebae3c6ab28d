"""Speed of the environments, accuracy of the free body, start-up time; peers in the same run."""

from collections.abc import Callable, Sequence

from rigid_envs.tools.bench import accuracy
from rigid_envs.tools.bench.figures import Figures, startup
from rigid_envs.tools.bench.measuring import gymnasium_workloads, our_workloads, time_interleaved

__all__ = ["Figures", "bench"]


def bench(
    ids: Sequence[str],
    startup_ids: Sequence[str],
    quick: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> Figures:
    """Measure speed, accuracy and start-up time.

    Args:
        ids: environments whose speed is measured.
        startup_ids: environments whose first step in a new process is timed.
        quick: 12 rounds of 10 ms and one new process, in place of 50 rounds of 20 ms and three.
        progress: called with a few words at every stage.
    """
    rounds, seconds = (12, 0.01) if quick else (50, 0.02)
    progress("accuracy")
    runs = [accuracy.free_run(0.05, duration) for duration in (60.0, 6000.0)]
    settings = accuracy.mujoco_settings() if accuracy.is_installed() else []
    progress("first steps of new processes")
    startups = [startup(env_id, 1, 1 if quick else 3) for env_id in startup_ids]
    progress("warming up")
    workloads = [*our_workloads(ids), *gymnasium_workloads(), *accuracy.mujoco_workloads(settings)]
    speeds = time_interleaved(
        workloads, rounds, seconds, lambda done: progress(f"round {done} of {rounds}")
    )
    return Figures(rounds, seconds, speeds, settings, runs, startups)
