"""The command `rigid-envs`: what it lists, describes, measures and refuses."""

import dataclasses
import json
import re
import subprocess
import sys
import time
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from rigid_envs import ENVIRONMENTS
from rigid_envs.catalogue import one_of_each
from rigid_envs.cli import main
from rigid_envs.cli.bench import Figures
from rigid_envs.cli.bench.accuracy import FreeRun, free_run
from rigid_envs.cli.bench.costs import costs
from rigid_envs.cli.bench.environments import (
    COLUMNS,
    gymnasium_contestants,
    our_contestants,
    staggered,
)
from rigid_envs.cli.bench.goals import goals
from rigid_envs.cli.bench.mujoco_body import Opponent, mujoco_contestants, opponents
from rigid_envs.cli.bench.race import Contestant, Result, race
from rigid_envs.cli.bench.startup import Startup
from rigid_envs.envs.boundary import info_keys
from rigid_envs.pages.describe import describe, example
from rigid_envs.pages.listing import size_of
from rigid_envs.pages.tables import table
from rigid_envs.provenance import provenance
from rigid_envs.tasks import Task

IDS = list(ENVIRONMENTS)
Capture = pytest.CaptureFixture[str]


def said(capsys: Capture, *words: str) -> str:
    """What a command that succeeds prints."""
    assert main(words) == 0
    return capsys.readouterr().out


def refused(capsys: Capture, *words: str) -> str:
    """The complaint of a command that makes no sense; it prints nothing else."""
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    return err


def task_of(env_id: str) -> Task:
    task: Task = gymnasium.make(env_id).unwrapped.task  # type: ignore[attr-defined]
    return task


def section(text: str, title: str) -> str:
    """The lines under a heading, up to the next one."""
    body = re.split(r"\n(?=[^\n]+\n=+\n)", text)
    (found,) = (part for part in body if part.startswith(title))
    return found


def test_list_shows_every_id_with_its_summary_limit_and_cost(capsys: Capture) -> None:
    text = said(capsys, "list")
    words = " ".join(text.split())
    for env_id in IDS:
        env, task = gymnasium.make(env_id), task_of(env_id)
        assert f"{env_id} {' '.join(str(type(task).__doc__).splitlines()[0].split())[:40]}" in words
        *_, row = (line for line in text.splitlines() if line.startswith(f"{env_id} "))
        for space in (env.action_space, env.observation_space):
            assert f" {size_of(space)} " in row
        assert f"{env.spec.max_episode_steps} x {task.dt:g} s" in row
        assert task.cost_unit.split()[0] in row


def test_size_of_a_space_is_told_in_few_words() -> None:
    box = spaces.Box(-1.0, 1.0, (3,))
    assert size_of(box) == "3"
    assert size_of(spaces.Discrete(4)) == "4 choices"
    parts = {"observation": box, "achieved_goal": box, "desired_goal": box}
    assert size_of(spaces.Dict(parts)) == "3, goal 3"


@pytest.mark.parametrize("env_id", IDS)
def test_description_names_every_entry_term_hyperparameter_and_info_key(
    capsys: Capture, env_id: str
) -> None:
    text, task = said(capsys, "describe", env_id), task_of(env_id)
    for entry in task.actions():
        assert entry.symbol in section(text, "Action")
    for entry in task.observations():
        assert entry.symbol in section(text, "Observation")
    for term in task.terms:
        assert re.search(rf"^  {term} ", section(text, "Reward"), re.MULTILINE)
    for field in dataclasses.fields(task):
        assert re.search(rf"^  {field.name} ", section(text, "Arguments"), re.MULTILINE)
    for key in info_keys(task):
        assert key in section(text, "Info")
    assert f"{ENVIRONMENTS[env_id].max_episode_steps} steps" in section(text, "Episode")


@pytest.mark.parametrize("env_id", IDS)
def test_lines_fit_a_page_of_100_columns(capsys: Capture, env_id: str) -> None:
    for text in (said(capsys, "list"), said(capsys, "describe", env_id)):
        assert max(map(len, text.splitlines())) <= 100


@pytest.mark.parametrize("env_id", IDS)
def test_example_of_a_description_runs(capsys: Capture, env_id: str) -> None:
    for config in ({}, {"observe_params": True, "observation_noise": (0.0, 0.1)}):
        exec(example(env_id, config), {})
        assert "is_success" in capsys.readouterr().out


def test_description_tells_choices_and_goals() -> None:
    for env_id in IDS:
        text, task = describe(env_id, {}), task_of(env_id)
        assert (f"one of {task.n_choices} choices" in text) == bool(task.n_choices)
        assert ("achieved_goal and desired_goal" in text) == bool(task.n_goal)
        n_rows = len(re.findall(r"^ +\d+  ", section(text, "Observation"), re.MULTILINE))
        assert n_rows == len(task.observations()) - task.n_goal  # the two goals are alike


