"""Controllers are evaluated like policies, and a folder of results becomes a table and a plot."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigid_envs
from agents.cli.command_line import main
from agents.evaluation.leaderboard import markdown, read_results
from rigid_envs.scores import evaluate, from_controller, reference_controllers

ID = "RigidEnvs/Detumble-v0"
Capture = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("results")
    for name in ("reference", "brake", "random"):
        words = ["evaluate", "--controller", name, "--ids", ID, "--episodes", "20"]
        assert main([*words, "--out", str(out)]) == 0
    return out


def result(folder: Path, name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "Detumble-v0" / name / "results.json").read_text())
    return found


def test_a_result_has_metrics_scores_intervals_and_where_they_come_from(folder: Path) -> None:
    found = result(folder, "riccati")
    assert found["format"] == "rigid-envs result 1" and found["algo"] == "riccati"
    assert {"kernel_hash", "versions", "test_seed", "git_commit", "command"} <= found.keys()
    values = evaluate(ID, from_controller(reference_controllers(ID)["riccati"]), 20).values()
    assert found["primary"] == "return"
    for name, metric in found["metrics"].items():
        assert metric["mean"] == values[name].mean()
        low, high = metric["interval_95"]
        assert low <= metric["mean"] <= high
        score = found["scores"][name]
        assert score["score"] == rigid_envs.score(ID, name)(metric["mean"])
        assert score["interval_95"][0] <= score["score"] <= score["interval_95"][1]


def test_the_random_policy_is_what_every_result_is_set_beside(folder: Path) -> None:
    found = result(folder, "random")
    assert found["policy"] == found["random_policy"] == result(folder, "brake")["random_policy"]


def test_the_best_score_comes_first_and_the_plot_is_there(folder: Path, capsys: Capture) -> None:
    assert main(["leaderboard", str(folder)]) == 0
    assert [r["algo"] for r in read_results(folder)] == ["riccati", "brake", "random"]
    text = (folder / "leaderboard.md").read_text()
    assert text in capsys.readouterr().out
    rows = [line for line in text.splitlines() if line.startswith("| `Detumble-v0`")]
    assert len(rows) == 3 and "exact" in rows[0]
    assert {row.replace("\\|", "").count("|") for row in rows} == {11}
    assert (folder / "leaderboard.png").read_bytes().startswith(b"\x89PNG")


def test_a_result_without_scores_has_its_row(folder: Path) -> None:
    found = [r | {"scores": {}} for r in read_results(folder)]
    assert "| - | - | - |" in markdown(found)


def test_all_takes_the_ids_that_have_the_controller(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["evaluate", "--controller", "riccati", "--all", "--episodes", "2"]
    assert main([*words, "--out", str(tmp_path)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["Detumble-v0"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "expected a run or policy, or --controller NAME"),
        (["run", "--controller", "lqr"], "expected a run or policy, or --controller NAME"),
        (["run", "--all"], "expected none beside a policy"),
        (["--controller", "lqr"], "expected --ids ID ... or --all"),
        (["--controller", "lqr", "--ids", ID], "controller = 'lqr'; expected one of"),
        (["--controller", "pid", "--all"], "controller = 'pid'; expected one that some id has"),
    ],
)
def test_what_makes_no_sense_is_refused(words: list[str], message: str, capsys: Capture) -> None:
    assert main(["evaluate", *words]) == 2
    assert message in capsys.readouterr().err


def test_a_folder_without_results_is_refused(tmp_path: Path, capsys: Capture) -> None:
    assert main(["leaderboard", str(tmp_path)]) == 2
    assert "expected a results.json" in capsys.readouterr().err


def test_intervals_shrink_with_the_number_of_starts(folder: Path, tmp_path: Path) -> None:
    words = ["evaluate", "--controller", "riccati", "--ids", ID, "--episodes", "320"]
    assert main([*words, "--out", str(tmp_path)]) == 0
    few, many = (result(f, "riccati")["metrics"]["return"]["interval_95"]
                 for f in (folder, tmp_path))  # fmt: skip
    # 16 times as many starts: a quarter of the width, within what 20 starts know of a deviation
    assert 2.5 < np.diff(few)[0] / np.diff(many)[0] < 6.5
