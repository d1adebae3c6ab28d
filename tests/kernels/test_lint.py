"""What compiled code is made of: no fastmath, and of mathematics only what IEEE 754 rounds once."""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import rigid_envs
from rigid_envs.engine.compiler import cache_directory, compiled_sources
from tests.kernels.fingerprint import foreign_symbols
from tests.systems.examples import SYSTEMS

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


def offences(source: str) -> list[str]:
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


def _nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes but those of yardsticks, which no step or reset looks at."""
    if not (isinstance(tree, ast.FunctionDef) and tree.name == "lower_bound"):
        yield tree
        for child in ast.iter_child_nodes(tree):
            yield from _nodes(child)


def _is_integer(node: ast.expr) -> bool:
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node = node.operand
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


def test_every_file_with_compiled_functions_is_one_of_the_compiled_sources() -> None:
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
    # Whether fma must be an instruction depends on the processor: see test_cpu_targets.
    assert foreign_symbols(folder) <= {"fma"}
