"""What environments compute on the processor that Numba is told to compile for, as JSON.

Run as a program: ``python -m tests.kernels.fingerprint CACHE ID ...``, where CACHE is also what
``NUMBA_CACHE_DIR`` names. Prints hashes over every number of some thousand steps of each of the
environments, plain and with everything switched on, a hash over the outputs of networks, and the
symbols their kernels call.
"""

import hashlib
import json
import struct
import sys
from pathlib import Path

import numpy as np

from rigid_envs.engine.network import ACTIVATIONS, perceptron, relative_rotations
from rigid_envs.testing.environments import actions, ending, flat, noisy, vector

__all__ = ["foreign_symbols", "hash_of_networks", "hashes_of"]

# What Numba's own runtime and the Python interpreter provide, and moves of memory.
RUNTIME = ("Py", "_Py", "NRT_", "numba_", "mem")
ROWS = 67  # a full block and the scalar remainder of a second one
STEPS = 200  # 13 400 of a row; fma without hardware takes 100 ns


def hashes_of(env_id):
    """Hash of all that steps return and of all states: plain, and with everything switched on."""
    return [_hash_of(env_id, {}), _hash_of(env_id, ending(env_id) | noisy(env_id))]


def _hash_of(env_id, config):
    """Episodes have 60 steps at most, so that many of them begin and end."""
    envs = vector(env_id, ROWS, autoreset_mode="SameStep", max_episode_steps=60, **config)
    digest = hashlib.sha256()
    digest.update(flat(envs.reset(seed=2**40)[0]).tobytes())
    for batch in actions(env_id, STEPS, ROWS):
        observations, *results, infos = envs.step(batch)
        infos = [infos[key] for key in sorted(infos) if key.startswith(("reward/", "cost"))]
        for numbers in (flat(observations), *results, *infos, *envs.get_state().values()):
            digest.update(np.ascontiguousarray(numbers).tobytes())
    return digest.hexdigest()


def hash_of_networks():
    """Hash of the outputs of a network with each activation, and of relative rotations.

    Its layers have widths that fill no vector, and inputs as large as activations saturate at.
    """
    stream, sizes = np.random.default_rng(0), np.array([21, 67, 13, 3])
    count = int((sizes[1:] * (sizes[:-1] + 1)).sum())
    weights = stream.normal(size=count).astype(np.float32)
    x, out = (5.0 * stream.normal(size=(ROWS, 21))).astype(np.float32), np.empty((ROWS, 3))
    digest = hashlib.sha256()
    for activation in range(len(ACTIVATIONS)):
        perceptron(x, weights, sizes, activation, activation, out)
        digest.update(out.tobytes())
    more = np.empty((ROWS, 21 + 18), np.float32)
    relative_rotations(x, 1, 11, more)
    return digest.hexdigest() + hashlib.sha256(more.tobytes()).hexdigest()


def foreign_symbols(folder, modules=""):
    """Functions of neither Python nor Numba that the kernels kept in a cache folder call.

    Each file holds the machine code of a kernel as an ELF object, as the linker takes it; its name
    begins with that of the kernel's module.
    """
    names = set()
    for path in folder.rglob("*.nbc"):
        if not path.name.startswith(modules):
            continue
        image = path.read_bytes()
        names |= _undefined(image[image.index(b"\x7fELF") :])
    return {name for name in names if not name.startswith(RUNTIME)}


def _undefined(elf):
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
    cache, *ids = sys.argv[1:]
    hashes = {env_id: hashes_of(env_id) for env_id in ids}
    networks = hash_of_networks()
    symbols = sorted(foreign_symbols(Path(cache)))
    print(json.dumps({"hashes": hashes, "networks": networks, "symbols": symbols}))
