"""`rigid-envs bench`: how it measures, figures on a page and in JSON, and what it refuses."""

import json
import re

import numpy as np
import pytest

from rigid_envs.engine.provenance import provenance
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.bench import accuracy, measuring
from rigid_envs.tools.bench.figures import Figures, Startup
from rigid_envs.tools.cli import main
from rigid_envs.tools.cli.collecting import _speed, as_factor, as_text, as_time

_RUNS = [
    accuracy.FreeRun(0.05, 60.0, 9e-10, 1e-14, 5e-10, 3e-8),
    accuracy.FreeRun(0.05, 6e3, 9e-10, 7e-14, 1e-6, 3e-6),
]
FIGURES = Figures(
    rounds=2,
    seconds=0.02,
    speeds=[
        measuring.Throughput("IntermediateAxis-v0", "made", [900e3, 1000e3]),
        measuring.Throughput("IntermediateAxis-v0", "4096", [30e6, 34e6]),
        measuring.Throughput("SleepingTop-v0", "4096", [20e6, 25e6]),
        measuring.Throughput("BallPark-v0", "4096", [5e6, 8e6]),
        measuring.Throughput("CartPole-v1", "made", [200e3, 200e3]),
        measuring.Throughput("CartPole-v1, NumPy", "4096", [24e6, 24e6]),
        measuring.Throughput("MuJoCo RK4 x 4", "4096", [40e3, 40e3]),
    ],
    mujoco=[accuracy.MujocoSetting("RK4", 4, "our energy error over 6000 s", _RUNS[1])],
    runs=_RUNS,
    startups=[Startup("RigidEnvs/IntermediateAxis-v0", (6.0,), (0.7, 0.9, 0.8))],
)


KINDS = ["RigidEnvs/IntermediateAxis-v0", "RigidEnvs/Reorient-v0", "RigidEnvs/BallGrid-v0"]
"""Numbers as actions, a goal beside the observation, choices as actions."""


def test_single_episodes_end_at_their_time_limit():
    made, bare, *_ = measuring.our_workloads(["RigidEnvs/IntermediateAxis-v0"])
    assert (made.column, bare.column) == ("made", "bare")
    assert made.run(3) == bare.run(3) == 900


def test_every_form_of_every_kind_of_environment_is_timed_beside_gymnasium():
    workloads = [*measuring.our_workloads(KINDS), *measuring.gymnasium_workloads()]
    forms = {(workload.name, workload.column) for workload in workloads}
    for env_id in KINDS:
        assert {
            (env_id.removeprefix("RigidEnvs/"), column) for column in measuring.COLUMNS
        } <= forms
    assert {("CartPole-v1", "made"), ("Pendulum-v1, sync", "256")} <= forms
    assert ("CartPole-v1, NumPy", "4096") in forms
    for throughput in measuring.time_interleaved(workloads, rounds=1, seconds=1e-4):
        assert throughput.median > 0.0


def test_rows_end_their_episodes_in_turn():
    envs = measuring.staggered("RigidEnvs/IntermediateAxis-v0", 600, 1)
    for _ in range(10):
        *_, truncated, _ = envs.step(np.zeros((600, 3), dtype=np.float32))
        assert np.count_nonzero(truncated) == 2


def test_mujoco_gets_the_fewest_substeps_that_reach_our_error():
    pytest.importorskip("mujoco")
    minute, long, euler = accuracy.mujoco_settings()
    assert minute.errors.energy <= accuracy.free_run(0.1, 60.0).energy
    assert long.errors.energy <= accuracy.free_run(0.1, 6000.0).energy
    assert minute.n_substeps < long.n_substeps == euler.n_substeps
    for workload in accuracy.mujoco_workloads([minute]):
        assert workload.run(1) == 4096


def test_workloads_take_turns_and_their_steps_are_counted():
    turns, now = [], [0.0]

    def workload(name, steps):
        def run(times):
            turns.append(name)
            now[0] += 1e-3 * times
            return steps * times

        return measuring.Workload(name, "made", run, lambda: now[0])

    slow, fast = measuring.time_interleaved([workload("slow", 1), workload("fast", 10)], 5, 2e-3)
    assert len(slow.samples) == len(fast.samples) == 5
    assert turns[-10:].count("slow") == turns[-10:].count("fast") == 5
    assert fast.ratio(slow) == pytest.approx([10.0] * 5)


def test_costs_are_compared_with_the_median_of_the_same_round():
    found = {cost.name: cost for cost in FIGURES.costs}
    assert list(found) == ["IntermediateAxis-v0", "SleepingTop-v0", "BallPark-v0"]
    assert found["SleepingTop-v0"].ratio == 1.0
    assert found["BallPark-v0"].ratio == pytest.approx((20 / 5 + 25 / 8) / 2)
    assert found["BallPark-v0"].seconds == pytest.approx((1 / 5e6 + 1 / 8e6) / 2)
    assert measuring.costs(FIGURES.speeds[:3]) == []  # too few


