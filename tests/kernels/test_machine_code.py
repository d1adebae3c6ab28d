"""Machine code: no fastmath, exactly rounded operations, packed, the same bits everywhere."""

import ast
import json
import platform
import re
import shutil
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from llvmlite import binding

import rigid_envs
from rigid_envs.engine.compiler import cache_directory, compiled_sources, kernel_hash
from rigid_envs.testing.environments import IDS, task_of
from tests.kernels.fingerprint import foreign_symbols, hash_of_networks, hashes_of
from tests.programs import printed
from tests.systems.examples import SYSTEMS

# What compiled code is made of: no fastmath, and of mathematics only what IEEE 754 rounds once.


PACKAGE = Path(rigid_envs.__file__).parent
COMPILED = [path for path in compiled_sources() if path.parent.name != "watch"]  # pictures
# Correctly rounded by IEEE 754, or exact: the same bits everywhere.
EXACT = {"ceil", "copysign", "fabs", "floor", "fma", "isfinite", "isinf", "isnan", "sqrt", "trunc"}
CONSTANTS = {"e", "inf", "nan", "pi", "tau"}
# Of NumPy, which also makes arrays, what goes to the C mathematics library when it is compiled.
ROUNDED = set(
    "sin cos tan arcsin arccos arctan arctan2 asin acos atan atan2 sinh cosh tanh arcsinh arccosh "
    "arctanh asinh acosh atanh exp exp2 expm1 log log2 log10 log1p logaddexp logaddexp2 power pow "
    "float_power hypot cbrt linalg deg2rad rad2deg sinc i0 mean std var sum dot matmul".split()
)


def offences(source):
    """Lines that break the rule, as ``line: what``."""
    found = []
    for node in _nodes(ast.parse(source)):
        match node:
            case ast.keyword(arg="fastmath"):
                found.append((node.value.lineno, "fastmath"))
            case ast.Attribute(value=ast.Name(id="math"), attr=name):
                if name not in EXACT | CONSTANTS:
                    found.append((node.lineno, f"math.{name}"))
            case ast.Attribute(value=ast.Name(id="np" | "numpy"), attr=name):
                if name in ROUNDED:
                    found.append((node.lineno, f"np.{name}"))
            case ast.ImportFrom(module="math" | "cmath" | "numpy"):
                for name in node.names:
                    if name.name not in EXACT | CONSTANTS:
                        found.append((node.lineno, f"from {node.module} import {name.name}"))
            case ast.Import():
                for name in node.names:
                    if name.name in ("cmath", "scipy"):
                        found.append((node.lineno, name.name))
            case ast.BinOp(op=ast.Pow(), right=power) if not _is_integer(power):
                found.append((node.lineno, "**"))
    return [f"{line}: {what}" for line, what in found]


def _nodes(tree):
    """All nodes but those of yardsticks, which no step or reset looks at."""
    if not (isinstance(tree, ast.FunctionDef) and tree.name == "lower_bound"):
        yield tree
        for child in ast.iter_child_nodes(tree):
            yield from _nodes(child)


def _is_integer(node):
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node = node.operand
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


def test_every_file_with_compiled_functions_is_one_of_the_compiled_sources():
    compiles = re.compile(r"^@(instruction|kernel|phase|routine|scalar)\b|\bkernel\(", re.MULTILINE)
    files = [path for path in PACKAGE.rglob("*.py") if not path.name.startswith("test_")]
    compiling = {path for path in files if compiles.search(path.read_text("utf-8"))}
    assert compiling <= {*compiled_sources()}


