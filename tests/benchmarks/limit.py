"""The integration of a control period against C, and against what the core can do. Needs gcc."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from rigid_envs.envs.lookup import full_id, task_of
from rigid_envs.tools.bench.measuring import Workload, staggered, time_interleaved, vector_workload
from tests.benchmarks.flops import IDS, flops, of_period
from tests.benchmarks.kernel_vs_c import CASES, KERNELS, N, compiled, loops, workload

_TURN = 0.01  # [s]
CORE = "core"
"""Column of the workloads."""

_FUNCTIONS = {"fma": "multiply_add", "sum": "sum", "quotient": "quotient", "root": "square_root"}
_TIMES = 1000
_STEP = "step"
_UNITS = {"sum": "sum", "product": "fma", "fma": "fma", "quotient": "quotient", "root": "root"}
"""Throughput that bounds each kind of operation: products are made where multiply-adds are."""


@dataclass(frozen=True)
class Period:
    """The integration of a row over a control period.

    Attributes:
        env_id: environment.
        n_substeps: of the integrator.
        counts: operations of each kind.
        flops: of these, an fma as two.
        nanoseconds: medians: "all fused", all flops as multiply-adds; "as written", operations of
            all kinds one after the other; "C", the faster loop; "ours"; "step", a whole step.
        ratios: of our time to each of these, median and quartiles over the rounds.
    """

    env_id: str
    n_substeps: int
    counts: dict[str, int]
    flops: int
    nanoseconds: dict[str, float]
    ratios: dict[str, tuple[float, float, float]]


@dataclass(frozen=True)
class Limit:
    """What the core can do, and what the loops make of it.

    Attributes:
        per_nanosecond: operations of each kind.
        periods: one for each environment.
    """

    per_nanosecond: dict[str, float]
    periods: list[Period]


def limit(rounds):
    """Measure all in turns: the core, our loops and those in C, and whole steps.

    Args:
        rounds: of interleaved timing.

    Raises:
        FileNotFoundError: gcc is not installed.
    """
    workloads = [*throughputs(), *(each for env_id in IDS for each in _of_period(env_id))]
    results = time_interleaved(workloads, rounds, _TURN)
    times = {(r.column, r.name): 1e9 / np.array(r.samples) for r in results}  # [ns]
    of_core = {name: time for (column, name), time in times.items() if column == CORE}
    per_nanosecond = {name: 1.0 / float(np.median(time)) for name, time in of_core.items()}
    periods = []
    for env_id in IDS:
        of_row = {name: time for (column, name), time in times.items() if column == env_id}
        periods.append(period(env_id, of_core, of_row))
    return Limit(per_nanosecond, periods)


def _of_period(env_id):
    """All loops of an environment over a control period, and its whole step."""
    task = task_of(full_id(env_id))
    case, h = _case(task.compiled.dynamics), task.dt / task.n_substeps
    for name in loops(case):
        yield workload(case, name, env_id, h, task.n_substeps)
    yield Workload(_STEP, env_id, vector_workload(staggered(full_id(env_id), N, 1)))


def _case(dynamics):
    return next(case for case in CASES.values() if case.system.dynamics is dynamics)


def period(env_id, of_core, of_row):
    """What times of operations and of loops, each in all rounds [ns], say of an environment."""
    counts = of_period(full_id(env_id))
    in_c = [time for name, time in of_row.items() if name not in (KERNELS, _STEP)]
    times = {
        "all fused": 0.5 * flops(counts) * of_core["fma"],
        "as written": sum(counts[kind] * of_core[unit] for kind, unit in _UNITS.items()),
        "C": min(in_c, key=np.median),
        "ours": of_row[KERNELS],
        "step": of_row[_STEP],
    }
    return Period(
        env_id,
        task_of(full_id(env_id)).n_substeps,
        dict(counts),
        flops(counts),
        {name: float(np.median(time)) for name, time in times.items()},
        {name: _median_and_quartiles(times["ours"] / time) for name, time in times.items()},
    )


def _median_and_quartiles(ratio):
    low, median, high = np.percentile(ratio, (25, 50, 75)).tolist()
    return median, low, high


# What a core can do: operations per second of each kind, on vectors in registers.


def throughputs():
    """A workload for each kind of operation; its steps are operations.

    Raises:
        FileNotFoundError: gcc is not installed.
    """
    library = compiled("throughput.c")
    numbers = library.numbers()
    return [_workload(kind, getattr(library, name), numbers) for kind, name in _FUNCTIONS.items()]


def _workload(kind, function, numbers):
    function.argtypes = (ctypes.c_long,)
    function.restype = ctypes.c_double

    def run(times):
        function(times * _TIMES)
        return times * _TIMES * numbers

    return Workload(kind, CORE, run)
