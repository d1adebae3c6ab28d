"""What is timed: whole episodes, rows out of phase, every form of every kind of environment."""

import numpy as np
import pytest

from rigid_envs.tools.bench.accuracy import free_run, mujoco_settings, mujoco_workloads
from rigid_envs.tools.bench.measuring import (
    COLUMNS,
    gymnasium_workloads,
    our_workloads,
    staggered,
    time_interleaved,
)

KINDS = ["RigidEnvs/IntermediateAxis-v0", "RigidEnvs/Reorient-v0", "RigidEnvs/BallGrid-v0"]
"""Numbers as actions, a goal beside the observation, choices as actions."""


def test_single_episodes_end_at_their_time_limit() -> None:
    made, bare, *_ = our_workloads(["RigidEnvs/IntermediateAxis-v0"])
    assert (made.column, bare.column) == ("made", "bare")
    assert made.run(3) == bare.run(3) == 900


def test_every_form_of_every_kind_of_environment_is_timed_beside_gymnasium() -> None:
    workloads = [*our_workloads(KINDS), *gymnasium_workloads()]
    forms = {(workload.name, workload.column) for workload in workloads}
    for env_id in KINDS:
        assert {(env_id.removeprefix("RigidEnvs/"), column) for column in COLUMNS} <= forms
    assert {("CartPole-v1", "made"), ("Pendulum-v1, sync", "256")} <= forms
    assert ("CartPole-v1, NumPy", "4096") in forms
    for throughput in time_interleaved(workloads, rounds=1, seconds=1e-4):
        assert throughput.median > 0.0


def test_rows_end_their_episodes_in_turn() -> None:
    envs = staggered("RigidEnvs/IntermediateAxis-v0", 600, 1)
    for _ in range(10):
        *_, truncated, _ = envs.step(np.zeros((600, 3), dtype=np.float32))
        assert np.count_nonzero(truncated) == 2


def test_mujoco_gets_the_fewest_substeps_that_reach_our_error() -> None:
    pytest.importorskip("mujoco")
    minute, long, euler = mujoco_settings()
    assert minute.errors.energy <= free_run(0.1, 60.0).energy
    assert long.errors.energy <= free_run(0.1, 6000.0).energy
    assert minute.n_substeps < long.n_substeps == euler.n_substeps
    for workload in mujoco_workloads([minute]):
        assert workload.run(1) == 4096
