"""What is timed, in turns, in every form of environment; and what is computed of the samples."""

import json

import numpy as np
import pytest

from rigid_envs.tools.bench.accuracy import free_run, mujoco_settings, mujoco_workloads
from rigid_envs.tools.bench.measuring import (
    COLUMNS,
    Workload,
    costs,
    gymnasium_workloads,
    our_workloads,
    staggered,
    time_interleaved,
)
from tests.bench.examples import FIGURES

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


def test_workloads_take_turns_and_their_steps_are_counted() -> None:
    turns, now = [], [0.0]

    def workload(name: str, steps: int) -> Workload:
        def run(times: int) -> int:
            turns.append(name)
            now[0] += 1e-3 * times
            return steps * times

        return Workload(name, "made", run, lambda: now[0])

    slow, fast = time_interleaved([workload("slow", 1), workload("fast", 10)], 5, 2e-3)
    assert len(slow.samples) == len(fast.samples) == 5
    assert turns[-10:].count("slow") == turns[-10:].count("fast") == 5
    assert fast.ratio(slow) == pytest.approx([10.0] * 5)


def test_costs_are_compared_with_the_median_of_the_same_round() -> None:
    found = {cost.name: cost for cost in FIGURES.costs}
    assert list(found) == ["IntermediateAxis-v0", "SleepingTop-v0", "BallPark-v0"]
    assert found["SleepingTop-v0"].ratio == 1.0
    assert found["BallPark-v0"].ratio == pytest.approx((20 / 5 + 25 / 8) / 2)
    assert found["BallPark-v0"].seconds == pytest.approx((1 / 5e6 + 1 / 8e6) / 2)
    assert costs(FIGURES.speeds[:3]) == []  # too few


def test_ratios_are_of_the_same_round_and_to_the_peers_that_were_measured() -> None:
    found = {(r.name, r.form, r.peer): r.median for r in FIGURES.ratios}
    free_body, rows = "IntermediateAxis-v0", "CartPole-v1, NumPy"
    assert found == {
        (free_body, "single, made", "CartPole-v1"): pytest.approx(4.75),
        (free_body, "N = 4096", rows): pytest.approx(32 / 24),
        ("BallPark-v0", "N = 4096", rows): pytest.approx(6.5 / 24),
        ("SleepingTop-v0", "N = 4096", rows): pytest.approx(22.5 / 24),
        (free_body, "N = 4096, equal energy error", "MuJoCo RK4 x 4"): pytest.approx(800.0),
    }


def test_json_holds_every_sample() -> None:
    document = json.loads(json.dumps(FIGURES.as_json(), allow_nan=False))
    assert document["steps_per_second"][0]["samples"] == [900e3, 1000e3]
    assert document["mujoco"][0]["name"] == "MuJoCo RK4 x 4"
    assert document["ratios"][0]["peer"] == "CartPole-v1"