def test_description_takes_hyperparameters(capsys: Capture) -> None:
    words = ("--I1", "1,1.4", "--observe_params=true", "--weight_effort", "-0.25")
    text = said(capsys, "describe", "RigidEnvs/IntermediateAxis-v0", *words)
    assert re.search(r"3 +I1 +kg m\^2 +drawn +1 +1\.4", section(text, "Observation"))
    assert re.search(r"effort +-0\.25", section(text, "Reward"))
    assert re.search(r"I1 +\(1, 1\.4\) +1 ", section(text, "Arguments"))
    assert "'I1': (1, 1.4)" in section(text, "Example")


@pytest.mark.parametrize("word", ["BalPark", "rigidenvs/ballpark-v0", "RigidEnvs/BallPark-v7"])
def test_unknown_id_is_refused_with_the_nearest_one(capsys: Capture, word: str) -> None:
    assert "did you mean 'RigidEnvs/BallPark-v0'" in refused(capsys, "describe", word)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--radiu", "2"], "config.radiu: unknown key; did you mean 'radius'?"),
        (
            ["--radius", "-2"],
            "config.radius: -2 is not allowed; expected a number in [1e-09, 1e+06]",
        ),
        (["--rotation", "angles"], "config.rotation: 'angles' is not allowed; expected one of"),
        (["--radius"], "cannot read '--radius'; expected --KEY VALUE"),
        (["radius", "2"], "cannot read 'radius'"),
    ],
)
def test_wrong_hyperparameters_are_refused_by_name(
    capsys: Capture, words: list[str], complaint: str
) -> None:
    assert complaint in refused(capsys, "describe", "RigidEnvs/BallPark-v0", *words)


def test_unknown_option_and_missing_verb_are_refused(capsys: Capture) -> None:
    assert "'--all'" in refused(capsys, "list", "--all")
    with pytest.raises(SystemExit, match="2"):
        main([])


def test_command_survives_a_reader_that_stops_reading() -> None:
    command = f"{sys.executable} -m rigid_envs.cli describe {IDS[0]} | head -1"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, IDS[0], "")


def test_long_cells_are_wrapped_and_columns_stay_aligned() -> None:
    text = table(("key", "meaning"), [("a", "word " * 30), ("bb", "short")], indent=0, width=40)
    lines = text.splitlines()
    assert max(map(len, lines)) <= 40
    assert {line[:5].strip() for line in lines} == {"key", "---", "a", "", "bb"}
    assert all(line[5] != " " for line in lines)


def test_what_has_no_blank_is_wrapped_last() -> None:
    rows = [("RigidEnvs/IntermediateAxisRandom-v0", "word " * 9)]
    lines = table(("id", "meaning"), rows, indent=0, width=50).splitlines()
    assert max(map(len, lines)) <= 50
    assert rows[0][0] in lines[2]
    narrow = table(("id", "meaning"), rows, indent=0, width=40).splitlines()
    assert max(map(len, narrow)) <= 40


def test_race_takes_turns_and_counts_steps() -> None:
    turns: list[str] = []

    def contestant(name: str, steps: int) -> Contestant:
        def burst(times: int) -> int:
            turns.append(name)
            time.sleep(1e-3 * times)
            return steps * times

        return Contestant(name, "made", burst, time.perf_counter)

    slow, fast = race([contestant("slow", 1), contestant("fast", 10)], rounds=5, seconds=2e-3)
    assert len(slow.samples) == len(fast.samples) == 5
    assert turns[-10:].count("slow") == turns[-10:].count("fast") == 5
    assert np.median(fast.ratio(slow)) == pytest.approx(10.0, rel=0.5)


def test_single_episodes_in_the_bench_end_at_their_time_limit() -> None:
    made, bare, *_ = our_contestants(["RigidEnvs/IntermediateAxis-v0"])
    assert (made.column, bare.column) == ("made", "bare")
    assert made.burst(3) == bare.burst(3) == 900


def test_one_of_each_has_numbers_choices_and_goals() -> None:
    chosen = [task_of(env_id) for env_id in one_of_each()]
    assert [(bool(task.n_choices), bool(task.n_goal)) for task in chosen] == [
        (False, False),
        (False, True),
        (True, False),
    ]
    assert one_of_each(IDS[1:3]) == [IDS[1]]


def test_every_form_of_every_kind_of_environment_races_beside_gymnasium() -> None:
    contestants = [*our_contestants(one_of_each()), *gymnasium_contestants()]
    forms = {(c.name, c.column) for c in contestants}
    for env_id in one_of_each():
        assert {(env_id.removeprefix("RigidEnvs/"), column) for column in COLUMNS} <= forms
    assert {("CartPole-v1", "made"), ("Pendulum-v1, sync", "256")} <= forms
    assert ("CartPole-v1, NumPy", "4096") in forms
    for result in race(contestants, rounds=1, seconds=1e-4):
        assert result.median > 0.0


def test_rows_in_the_bench_end_in_turn() -> None:
    envs = staggered("RigidEnvs/IntermediateAxis-v0", 600, 1)
    for _ in range(10):
        *_, truncated, _ = envs.step(np.zeros((600, 3), dtype=np.float32))
        assert np.count_nonzero(truncated) == 2


