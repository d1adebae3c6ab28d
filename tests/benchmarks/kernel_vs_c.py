"""The compiled loop of the free body against the same loop in C on vectors of eight doubles.

    python tests/benchmarks/kernel_vs_c.py [--rounds 200]

Both are first shown to give the same numbers to rounding; then they take turns. Needs gcc.
"""

import argparse
import ctypes
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
import numpy.typing as npt

from rigid_envs.bench.interleaved import Workload, time_interleaved
from rigid_envs.kernels.free_body import FREE_BODY
from rigid_envs.kernels.rows import LANES, integrate
from rigid_envs.pages.tables import table
from rigid_envs.provenance import provenance
from rigid_envs.systems import FreeBody

__all__ = ["Loops", "c_loops", "compare", "difference"]

_FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-shared", "-fPIC")
_SOURCE = Path(__file__).with_name("free_body.c")
_N = 4096
_H = 0.1  # [s]
_STEP, _RESTORE, _WEIGHTS = FREE_BODY.step, FREE_BODY.restore, FREE_BODY.weights
_PROTOTYPES = FREE_BODY.prototypes
_STAGES = len(_WEIGHTS)
_TARGET = 1.2

Array = npt.NDArray[np.float64]
Loop = Callable[[Array, int, float, int], None]
"""``loop(buffer, n_blocks, h, n_substeps)``."""

_SIZE = sum(map(len, _PROTOTYPES)) * LANES


@numba.njit(error_model="numpy", nogil=True)
def kernel_loop(buffer: Array, n_blocks: int, h: float, n_substeps: int) -> None:
    """The integration loop of the environments, over blocks of rows."""
    for block in range(n_blocks):
        integrate(
            _STEP,
            _RESTORE,
            _WEIGHTS,
            _PROTOTYPES,
            buffer,
            block * _SIZE,
            LANES,
            h,
            n_substeps,
        )


@contextmanager
def c_loops() -> Iterator[dict[str, Loop]]:
    """The loops in C by name, compiled for this machine."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "free_body.so"
        subprocess.run(["gcc", *_FLAGS, str(_SOURCE), "-o", str(library), "-lm"], check=True)
        loaded = ctypes.CDLL(str(library))
        yield {name: _loop(loaded, name) for name in ("stage_by_stage", "in_registers")}


def new_rows(n: int) -> Array:
    """Blocks of n rows that turn at about 1 rad/s under constant torques, as the kernels want."""
    random = np.random.default_rng(0)
    q = random.normal(size=(n, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    omega = random.uniform(-1.0, 1.0, (n, 3))
    torque = random.uniform(-0.2, 0.2, (n, 3))
    p = np.tile(FreeBody().parameters, (n, 1))
    rows = np.hstack([q, omega, torque, p]).reshape(n // LANES, LANES, -1)
    return np.ascontiguousarray(rows.transpose(0, 2, 1)).ravel()


def _loop(library: ctypes.CDLL, name: str) -> Loop:
    function = getattr(library, name)
    function.argtypes = (ctypes.c_void_p, ctypes.c_long, ctypes.c_double, ctypes.c_long)
    function.restype = None

    def loop(buffer: Array, n_blocks: int, h: float, n_substeps: int) -> None:
        function(buffer.ctypes.data, n_blocks, h, n_substeps)

    return loop


def difference(loop: Loop) -> float:
    """Largest difference to the kernel after 100 substeps."""
    ours, theirs = new_rows(_N), new_rows(_N)
    kernel_loop(ours, _N // LANES, _H, 100)
    loop(theirs, _N // LANES, _H, 100)
    return float(np.max(np.abs(ours - theirs)))


def _workload(name: str, loop: Loop) -> Workload:
    buffer = new_rows(_N)

    def run(times: int) -> int:
        for _ in range(times):
            loop(buffer, _N // LANES, _H, 1)
        return times * _N

    return Workload(name, "", run)


@dataclass(frozen=True)
class Loops:
    """A loop beside that of the kernels.

    Attributes:
        name: of the loop.
        nanoseconds: of a step of a row.
        ratio: its time over that of the kernels', median of the rounds.
        quartiles: first and third.
        difference: largest one of its numbers from the kernels' after 100 steps.
    """

    name: str
    nanoseconds: float
    ratio: float
    quartiles: tuple[float, float]
    difference: float


def compare(rounds: int) -> list[Loops]:
    """The kernels' loop, and those in C.

    Args:
        rounds: of interleaved timing.

    Raises:
        FileNotFoundError: gcc is not installed.
    """
    with c_loops() as loops:
        differences = {f"C, {name}": difference(loop) for name, loop in loops.items()}
        workloads = [_workload("rigid_envs.kernels", kernel_loop)]
        workloads += [_workload(f"C, {name}", loop) for name, loop in loops.items()]
        results = time_interleaved(workloads, rounds, 0.01)
    compared = []
    for result in results:
        low, median, high = np.percentile(results[0].ratio(result), (25, 50, 75)).tolist()
        apart = differences.get(result.name, 0.0)
        compared.append(Loops(result.name, 1e9 / result.median, median, (low, high), apart))
    return compared


def main() -> int:
    """Measure; the status is 1 if the goal is missed, 2 if there is no gcc."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("--rounds", type=int, default=200)
    options = parser.parse_args()
    if shutil.which("gcc") is None:
        print("gcc is not installed: nothing to compare with", file=sys.stderr)
        return 2
    found = compare(options.rounds)
    rows = [
        (
            loop.name,
            f"{loop.nanoseconds:.1f}",
            f"{loop.ratio:.2f}",
            " .. ".join(f"{end:.2f}" for end in loop.quartiles),
            f"{loop.difference:.0e}",
        )
        for loop in found
    ]
    print(f"{provenance()['cpu']}; gcc {' '.join(_FLAGS[:3])}; {_N} rows, {_STAGES} stages\n")
    header = ("loop", "ns per step of a row", "time", "quartiles", "difference")
    print(table(header, rows, "<>>>>", indent=0))
    ratio = 1.0 / min(loop.ratio for loop in found[1:])
    met = ratio <= _TARGET
    verdict = "met" if met else "not met"
    print(f"\nThe kernels take {ratio:.2f} x the time of the faster loop in C; ", end="")
    print(f"goal <= {_TARGET} x: {verdict}")
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
