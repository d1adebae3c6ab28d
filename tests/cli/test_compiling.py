"""`rigid-envs compile` leaves nothing to compile for later processes."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from rigid_envs.envs.lookup import compile_all, kernels_of
from rigid_envs.tools.cli import main
from tests.fixtures import Capture, Patch
from tests.programs import printed, python

STEP = """
import logging

logging.basicConfig(level="INFO")
import gymnasium, rigid_envs

env = gymnasium.make("RigidEnvs/BallGrid-v0")
env.reset(seed=0)
env.step(0)
"""


@pytest.mark.long
def test_later_processes_find_what_was_compiled(tmp_path: Path) -> None:
    words = "-m rigid_envs.tools.cli compile BallGrid --frame world --jobs 2"
    command = words.split()
    cache = {"NUMBA_CACHE_DIR": str(tmp_path)}
    assert printed(*command, **cache).startswith("2 kernels compiled in ")
    assert len(list(tmp_path.rglob("*.nbc"))) == 2
    step = python("-c", STEP, **cache)
    assert step.returncode == 0 and "compiled" not in step.stdout + step.stderr
    assert "0 kernels compiled in " in printed(*command, **cache)


def test_both_frames_are_compiled_and_the_rewards_of_goals() -> None:
    assert [(dict(kernel.config), kernel.part) for kernel in kernels_of("BallParkGoal")] == [
        (config, part)
        for config in ({}, {"frame": "reduced"})
        for part in ("step", "reset", "reward")
    ]
    assert [str(kernel) for kernel in kernels_of("BallPark", {"frame": "reduced"})] == [
        "BallPark-v0 step, frame = reduced",
        "BallPark-v0 reset, frame = reduced",
    ]


@pytest.mark.parametrize(("jobs", "started"), [(1, 1), (2, 2), (100, 3)])
def test_no_more_processes_are_started_than_asked_for_and_than_there_are_kernels(
    jobs: int, started: int, monkeypatch: Patch
) -> None:
    asked: list[int] = []

    def pool(count: int, context: Any) -> ThreadPoolExecutor:
        asked.append(count)
        return ThreadPoolExecutor(count)

    monkeypatch.setattr("rigid_envs.envs.lookup.ProcessPoolExecutor", pool)
    monkeypatch.setattr("rigid_envs.envs.lookup._compile", lambda kernel: True)
    kernels = kernels_of("BallParkGoal", {"frame": "world"})
    found = [str(kernel) for kernel, _ in compile_all(kernels, jobs)]
    assert sorted(found) == sorted(map(str, kernels))
    assert asked == [started]


def test_what_was_compiled_and_what_was_there_is_told(monkeypatch: Patch, capsys: Capture) -> None:
    asked: list[Any] = []

    def compiled(kernels: list[Any], jobs: int) -> list[tuple[str, bool]]:
        asked.append(([str(kernel) for kernel in kernels], jobs))
        return [("reset", True), ("step", False), ("reward", True)]

    monkeypatch.setattr("rigid_envs.envs.lookup.compile_all", compiled)
    assert main(["compile", "BallParkGoal", "BallParkGoal", "--frame", "world", "--jobs", "1"]) == 0
    parts = ("step", "reset", "reward")
    assert asked == [([f"BallParkGoal-v0 {part}, frame = world" for part in parts], 1)]
    said = capsys.readouterr().out
    assert said.startswith("1 kernels compiled in ") and ", 2 were there; in /" in said
