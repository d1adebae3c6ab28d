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
from pathlib import Path

import numba
import numpy as np
import numpy.typing as npt

from rigid_envs.bench.interleaved import Throughput, Workload, time_interleaved
from rigid_envs.kernels.free_body import FREE_BODY
from rigid_envs.kernels.rows import LANES, integrate
from rigid_envs.pages.tables import table
from rigid_envs.provenance import provenance
from rigid_envs.systems import FreeBody

__all__ = ["c_loops", "difference"]

_FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-shared", "-fPIC")
_SOURCE = Path(__file__).with_name("free_body.c")
_N = 4096
_H = 0.1  # [s]
_STEP, _RESTORE, _WEIGHTS = FREE_BODY.step, FREE_BODY.restore, FREE_BODY.weights
_PROTOTYPES = FREE_BODY.prototypes
_STAGES = len(_WEIGHTS)
_TARGET = 1.5

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


def _report(results: list[Throughput], differences: dict[str, float]) -> str:
    ours = results[0]
    rows = []
    for result in results:
        step = 1e9 / result.median
        low, ratio, high = np.percentile(result.ratio(ours), (25, 50, 75))
        rows.append(
            (
                result.name,
                f"{step:.1f}",
                f"{step / _STAGES:.2f}",
                f"{ratio:.2f}",
                f"{low:.2f} .. {high:.2f}",
                f"{differences[result.name]:.0e}" if result.name in differences else "",
            )
        )
    header = ("loop", "ns per step", "ns per stage", "speed", "quartiles", "difference")
    return table(header, rows, "<>>>>>", indent=0)


def main() -> int:
    """Measure; the status is 1 if the goal is missed, 2 if there is no gcc."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("--rounds", type=int, default=200)
    options = parser.parse_args()
    if shutil.which("gcc") is None:
        print("gcc is not installed: nothing to compare with", file=sys.stderr)
        return 2
    with c_loops() as loops:
        differences = {f"C, {name}": difference(loop) for name, loop in loops.items()}
        workloads = [_workload("rigid_envs.kernels", kernel_loop)]
        workloads += [_workload(f"C, {name}", loop) for name, loop in loops.items()]
        results = time_interleaved(workloads, options.rounds, 0.01)
    where = provenance()
    print(f"{where['cpu']}; gcc {' '.join(_FLAGS[:3])}; {_N} rows, {_STAGES} stages per step\n")
    print(_report(results, differences))
    ratio = float(np.median(results[1].ratio(results[0])))
    met = ratio <= _TARGET
    verdict = "met" if met else "not met"
    print(f"\nThe kernel takes {ratio:.2f} x the time of the same loop in C; ", end="")
    print(f"goal <= {_TARGET} x: {verdict}")
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
