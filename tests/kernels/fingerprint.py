"""What the environments compute on the processor that Numba is told to compile for, as JSON.

Run as a program: ``python -m tests.kernels.fingerprint CACHE``, where CACHE is also what
``NUMBA_CACHE_DIR`` names. Prints a hash over every number of some thousand steps for each of the
environments, plain and with everything switched on, and the symbols their kernels call.
"""

import hashlib
import json
import struct
import sys
from pathlib import Path

import numpy as np

from rigid_envs.core import Core
from rigid_envs.tasks import BallPark, IntermediateAxis, SleepingTop, Task

__all__ = ["foreign_symbols", "hash_of"]

CHANNEL = {
    "action_noise": 0.1,
    "observation_noise": (0.0, 0.1),
    "action_delay": (0, 3),
    "observe_params": True,
}
TASKS: dict[str, Task] = {
    "IntermediateAxis": IntermediateAxis(),
    "SleepingTop": SleepingTop(),
    "BallPark": BallPark(),
    "IntermediateAxis, all": IntermediateAxis(I1=(1.0, 1.2), rotation="euler", **CHANNEL),
    "SleepingTop, all": SleepingTop(I3=(0.4, 0.6), rotation="rot6d", n_substeps=3, **CHANNEL),
    "BallPark, all": BallPark(radius=(0.9, 1.2), rotation="quat", n_substeps=2, **CHANNEL),
}
# What Numba's own runtime and the Python interpreter provide, and moves of memory.
RUNTIME = ("Py", "_Py", "NRT_", "numba_", "mem")
ROWS = 67  # a full block and the scalar remainder of a second one
STEPS = 200  # 13 400 of a row; fma without hardware takes 100 ns


def hash_of(task: Task, n_rows: int = ROWS, n_steps: int = STEPS) -> str:
    """Hash of every observation, result, flag and state, episodes of 60 steps at most."""
    core, rows = Core(task, n_rows, max_steps=60), np.arange(n_rows)
    core.seed(rows, np.arange(n_rows, dtype=np.uint64) + np.uint64(2**40))
    core.reset(rows)
    rng, digest = np.random.default_rng(0), hashlib.sha256()
    for _ in range(n_steps):
        core.actions[:] = rng.uniform(-1.2, 1.2, core.actions.shape)
        assert core.step() >= 0
        for numbers in (core.observations, core.results(), core.flags(), core.y):
            digest.update(np.ascontiguousarray(numbers).tobytes())
        terminated, truncated = core.flags()[:2]
        ended = np.flatnonzero(terminated | truncated)
        if len(ended):
            core.reset(ended)
            digest.update(core.observations.tobytes())
    return digest.hexdigest()


def foreign_symbols(folder: Path) -> set[str]:
    """Functions of neither Python nor Numba that the kernels kept in a cache folder call.

    Each file holds the machine code of a kernel as an ELF object, as the linker takes it.
    """
    names: set[str] = set()
    for path in folder.rglob("*.nbc"):
        image = path.read_bytes()
        names |= _undefined(image[image.index(b"\x7fELF") :])
    return {name for name in names if not name.startswith(RUNTIME)}


def _undefined(elf: bytes) -> set[str]:
    """Undefined symbols of a 64-bit little-endian ELF object (System V ABI, chapter 4)."""
    (start,) = struct.unpack_from("<Q", elf, 0x28)
    size, count = struct.unpack_from("<HH", elf, 0x3A)
    sections = [struct.unpack_from("<IIQQQQII", elf, start + k * size) for k in range(count)]
    names = set()
    for _, kind, _, _, offset, length, link, _ in sections:
        if kind != 2:  # a symbol table
            continue
        for at in range(offset, offset + length, 24):
            name, _, _, section = struct.unpack_from("<IBBH", elf, at)
            if name and section == 0:
                text = sections[link][4] + name
                names.add(elf[text : elf.index(b"\0", text)].decode())
    return names


if __name__ == "__main__":
    hashes = {name: hash_of(task) for name, task in TASKS.items()}
    print(json.dumps({"hashes": hashes, "symbols": sorted(foreign_symbols(Path(sys.argv[1])))}))
