"""The compiled loops of the systems against the same loops in C on vectors, in turns. Needs gcc."""

import ctypes
import functools
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from itertools import cycle, islice
from pathlib import Path

import numba
import numpy as np

from rigid_envs import systems
from rigid_envs.base.checks import Array
from rigid_envs.engine.rows import LANES, integrate
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.task import aligned_zeros
from rigid_envs.tools.bench.measuring import Workload, time_interleaved

KERNELS = "rigid_envs.engine"
N = 4096
_FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-shared", "-fPIC")
_VARIANTS = ("stage_by_stage", "in_registers")


def _turning(random, n):
    """Bodies that turn at about 1 rad/s under constant torques."""
    omega = random.uniform(-1.0, 1.0, (n, 3))
    return np.hstack([_attitudes(random, n), omega]), random.uniform(-0.2, 0.2, (n, 3))


def _spinning(random, n):
    """Tops with more than the spin with which they sleep, 4 rad/s, under all of the inputs."""
    turn, tilt = random.uniform((-np.pi, 0.0), (np.pi, 0.3), (n, 2)).T
    y = np.zeros((n, 11))
    y[:, :4] = rotations.quaternion_from_euler(np.stack([turn, tilt, -turn], axis=-1))
    y[:, 6] = random.uniform(6.0, 8.0, n)
    return y, random.uniform(-0.05, 0.05, (n, 8))


def _rolling(random, n):
    """Balls anywhere, with velocities near 1, that turn by up to a quarter in a step of 0.1 s."""
    places, u = random.uniform(-1.0, 1.0, (n, 2)), random.uniform(-1.0, 1.0, (n, 3))
    u[:, 2] *= 15.0
    return np.hstack([_attitudes(random, n), places]), u


def _upright(random, n):
    """Disks that are fast enough to stay upright, 1.8 rad/s, under small torques."""
    turn, lean, phase = random.uniform(-1.0, 1.0, (3, n))
    angles = np.stack([np.pi * turn, 0.5 * np.pi + 0.2 * lean, np.pi * phase], axis=-1)
    y = np.zeros((n, 9))
    y[:, :4] = rotations.quaternion_from_euler(angles)
    y[:, 6] = random.uniform(4.0, 5.0, n)
    return y, random.uniform(-0.1, 0.1, (n, 3))


def _attitudes(random, n):
    q = random.normal(size=(n, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


@dataclass(frozen=True)
class Case:
    """A system whose loop is compared.

    Attributes:
        system: with its parameters.
        source: the loops in C, beside this file.
        start: states and inputs of n rows, shapes (n, n_state) and (n, n_input).
        h: step [s].
    """

    system: System
    source: str
    start: Callable[[np.random.Generator, int], tuple[Array, Array]]
    h: float

    def rows(self):
        """Blocks of `N` rows, as the loops want them; they begin at a line of the cache."""
        y, u = self.start(np.random.default_rng(0), N)
        p = np.tile(self.system.parameters, (N, 1))
        rows = np.hstack([y, u, p]).reshape(N // LANES, LANES, -1).transpose(0, 2, 1)
        buffer = aligned_zeros(rows.size)
        buffer[:] = rows.ravel()
        return buffer


CASES = {
    "free body": Case(systems.FreeBody(), "free_body.c", _turning, 0.1),
    "heavy top": Case(systems.HeavyTop(), "heavy_top.c", _spinning, 0.05),
    "rolling ball": Case(systems.RollingBall(), "rolling_ball.c", _rolling, 0.1),
    "rolling disk": Case(systems.RollingDisk(), "rolling_disk.c", _upright, 0.05 / 3.0),
}
"""By name; the steps are those of the environments."""


@functools.cache
def loops(case):
    """The loops of a system by name: that of the kernels first, then those in C.

    Raises:
        FileNotFoundError: gcc is not installed.
    """
    library = compiled(case.source)
    in_c = {f"C, {name}": _loop(getattr(library, name)) for name in _VARIANTS}
    return {KERNELS: _kernel_loop(case), **in_c}


def compiled(source):
    """A file of this folder, compiled for this machine.

    Raises:
        FileNotFoundError: gcc is not installed.
    """
    with tempfile.TemporaryDirectory() as folder:  # what is loaded stays, without its file
        library = Path(folder) / "library.so"
        path = Path(__file__).with_name(source)
        subprocess.run(["gcc", *_FLAGS, str(path), "-o", str(library), "-lm"], check=True)
        return ctypes.CDLL(str(library))


def _kernel_loop(case):
    """The integration loop of the environments, over blocks of rows."""
    dynamics = case.system.dynamics
    step, restore, weights = dynamics.step, dynamics.restore, dynamics.weights
    prototypes = dynamics.prototypes
    size = sum(map(len, prototypes)) * LANES

    @numba.njit(error_model="numpy", nogil=True)
    def loop(buffer, n_blocks, h, n_substeps):
        for block in range(n_blocks):
            base = block * size
            integrate(step, restore, weights, prototypes, buffer, base, LANES, h, n_substeps)

    return loop


def _loop(function):
    function.argtypes = (ctypes.c_void_p, ctypes.c_long, ctypes.c_double, ctypes.c_long)
    function.restype = None

    def loop(buffer, n_blocks, h, n_substeps):
        function(buffer.ctypes.data, n_blocks, h, n_substeps)

    return loop


def difference(case, name):
    """Largest difference of a loop to the kernel after 100 steps."""
    ends = []
    for loop in (loops(case)[KERNELS], loops(case)[name]):
        ends.append(case.rows())
        loop(ends[-1], N // LANES, case.h, 100)
    return float(np.max(np.abs(ends[1] - ends[0])))


def workload(case, name, column, h, n_substeps=1):
    """Runs periods of some substeps, forth and back in turn: the rows stay near their starts."""
    loop, buffer, lengths = loops(case)[name], case.rows(), cycle((h, -h))

    def run(times):
        for length in islice(lengths, times):
            loop(buffer, N // LANES, length, n_substeps)
        return times * N

    return Workload(name, column, run)


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


def compare(rounds):
    """By system, the kernels' loop, and those in C.

    Args:
        rounds: of interleaved timing.

    Raises:
        FileNotFoundError: gcc is not installed.
    """
    workloads = [
        workload(case, name, system, case.h)
        for system, case in CASES.items()
        for name in loops(case)
    ]
    results = time_interleaved(workloads, rounds, 0.01)
    return {system: list(_compared(system, results)) for system in CASES}


def _compared(system, results):
    ours, *others = (result for result in results if result.column == system)
    for result in (ours, *others):
        low, median, high = np.percentile(ours.ratio(result), (25, 50, 75)).tolist()
        apart = difference(CASES[system], result.name)
        yield Loops(result.name, 1e9 / result.median, median, (low, high), apart)