def test_free_body_is_as_exact_as_promised() -> None:
    minute, long = free_run(0.05, 60.0), free_run(0.05, 6000.0)
    assert long.L_squared <= 2e-13
    assert long.energy <= 2e-9
    assert minute.omega_end <= 2e-9
    assert long.omega_end <= 2e-7


def test_mujoco_gets_as_few_substeps_as_give_our_error() -> None:
    pytest.importorskip("mujoco")
    minute, long, euler = opponents()
    assert minute.errors.energy <= free_run(0.1, 60.0).energy
    assert long.errors.energy <= free_run(0.1, 6000.0).energy
    assert minute.n_substeps < long.n_substeps == euler.n_substeps
    for contestant in mujoco_contestants([minute]):
        assert contestant.burst(1) == 4096


def figures() -> Figures:
    """Figures that somebody could have measured."""
    results = [
        Result("IntermediateAxis-v0", "made", [900e3, 1000e3]),
        Result("IntermediateAxis-v0", "4096", [30e6, 34e6]),
        Result("SleepingTop-v0", "4096", [20e6, 25e6]),
        Result("BallPark-v0", "4096", [5e6, 8e6]),
        Result("CartPole-v1", "made", [200e3, 200e3]),
        Result("CartPole-v1, NumPy", "4096", [24e6, 24e6]),
        Result("MuJoCo RK4 x 4", "4096", [40e3, 40e3]),
    ]
    runs = [
        FreeRun(0.05, 60.0, 9e-10, 1e-14, 5e-10, 3e-8),
        FreeRun(0.05, 6e3, 9e-10, 7e-14, 1e-6, 3e-6),
    ]
    rivals = [Opponent("RK4", 4, "our energy error over 6000 s", runs[1])]
    starts = [Startup(IDS[0], (6.0,), (0.7, 0.9, 0.8))]
    compared = costs(results)
    found = goals(results, rivals, compared, runs, starts)
    return Figures(provenance(), 2, 0.02, results, rivals, compared, runs, starts, found)


def test_costs_are_compared_with_the_median_of_the_same_round() -> None:
    found = {cost.name: cost for cost in figures().costs}
    assert list(found) == ["IntermediateAxis-v0", "SleepingTop-v0", "BallPark-v0"]
    assert found["SleepingTop-v0"].ratio == 1.0
    assert found["BallPark-v0"].ratio == pytest.approx((20 / 5 + 25 / 8) / 2)
    assert found["BallPark-v0"].seconds == pytest.approx((1 / 5e6 + 1 / 8e6) / 2)
    assert costs(figures().results[:3]) == []  # too few


def test_goals_are_ratios_of_the_same_round_with_their_verdict() -> None:
    verdicts = {goal.text: (goal.value, goal.is_met) for goal in figures().goals}
    assert verdicts["single, made, against CartPole-v1"] == (pytest.approx(4.75), True)
    assert verdicts["N = 4096, against CartPole-v1, NumPy"] == (pytest.approx(32 / 24), False)
    dearest = "dearest row of 4096 (BallPark-v0) against the median"
    assert verdicts[dearest] == (pytest.approx(3.5625), False)
    assert verdicts["import to first step, compiled before"] == (0.8, True)
    assert verdicts["import to first step, empty cache"] == (6.0, False)
    assert [text for text in verdicts if "MuJoCo RK4 x 4" in text]
    assert not [text for text in verdicts if "N = 16" in text]  # was not measured


def test_report_fits_a_page_and_json_holds_every_sample() -> None:
    found = figures()
    text = found.as_text()
    assert max(map(len, text.splitlines())) <= 100
    assert re.search(r"^IntermediateAxis-v0 +950k", text, re.MULTILINE)
    assert re.search(r"^MuJoCo RK4 x 4 +40k", text, re.MULTILINE)
    assert re.search(r"^BallPark-v0 +162\.5 ns +3\.56$", text, re.MULTILINE)
    document = json.loads(json.dumps(found.as_json(), allow_nan=False))
    assert document["steps_per_second"][0]["samples"] == [900e3, 1000e3]
    assert {"numpy", "numba", "gymnasium", "python"} <= set(document["provenance"]["versions"])
    assert document["goals"][0]["is_met"] is True


def test_bench_refuses_unknown_ids_and_a_missing_folder(capsys: Capture, tmp_path: Path) -> None:
    assert "did you mean 'RigidEnvs/BallPark-v0'" in refused(capsys, "bench", "--ids", "BallPark")
    file = tmp_path / "nowhere" / "bench.json"
    assert f"no folder {file.parent}" in refused(capsys, "bench", "--json", str(file))


@pytest.mark.long
def test_bench_measures_everything_and_writes_it_down(capsys: Capture, tmp_path: Path) -> None:
    file = tmp_path / "bench.json"
    text = said(capsys, "bench", "--quick", "--ids", IDS[0], "--json", str(file))
    assert "import to first step" in text
    document = json.loads(file.read_text())
    assert {len(row["samples"]) for row in document["steps_per_second"]} == {document["rounds"]}