@pytest.mark.parametrize("path", COMPILED, ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_compiled_sources_use_exactly_rounded_operations_only(path):
    assert offences(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "source",
    [
        "import math\nmath.sin(1.0)",
        "import numpy as np\nnp.exp(1.0)",
        "from math import atan2",
        "from numpy import hypot",
        "import cmath",
        "njit(fastmath=True)(f)",
        "x ** 0.5",
        "x ** y",
    ],
)
def test_the_lint_finds_what_it_looks_for(source):
    assert offences(source)


@pytest.mark.parametrize("source", ["import math\nmath.sqrt(2.0) + math.pi", "x**2 + x**-1"])
def test_the_lint_lets_exact_operations_pass(source):
    assert not offences(source)


@pytest.mark.skipif(sys.platform != "linux", reason="reads ELF objects")
def test_the_systems_kernels_call_no_mathematics_library():
    for system in SYSTEMS:
        y = system.state()
        system.rhs(y), system.linearize(y), system.invariants(y), system.advance(y, None, 0.01)
    folder = cache_directory()
    if folder is None:
        pytest.skip("compiled code is not kept on this machine")
    kept = {path.name.partition("-")[0] for path in folder.rglob("*.nbc")}
    for system in SYSTEMS:
        module = system.dynamics.step.__module__
        assert {f"{module}.{verb}_rows" for verb in ("evaluate", "measure", "simulate")} <= kept
    # The folder may hold kernels of files that other checkouts have beside the same sources.
    known = [".".join(("rigid_envs", *path.relative_to(PACKAGE).with_suffix("").parts))
             for path in compiled_sources()]  # fmt: skip
    # Whether fma must be an instruction depends on the processor: see `has_fma`.
    assert foreign_symbols(folder, tuple(f"{module}." for module in known)) <= {"fma"}


# The loops over the rows of a step are vector instructions.


# The machine code of a step is known in the process that compiles it only.
PROGRAM = """
import sys
import rigid_envs
from rigid_envs.tasks.core import Core
from rigid_envs.testing.environments import task_of
from rigid_envs.engine.compiler import compiled_for

step = task_of(sys.argv[1]).compiled.step
Core(task_of(sys.argv[1]), 64).step_into
print(*(found.library.get_asm_str() for found in step.overloads.values()))
"""
ARITHMETIC = re.compile(r"^\s+v?(?:add|sub|mul|div|sqrt|fn?m(?:add|sub)\d*)(pd|sd)\s", re.MULTILINE)


@pytest.mark.long
@pytest.mark.parametrize("name", ["IntermediateAxis", "BallPark", "SleepingTop", "DiskRoll"])
def test_the_arithmetic_of_a_step_is_packed(name, tmp_path):
    code = printed("-c", PROGRAM, f"RigidEnvs/{name}-v0", NUMBA_CACHE_DIR=str(tmp_path))
    found = Counter(ARITHMETIC.findall(code))
    # Each loop has a form for vectors and one for the last rows of a block, of as many
    # instructions. What is not packed: noise, networks of one row.
    assert found["pd"] > 0.5 * found["sd"] > 50, found


# The same bits on any x86-64 processor, and no call to the C mathematics library.
#
# Numba compiles for the processor it is told of, so one machine can stand for many: older ones
# without FMA or AVX, newer ones with vectors of 256 or 512 bits. Features this machine lacks are
# masked off. Where the target has no FMA, fma is the C library's, which rounds once like the
# instruction; that library is then told to leave out its own FMA code too.
#
# What all must agree with is computed here, on this machine as it is. The networks of policies are
# compiled for each of them too.


ROOT = Path(__file__).parents[2]

emulated = pytest.mark.skipif(
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


def environment(target, cache):
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
    return variables


def has_fma(target):
    name, changes = TARGETS[target]
    return name != "nehalem" and changes != "-fma" and binding.get_host_cpu_features()["fma"]


def report(target, ids, cache):
    """What `fingerprint` prints when it is compiled for a target; kernels of old code are removed.

    Every target has a cache folder of its own, kept between runs.
    """
    for old in cache.glob("rigid-envs/*"):
        if old.name != kernel_hash():
            shutil.rmtree(old)
    words = ("-m", "tests.kernels.fingerprint", cache, *ids)
    return json.loads(printed(*words, cwd=ROOT, **environment(target, cache)))


def check(shares, cache):
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


def models():
    """The first environment of each system and kind of action and observation."""
    kinds = {}
    for env_id in IDS:
        task = task_of(env_id)
        kinds.setdefault((task.system_type, task.n_choices > 0, task.n_goal > 0), env_id)
    return list(kinds.values())


def dealt():
    """Some of the models for each target, and a target for each of them."""
    step = len(AT_EVERY_PUSH)
    return {target: models()[k::step] for k, target in enumerate(AT_EVERY_PUSH)}


@emulated
@pytest.mark.push
@pytest.mark.long  # it compiles for a minute and a half
def test_same_bits_without_libm_on_different_processors(pytestconfig):
    shares = dealt()
    assert all(shares.values())
    check(shares, pytestconfig.cache.mkdir("cpu_targets"))


@emulated
@pytest.mark.long
def test_same_bits_without_libm_on_eleven_processors(pytestconfig):
    assert len(TARGETS) == 11
    check({target: list(IDS) for target in TARGETS}, pytestconfig.cache.mkdir("cpu_targets"))
