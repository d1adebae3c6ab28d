"""What the reduced frame adds to a row of every environment.

Run from the checkout: ``python -m tests.benchmarks.frames``. It measures this part of
docs/speed.json alone, and writes the page anew.

Where code and rows lie in memory changes the time of a row by some percent, as long as the process
lives, and so does what other programs do for some seconds. So all ids take turns several times,
each time in a process of its own, and all rounds count.
"""

import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from rigid_envs.base.files import lined_json, write_atomic
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs.lookup import task_of
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.bench.measuring import Workload, staggered, time_interleaved, vector_workload
from tests.benchmarks.growth import growth_of
from tests.benchmarks.page import markdown

DOCS = Path(__file__).resolve().parents[2] / "docs"
FRAMES = ("world", "reduced")
ROWS, TURNS = 4096, 8
_SAMPLE = 0.01  # [s]


def by_frame(rounds):
    """Every id that has a reduced frame, in it against in the world; and where this was measured.

    Args:
        rounds: of interleaved timing in each turn.
    """
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as processes:
        turns = list(processes.map(_turn, [rounds] * TURNS))
    rows = [
        asdict(growth)
        for env_id in turns[0]
        for growth in growth_of(
            env_id.removeprefix("RigidEnvs/").removesuffix("-v0"),
            FRAMES,
            np.concatenate([turn[env_id] for turn in turns], axis=1),
        )
    ]
    return {"provenance": provenance(), "rounds": rounds, "turns": TURNS, "rows": rows}


def _turn(rounds):
    ids = [env_id for env_id in ENVIRONMENTS if task_of(env_id).reduction is not None]
    return {env_id: _times(env_id, rounds) for env_id in ids}


def _times(env_id, rounds):
    """Time of a row [ns] in every frame and round, in environments of its own."""
    workloads = [
        Workload(env_id, frame, vector_workload(staggered(env_id, ROWS, 1, frame=frame)))
        for frame in FRAMES
    ]
    return 1e9 / np.array([r.samples for r in time_interleaved(workloads, rounds, _SAMPLE)])


def main():
    """Measure, and write data and page."""
    data = json.loads((DOCS / "speed.json").read_text(encoding="utf-8"))
    data["frames"] = by_frame(20)
    write_atomic(DOCS / "speed.json", lined_json(data))
    write_atomic(DOCS / "speed.md", markdown(data))


if __name__ == "__main__":
    main()
