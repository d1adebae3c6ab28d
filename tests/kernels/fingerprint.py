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

import gymnasium as gym
import numpy as np

import rigid_envs  # noqa: F401 - registers the environments

__all__ = ["foreign_symbols", "hash_of"]

CHANNEL = {
    "action_noise": 0.1,
    "observation_noise": (0.0, 0.1),
    "action_delay": (0, 3),
    "observe_params": True,
}
SWITCHED_ON = {
    "IntermediateAxis-v0": {"I1": (1.0, 1.2), "rotation": "euler"},
    "SleepingTop-v0": {"I3": (0.4, 0.6), "rotation": "rot6d", "n_substeps": 3},
    "BallPark-v0": {"radius": (0.9, 1.2), "rotation": "quat", "n_substeps": 2},
}
# What Numba's own runtime and the Python interpreter provide, and moves of memory.
RUNTIME = ("Py", "_Py", "NRT_", "numba_", "mem")
ROWS = 67  # a full block and the scalar remainder of a second one
STEPS = 200  # 13 400 of a row; fma without hardware takes 100 ns


def hash_of(name: str, **config: object) -> str:
    """Hash of all that the steps return and of all states, with episodes of 60 steps at most."""
    env = gym.make_vec(
        f"RigidEnvs/{name}",
        ROWS,
        vectorization_mode="vector_entry_point",
        autoreset_mode="SameStep",
        max_episode_steps=60,
        **config,
    )
    rng, digest = np.random.default_rng(0), hashlib.sha256()
    digest.update(env.reset(seed=2**40)[0].tobytes())
    for _ in range(STEPS):
        actions = rng.uniform(-1.2, 1.2, env.action_space.shape).astype(np.float32)
        *results, infos = env.step(actions)
        infos = [infos[key] for key in sorted(infos) if key.startswith(("reward/", "cost"))]
        for numbers in (*results, *infos, *env.get_state().values()):
            digest.update(np.ascontiguousarray(numbers).tobytes())
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
    hashes = {}
    for name, config in SWITCHED_ON.items():
        hashes[name] = (hash_of(name), hash_of(name, **CHANNEL, **config))
    print(json.dumps({"hashes": hashes, "symbols": sorted(foreign_symbols(Path(sys.argv[1])))}))
