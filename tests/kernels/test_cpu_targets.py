"""The same bits on any x86-64 processor, and no call to the C mathematics library.

Numba compiles for the processor it is told of, so one machine can stand for many: older ones
without FMA or AVX, newer ones with vectors of 256 or 512 bits. Features this machine lacks are
masked off. Where the target has no FMA, fma is the C library's, which rounds once like the
instruction; that library is then told to leave out its own FMA code too.

What all must agree with is computed here, on this machine as it is. The networks of policies are
compiled for each of them too.
"""

import json
import os
import platform
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from llvmlite import binding

from rigid_envs.engine.compiler import kernel_hash
from rigid_envs.testing.environments import IDS, task_of
from tests.kernels.fingerprint import hash_of_networks, hashes_of

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64") or sys.platform != "linux",
    reason="emulates x86-64 processors, and reads ELF objects",
)

# Target: processor and changes to its features. "prefer-256-bit" is how LLVM tunes for a processor
# that slows down under 512-bit vectors; without FMA there is no AVX-512 either.
TARGETS = {
    "nehalem": ("nehalem", ""),
    "haswell": ("haswell", ""),
    "haswell, no FMA": ("haswell", "-fma"),
    "skylake-avx512, 256 bits": ("skylake-avx512", "+prefer-256-bit"),
    "skylake-avx512, 512 bits": ("skylake-avx512", "-prefer-256-bit"),
    "skylake-avx512, no FMA": ("skylake-avx512", "-fma"),
    "znver4, 256 bits": ("znver4", "-avx512f"),
    "znver4, 512 bits": ("znver4", "-prefer-256-bit"),
    "znver4, no FMA": ("znver4", "-fma"),
    "sapphirerapids, 256 bits": ("sapphirerapids", "+prefer-256-bit"),
    "sapphirerapids, 512 bits": ("sapphirerapids", "-prefer-256-bit"),
}
# Those that differ most. Compiling takes ten seconds for each environment and target: here one
# environment of every system and kind gets one of the targets, and every target its share of them.
AT_EVERY_PUSH = (
    *("nehalem", "haswell", "haswell, no FMA", "skylake-avx512, 256 bits"),
    *("skylake-avx512, 512 bits", "znver4, 512 bits", "sapphirerapids, 512 bits"),
)


def environment(target: str, cache: Path) -> dict[str, str]:
    """Environment variables that make Numba compile for a target."""
    name, changes = TARGETS[target]
    host = binding.get_host_cpu_features()
    features = [f"-{feature}" for feature, here in host.items() if not here]
    variables = {
        "NUMBA_CPU_NAME": name,
        "NUMBA_CPU_FEATURES": ",".join([*features, *filter(None, [changes])]),
        "NUMBA_CACHE_DIR": str(cache),
    }
    if not has_fma(target):
        variables["GLIBC_TUNABLES"] = "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2"
    return os.environ | variables


def has_fma(target: str) -> bool:
    name, changes = TARGETS[target]
    return name != "nehalem" and changes != "-fma" and binding.get_host_cpu_features()["fma"]


def report(target: str, ids: list[str], cache: Path) -> dict:
    """What `fingerprint` prints when it is compiled for a target; kernels of old code are removed.

    Every target has a cache folder of its own, kept between runs.
    """
    for old in cache.glob("rigid-envs/*"):
        if old.name != kernel_hash():
            shutil.rmtree(old)
    done = subprocess.run(
        [sys.executable, "-m", "tests.kernels.fingerprint", str(cache), *ids],
        cwd=ROOT,
        env=environment(target, cache),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{target}: {done.stderr}"
    return json.loads(done.stdout)


def check(shares: dict[str, list[str]], cache: Path) -> None:
    """Two targets at a time; all must agree with this machine, and call nothing they may not."""
    folders = [cache / target.replace(", ", "-").replace(" ", "-") for target in shares]
    with ThreadPoolExecutor(2) as pool:
        reports = list(pool.map(report, shares, shares.values(), folders))
    for (target, ids), found in zip(shares.items(), reports, strict=True):
        for env_id in ids:
            assert found["hashes"][env_id] == hashes_of(env_id), f"{env_id} differs on {target}"
        assert found["networks"] == hash_of_networks(), f"networks differ on {target}"
        # Also a proof that the emulation works: fma is called exactly where there is none.
        assert found["symbols"] == ([] if has_fma(target) else ["fma"]), target


def models() -> list[str]:
    """The first environment of each system and kind of action and observation."""
    kinds: dict[object, str] = {}
    for env_id in IDS:
        task = task_of(env_id)
        kinds.setdefault((task.system_type, task.n_choices > 0, task.n_goal > 0), env_id)
    return list(kinds.values())


def dealt() -> dict[str, list[str]]:
    """Some of the models for each target, and a target for each of them."""
    step = len(AT_EVERY_PUSH)
    return {target: models()[k::step] for k, target in enumerate(AT_EVERY_PUSH)}


@pytest.mark.push
@pytest.mark.long  # it compiles for a minute and a half
def test_same_bits_without_libm_on_different_processors(pytestconfig: pytest.Config) -> None:
    shares = dealt()
    assert all(shares.values())
    check(shares, pytestconfig.cache.mkdir("cpu_targets"))


@pytest.mark.long
def test_same_bits_without_libm_on_eleven_processors(pytestconfig: pytest.Config) -> None:
    assert len(TARGETS) == 11
    check({target: list(IDS) for target in TARGETS}, pytestconfig.cache.mkdir("cpu_targets"))
