"""The loops over the rows of a step are vector instructions."""

import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

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
def test_the_arithmetic_of_a_step_is_packed(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, f"RigidEnvs/{name}-v0"],
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    found = Counter(ARITHMETIC.findall(done.stdout))
    # Each loop has a form for vectors and one for the last rows of a block, of as many
    # instructions. What is not packed: noise, networks of one row.
    assert found["pd"] > 0.5 * found["sd"] > 50, found
