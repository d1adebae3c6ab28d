"""What a core can do: operations per second of each kind, on vectors in registers. Needs gcc."""

import ctypes

from rigid_envs.tools.bench.measuring import Workload
from tests.benchmarks.kernel_vs_c import compiled

CORE = "core"
"""Column of the workloads."""

_FUNCTIONS = {
    "fma": "multiply_add",
    "sum": "sum",
    "quotient": "quotient",
    "root": "square_root",
}
_N = 1000


def throughputs() -> list[Workload]:
    """A workload for each kind of operation; its steps are operations.

    Raises:
        FileNotFoundError: gcc is not installed.
    """
    library = compiled("throughput.c")
    numbers = library.numbers()
    return [_workload(kind, getattr(library, name), numbers) for kind, name in _FUNCTIONS.items()]


def _workload(kind: str, function: "ctypes._NamedFuncPointer", numbers: int) -> Workload:
    function.argtypes = (ctypes.c_long,)
    function.restype = ctypes.c_double

    def run(times: int) -> int:
        function(times * _N)
        return times * _N * numbers

    return Workload(kind, CORE, run)