def test_ratios_are_of_the_same_round_and_to_the_peers_that_were_measured():
    found = {(r.name, r.form, r.peer): r.median for r in FIGURES.ratios}
    free_body, rows = "IntermediateAxis-v0", "CartPole-v1, NumPy"
    assert found == {
        (free_body, "single, made", "CartPole-v1"): pytest.approx(4.75),
        (free_body, "N = 4096", rows): pytest.approx(32 / 24),
        ("BallPark-v0", "N = 4096", rows): pytest.approx(6.5 / 24),
        ("SleepingTop-v0", "N = 4096", rows): pytest.approx(22.5 / 24),
        (free_body, "N = 4096, equal energy error", "MuJoCo RK4 x 4"): pytest.approx(800.0),
    }


def test_json_holds_every_sample():
    document = json.loads(json.dumps(FIGURES.as_json(), allow_nan=False))
    assert document["steps_per_second"][0]["samples"] == [900e3, 1000e3]
    assert document["mujoco"][0]["name"] == "MuJoCo RK4 x 4"
    assert document["ratios"][0]["peer"] == "CartPole-v1"


def test_the_report_fits_a_page_and_names_the_peers():
    text = as_text(provenance(), FIGURES)
    assert max(map(len, text.splitlines())) <= 100
    assert re.search("^Environment steps per second", text, re.MULTILINE)
    assert re.search(r"^IntermediateAxis-v0 +950k", text, re.MULTILINE)
    assert re.search(r"^MuJoCo RK4 x 4 +40k", text, re.MULTILINE)
    assert re.search(r"^BallPark-v0 +162\.5 ns +3\.56$", text, re.MULTILINE)
    assert re.search(r"^IntermediateAxis-v0 +single, made +CartPole-v1 +4\.75 x ", text, re.M)
    assert re.search(r"^6000 s in steps of 0\.05 s +7\.0e-14 +9\.0e-10 +1\.0e-06$", text, re.M)
    assert re.search(r"^RigidEnvs/IntermediateAxis-v0 +0\.80 s +6\.00 s$", text, re.MULTILINE)
    assert not re.search("goal|target|met", text)  # an installed user has no targets
    alone = as_text(provenance(), FIGURES._replace(speeds=FIGURES.speeds[:1], mujoco=()))
    for header in ("substeps per control period", "time of  ", "speed of  "):  # of what there is
        assert f"\n{header}" in text and header not in alone


def test_three_digits_are_shown_and_the_unit_that_they_need():
    speeds = [
        measuring.Throughput("", "", [each, each])
        for each in (40e3, 999.4e3, 999.5e3, 1.234e6, 12e6)
    ]
    assert [_speed(each).split()[0] for each in speeds] == ["40k", "999k", "1M", "1.23M", "12M"]
    assert [as_time(each) for each in (45.64e-9, 999.9e-9, 1e-6, 1.234e-6)] == [
        *("45.6 ns", "999.9 ns", "1.00 us", "1.23 us")
    ]
    factors = [as_factor(each) for each in (0.1234, 4.75, 999.4, 999.5, 12345.6)]
    assert factors == ["0.123 x", "4.75 x", "999 x", "1000 x", "12346 x"]


@pytest.mark.parametrize(
    ("quick", "started"), [([], ["BallPark", "BallGrid"]), (["--quick"], ["BallPark"])]
)
def test_start_up_is_measured_of_each_kind_of_task_and_in_a_quick_look_of_the_first(
    quick, started, tmp_path, monkeypatch
):
    asked = []

    def measured(*given):
        asked.append(given[:3])
        return FIGURES

    monkeypatch.setattr("rigid_envs.tools.bench.bench", measured)
    file, names = tmp_path / "bench.json", ["BallPark", "Detumble", "BallGrid"]
    words = ["--ids", *names, "BallPark", "--json", str(file)]
    assert main(["bench", *quick, *words]) == 0
    ids, starts = ([f"RigidEnvs/{name}-v0" for name in each] for each in (names, started))
    assert asked == [(ids, starts, bool(quick))]
    document = json.loads(file.read_text())
    assert {"versions", "cpu", "load"} <= document.pop("provenance").keys()
    assert document == json.loads(json.dumps(FIGURES.as_json()))


@pytest.mark.long
def test_everything_is_measured_and_written_down(capsys, tmp_path):
    file = tmp_path / "bench.json"
    env_id = next(iter(ENVIRONMENTS))
    assert main(["bench", "--quick", "--ids", env_id, "--json", str(file)]) == 0
    assert "import to first step" in capsys.readouterr().out
    document = json.loads(file.read_text())
    assert {len(row["samples"]) for row in document["steps_per_second"]} == {document["rounds"]}
    assert {"numpy", "numba", "gymnasium", "python"} <= set(document["provenance"]["versions"])
