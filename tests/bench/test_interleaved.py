"""Interleaved timing: workloads take turns in every round, and their steps are counted."""

import time

import numpy as np
import pytest

from rigid_envs.tools.bench.measuring import Workload, time_interleaved


def test_workloads_take_turns_and_their_steps_are_counted() -> None:
    turns: list[str] = []

    def workload(name: str, steps: int) -> Workload:
        def run(times: int) -> int:
            turns.append(name)
            time.sleep(1e-3 * times)
            return steps * times

        return Workload(name, "made", run, time.perf_counter)

    slow, fast = time_interleaved([workload("slow", 1), workload("fast", 10)], 5, 2e-3)
    assert len(slow.samples) == len(fast.samples) == 5
    assert turns[-10:].count("slow") == turns[-10:].count("fast") == 5
    assert np.median(fast.ratio(slow)) == pytest.approx(10.0, rel=0.5)
