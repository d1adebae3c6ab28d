"""Controllers are evaluated like policies, and their results are rows of the leaderboard."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigid_envs
from agents.cli.command_line import main
from rigid_envs.scores.records import read_evaluation

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


def test_a_result_has_success_efficiency_cost_and_where_they_come_from(folder: Path) -> None:
    found = result(folder, "brake")
    assert found["format"] == "rigid-envs result 3" and found["algo"] == "brake"
    assert {"kernel_hash", "versions", "test_seed", "git_commit", "command"} <= found.keys()
    again = rigid_envs.evaluate(ID, "brake", n=20)
    assert found["policy"] == again.summary() and again.summary()["efficiency"] < 0.9
    read = read_evaluation(folder / "Detumble-v0" / "brake" / "results.json")
    np.testing.assert_array_equal(read.efficiencies, again.efficiencies)


def test_the_random_policy_is_what_every_result_is_set_beside(folder: Path) -> None:
    found = result(folder, "random")
    assert found["policy"] == found["random_policy"] == result(folder, "brake")["random_policy"]


def test_results_are_ranked(folder: Path, capsys: Capture) -> None:
    assert main(["leaderboard", str(folder)]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| `Det")]
    assert [line.split(" | ")[1] for line in lines] == ["riccati", "brake", "random"]


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
