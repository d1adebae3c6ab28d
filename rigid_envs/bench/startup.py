"""Time from the import to the first step in a new process."""

import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import rigid_envs

__all__ = ["Startup", "seconds_told", "startup"]

_PROGRAM = """
import time
start = time.perf_counter()
import gymnasium
import rigid_envs
env = gymnasium.make({env_id!r})
env.reset(seed=0)
env.step(env.action_space.sample())
print(time.perf_counter() - start)
"""


@dataclass(frozen=True)
class Startup:
    """Times from the import to the first step, one for each new process.

    Attributes:
        env_id: the environment that takes the step.
        cold: with an empty kernel cache [s].
        warm: with the kernels in the cache [s].
    """

    env_id: str
    cold: tuple[float, ...]
    warm: tuple[float, ...]

    @property
    def medians(self) -> tuple[float, float]:
        """Medians of the cold and of the warm times [s]."""
        return statistics.median(self.cold), statistics.median(self.warm)


def startup(env_id: str, n_cold: int, n_warm: int) -> Startup:
    """Start processes one by one: cold ones, each with its own empty cache, then warm ones."""
    with tempfile.TemporaryDirectory() as folder:
        cold = tuple(_seconds(env_id, f"{folder}/{k}") for k in range(n_cold))
        warm = tuple(_seconds(env_id, f"{folder}/0") for _ in range(n_warm))
    return Startup(env_id, cold, warm)


def _seconds(env_id: str, cache: str) -> float:
    return seconds_told(_PROGRAM.format(env_id=env_id), {"NUMBA_CACHE_DIR": cache})


def seconds_told(program: str, environment: Mapping[str, str]) -> float:
    """The number that a program prints, run in a new process with this library.

    Args:
        program: source text.
        environment: variables that are added to those of this process.
    """
    root = str(Path(rigid_envs.__file__).resolve().parents[1])
    path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
    done = subprocess.run(
        [sys.executable, "-P", "-c", program],
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout)
