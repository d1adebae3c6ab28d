"""What the reduced frame adds to a row of every environment.

Run from the checkout: ``python -m tests.benchmarks.frames``. It measures this part of
docs/speed.json alone, and writes the page anew.

Where an array of rows lies in memory changes its time by some percent, as long as it lies there. So
environments are made anew several times, and all rounds count.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs import ENVIRONMENTS
from rigid_envs.bench.interleaved import Workload, time_interleaved
from rigid_envs.bench.workloads import staggered, vector_workload
from rigid_envs.catalogue import task_of
from rigid_envs.files import lined_json, write_atomic
from rigid_envs.provenance import provenance
from tests.benchmarks.growth import Growth
from tests.benchmarks.page import markdown

__all__ = ["by_frame"]

DOCS = Path(__file__).resolve().parents[2] / "docs"
FRAMES = ("world", "reduced")
ROWS, TIMES = 4096, 8
_TURN = 0.01  # [s]


def by_frame(rounds: int) -> dict[str, Any]:
    """Every id that has a reduced frame, in it against in the world; and where this was measured.

    Args:
        rounds: of interleaved timing, each time that the environments are made.
    """
    ids = [env_id for env_id in ENVIRONMENTS if task_of(env_id).reduction is not None]
    rows = [asdict(growth) for env_id in ids for growth in _measured(env_id, rounds)]
    return {"provenance": provenance(), "rounds": rounds, "times": TIMES, "rows": rows}


def _measured(env_id: str, rounds: int) -> list[Growth]:
    name = env_id.removeprefix("RigidEnvs/").removesuffix("-v0")
    times = [_once(env_id, rounds) for _ in range(TIMES)]
    nanoseconds = np.concatenate(times, axis=1)
    found = []
    for frame, ours in zip(FRAMES, nanoseconds, strict=True):
        low, ratio, high = np.percentile(ours / nanoseconds[0], (25, 50, 75)).tolist()
        found.append(Growth(name, frame, float(np.median(ours)), ratio, (low, high)))
    return found


def _once(env_id: str, rounds: int) -> Any:
    """Time of a row [ns] in every frame and round, in environments of its own."""
    workloads = [
        Workload(env_id, frame, vector_workload(staggered(env_id, ROWS, 1, frame=frame)))
        for frame in FRAMES
    ]
    return 1e9 / np.array([r.samples for r in time_interleaved(workloads, rounds, _TURN)])


def main() -> None:
    """Measure, and write data and page."""
    data = json.loads((DOCS / "speed.json").read_text(encoding="utf-8"))
    data["frames"] = by_frame(20)
    write_atomic(DOCS / "speed.json", lined_json(data))
    write_atomic(DOCS / "speed.md", markdown(data))


if __name__ == "__main__":
    main()
