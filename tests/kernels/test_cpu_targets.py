"""The same bits on any x86-64 processor, and no call to the C mathematics library.

Numba compiles for the processor it is told of, so one machine can stand for many: older ones
without FMA or AVX, newer ones with vectors of 256 or 512 bits. Features this machine lacks are
masked off. Where the target has no FMA, fma is the C library's, which rounds once like the
instruction; that library is then told to leave out its own FMA code too.
"""

import json
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from llvmlite import binding

from rigid_envs.kernels.compiler import kernel_hash

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
# Those that differ most, as many as fit into a minute and a half on two cores.
AT_EVERY_PUSH = (
    "nehalem",
    "haswell",
    "haswell, no FMA",
    "skylake-avx512, 256 bits",
    "skylake-avx512, 512 bits",
    "znver4, 512 bits",
    "sapphirerapids, 512 bits",
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


def report(target: str, cache: Path) -> dict:
    """What `fingerprint` prints when it is compiled for a target; kernels of old code are removed.

    Every target has a cache folder of its own, kept between runs.
    """
    for old in cache.glob("rigid-envs/*"):
        if old.name != kernel_hash():
            shutil.rmtree(old)
    done = subprocess.run(
        [sys.executable, "-m", "tests.kernels.fingerprint", str(cache)],
        cwd=ROOT,
        env=environment(target, cache),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{target}: {done.stderr}"
    return json.loads(done.stdout)


def check(targets: Iterable[str], cache: Path) -> None:
    """Two targets at a time; all must agree with the first, and call nothing they may not."""
    targets = list(targets)
    with ThreadPoolExecutor(2) as pool:
        folders = [cache / target.replace(", ", "-").replace(" ", "-") for target in targets]
        reports = dict(zip(targets, pool.map(report, targets, folders), strict=True))
    expected = reports[targets[0]]["hashes"]
    for target, found in reports.items():
        assert found["hashes"] == expected, f"{target} differs from {targets[0]}"
        # Also a proof that the emulation works: fma is called exactly where there is none.
        assert found["symbols"] == ([] if has_fma(target) else ["fma"]), target


def test_same_bits_without_libm_on_different_processors(pytestconfig: pytest.Config) -> None:
    check(AT_EVERY_PUSH, pytestconfig.cache.mkdir("cpu_targets"))


@pytest.mark.long
def test_same_bits_without_libm_on_eleven_processors(pytestconfig: pytest.Config) -> None:
    assert len(TARGETS) == 11
    check(TARGETS, pytestconfig.cache.mkdir("cpu_targets"))
