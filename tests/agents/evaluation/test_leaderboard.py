"""Controllers are evaluated like policies, and a folder of results becomes a table and a plot."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigid_envs
from agents.cli.command_line import main
from agents.evaluation.leaderboard import markdown, read_results
from agents.evaluation.plots import look
from agents.evaluation.rows import packaged_rows, row_of, sorted_rows
from rigid_envs import ENVIRONMENTS
from rigid_envs.files import DamagedFileError
from rigid_envs.policies import published
from rigid_envs.scores import read_evaluation
from rigid_envs.scores.published import published_record
from rigid_envs.scores.reading import evaluation_of

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
    assert found["format"] == "rigid-envs result 2" and found["algo"] == "brake"
    assert {"kernel_hash", "versions", "test_seed", "git_commit", "command"} <= found.keys()
    again = rigid_envs.evaluate(ID, "brake", n=20)
    assert found["policy"] == again.summary() and again.summary()["efficiency"] < 0.9
    read = read_evaluation(folder / "Detumble-v0" / "brake" / "results.json")
    np.testing.assert_array_equal(read.efficiencies, again.efficiencies)


def test_the_random_policy_is_what_every_result_is_set_beside(folder: Path) -> None:
    found = result(folder, "random")
    assert found["policy"] == found["random_policy"] == result(folder, "brake")["random_policy"]


def test_the_most_efficient_comes_first_and_the_plot_is_there(
    folder: Path, capsys: Capture
) -> None:
    rigid_envs.evaluate(ID, "zero", n=20).save(folder / "by an outsider.json")
    assert main(["leaderboard", str(folder)]) == 0
    rows = sorted_rows([row_of(each) for each in read_results(folder)])
    assert [row.policy for row in rows] == ["riccati", "brake", "random", "zero"]
    text = (folder / "leaderboard.md").read_text()
    assert text in capsys.readouterr().out
    lines = [line for line in text.splitlines() if line.startswith("| `Detumble-v0`")]
    assert len(lines) == 4 and "**1.000**" in lines[0] and "**0.000**" in lines[-1]
    assert {line.count("|") for line in lines} == {12}
    assert (folder / "leaderboard.png").read_bytes().startswith(b"\x89PNG")


def test_results_are_ranked_by_what_is_best_now_and_changed_ones_are_refused(
    folder: Path, tmp_path: Path
) -> None:
    row = result(folder, "brake")
    old = evaluation_of(row)
    costs = 0.5 * old.costs  # as if somebody had known better, once
    old.against(costs).save(tmp_path / "row.json")
    assert read_evaluation(tmp_path / "row.json").efficiency.mean == pytest.approx(0.5, abs=1e-3)
    assert read_results(tmp_path)[0].efficiency == old.efficiency
    row["policy"]["efficiency"] = 0.99
    (tmp_path / "row.json").write_text(json.dumps(row))
    with pytest.raises(DamagedFileError, match=r"efficiency = 0\.99; expected 0\.6"):
        read_results(tmp_path)


def test_several_seeds_are_aggregated_with_an_interval(folder: Path) -> None:
    found = [row_of(each)._replace(policy="ppo") for each in read_results(folder)]
    (line,) = [row for row in markdown(found).splitlines() if row.startswith("| ppo | 1 |")]
    assert " .. " in line


def test_what_comes_with_the_package_is_ranked_without_playing_it_again(tmp_path: Path) -> None:
    rows = {(row.env_id, row.policy): row for row in packaged_rows()}
    for env_id in ENVIRONMENTS:
        assert {(env_id, "zero"), (env_id, "random")} <= rows.keys()
    again = row_of(rigid_envs.evaluate(ID, "brake"))
    told = rows[ID, "brake"]
    assert told.success == again.success and told.cost == again.cost
    np.testing.assert_allclose(told.efficiency, again.efficiency, rtol=1e-9)
    np.testing.assert_allclose([*told.means, told.gap], [*again.means, again.gap], rtol=1e-9)
    for name in published():
        record = published_record(name)
        efficiency = rows[record.env_id, record.policy].efficiency
        assert efficiency is not None and efficiency.mean == record.efficiency
    assert main(["leaderboard", str(tmp_path), "--packaged"]) == 0


def test_the_page_of_the_repository_is_that_of_its_data() -> None:
    docs = Path(__file__).parents[3] / "docs"
    rows = sorted_rows([*map(row_of, read_results(docs)), *packaged_rows()])
    mend = "write it anew: python -m agents leaderboard docs --packaged"
    assert (docs / "leaderboard.md").read_text() == markdown(rows), mend


def test_no_two_of_forty_policies_look_the_same() -> None:
    assert len({look(k) for k in range(40)}) == 40


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
    assert "expected results below it" in capsys.readouterr().err
