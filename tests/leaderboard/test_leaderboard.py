"""A folder of results becomes a table and a plot."""

import html
import json
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from markdown_it import MarkdownIt

import rigid_envs
from rigid_envs.base.files import DamagedFileError, write_document
from rigid_envs.scores import leaderboard
from rigid_envs.scores.evaluation import published_record
from rigid_envs.scores.records import read_evaluation, read_results
from rigid_envs.scores.trained import published
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main

ID = "RigidEnvs/Detumble-v0"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    made = tmp_path_factory.mktemp("results")
    for name in ("reference", "brake", "random", "zero"):
        out = str(made / f"{name}.json")
        assert main(["evaluate", ID, "--policy", name, "--out", out]) == 0
    return made


@pytest.fixture
def folder(tmp_path, results):
    shutil.copytree(results, tmp_path / "below")
    return tmp_path


@pytest.fixture(scope="module")
def packaged():
    return leaderboard.packaged_rows()


def result(folder, name):
    return json.loads((folder / "below" / f"{name}.json").read_text())


def test_the_most_efficient_comes_first_and_the_plot_is_there(folder, capsys):
    assert main(["leaderboard", str(folder)]) == 0
    rows = leaderboard.sorted_rows([leaderboard.row_of(each) for each in read_results(folder)])
    assert [row.policy for row in rows] == ["riccati", "brake", "random", "zero"]
    text = (folder / "leaderboard.md").read_text()
    assert text in capsys.readouterr().out
    lines = [line for line in text.splitlines() if line.startswith("| `Detumble-v0`")]
    assert len(lines) == 4 and "**1.000**" in lines[0] and "**0.000**" in lines[-1]
    assert {line.count("|") for line in lines} == {12}
    assert (folder / "leaderboard.png").read_bytes().startswith(b"\x89PNG")


def test_results_are_ranked_by_what_is_best_now_and_changed_ones_are_refused(results, tmp_path):
    old, file = read_evaluation(results / "brake.json"), tmp_path / "row.json"
    costs = 0.5 * old.costs  # as if somebody had known better, once
    old.against(costs).save(file)
    assert read_evaluation(file).efficiency.mean == pytest.approx(0.5, abs=1e-3)
    assert read_results(tmp_path)[0].efficiency == old.efficiency
    row = old.row()
    row["policy"]["efficiency"] = 0.99
    write_document(file, row)
    with pytest.raises(DamagedFileError, match=r"efficiency = 0\.99; expected 0\.6"):
        read_results(tmp_path)


@pytest.mark.parametrize("change", [{"format": "rigid-envs result 2"}, {"format": "rigid-enws"}])
def test_a_result_that_was_damaged_is_refused_and_not_left_out(tmp_path, change):
    file = rigid_envs.evaluate(ID, "zero", n=2).save(tmp_path / "row.json")
    row = json.loads(file.read_text())
    for damaged in (row | change, {key: row[key] for key in row.keys() - {"sha256"}}):
        file.write_text(json.dumps(damaged))
        with pytest.raises(DamagedFileError, match=r"row\.json: (format = |no sha256)"):
            read_results(tmp_path)
    file.write_text('{"name": "of another program"}')
    assert read_results(tmp_path) == []


def test_an_id_of_another_package_is_left_out(folder):
    row = result(folder, "zero") | {"env_id": "Other/Body-v0"}
    write_document(folder / "below" / "other.json", row)
    assert {found.env_id for found in read_results(folder)} == {ID}


def test_only_whole_sets_are_ranked_and_all_else_is_listed_apart(folder):
    below = folder / "below"
    easier = {"start_momentum": 0.5}
    others = {"lucky": {"n": 1}, "easy": {"config": easier}, "elsewhere": {"seed": 1}}
    for name, options in others.items():
        found = rigid_envs.evaluate(ID, "reference", name=name, **options)
        found.save(below / f"{name}.json")
    assert main(["leaderboard", str(folder)]) == 0
    ranked, apart = (folder / "leaderboard.md").read_text().split("## Not ranked")
    for name in others:
        assert f"| {name} |" not in ranked and f"| `Detumble-v0` | {name} | 100.0 % |" in apart
    assert "n = 1; expected all 500 starts" in apart
    assert "start_momentum = 0.5; expected 3.0, as registered" in apart
    assert "seed = 1; expected 314159" in apart
    assert ranked.count("| `Detumble-v0` |") == 4


def test_what_no_best_is_known_of_is_not_ranked(results):
    found = read_evaluation(results / "brake.json")
    assert leaderboard.row_of(found).unranked is None
    assert leaderboard.row_of(replace(found, best=None)).unranked == "no best is known"


def test_a_page_of_which_nothing_is_ranked_has_no_rank(tmp_path):
    rigid_envs.evaluate(ID, "zero", n=1).save(tmp_path / "row.json")
    assert main(["leaderboard", str(tmp_path)]) == 0
    assert "| zero |" not in (tmp_path / "leaderboard.md").read_text().split("## Not ranked")[0]


def test_a_row_is_not_believed_what_it_says_of_task_best_known_and_bound(results, tmp_path):
    honest, file = read_evaluation(results / "brake.json"), tmp_path / "row.json"
    generous = replace(honest, best=honest.costs, bounds=0.1 * honest.costs).save(file)
    (found,) = read_results(tmp_path)
    assert read_evaluation(generous).efficiency.mean == 1.0
    assert found.efficiency == honest.efficiency and found.gap == honest.gap
    replace(honest, config={"start_momentum": 0.5}).save(file)
    (found,) = read_results(tmp_path)
    assert found.efficiency is None and "start_momentum = 0.5" in (found.unranked or "")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (lambda it: {"values": it.values | {"loss": 0.9 * it.bounds}}, "the bound of theory"),
        (lambda it: {"cost": it.cost._replace(floor=1e9)}, r"cost = .*floor=1000000000\.0.*exp"),
    ],
    ids=["below the bound", "floor above all costs"],
)
def test_a_row_that_cannot_be_is_refused(results, tmp_path, changes, message):
    honest, file = read_evaluation(results / "brake.json"), tmp_path / "row.json"
    replace(honest, **changes(honest)).save(file)
    with pytest.raises(DamagedFileError, match=message):
        read_results(tmp_path)
    with pytest.raises(DamagedFileError, match=message):
        read_evaluation(file, anew=True)


def test_several_seeds_in_each_environment_are_aggregated_with_an_interval(folder):
    found = [leaderboard.row_of(each)._replace(policy="ppo") for each in read_results(folder)]
    for n, told in ((1, False), (2, True), (4, True)):
        page = leaderboard.markdown(found[:n]).splitlines()
        (line,) = [row for row in page if row.startswith(f"| ppo | 1 | {n} |")]
        assert (" .. " in line) == told
    alone = found[0]._replace(env_id="RigidEnvs/BallPark-v0")
    (line,) = [
        row
        for row in leaderboard.markdown([*found, alone]).splitlines()
        if row.startswith("| ppo | 2")
    ]
    assert line.startswith("| ppo | 2 | 5 |") and line.endswith("| - |")


def test_what_comes_with_the_package_is_ranked_without_playing_it_again(
    packaged, tmp_path, monkeypatch
):
    rows = {(row.env_id, row.policy): row for row in packaged}
    for env_id in ENVIRONMENTS:
        assert {(env_id, "zero"), (env_id, "random")} <= rows.keys()
    again = leaderboard.row_of(rigid_envs.evaluate(ID, "brake"))
    told = rows[ID, "brake"]
    assert told.cost == again.cost
    for key in again.figures.keys() & told.figures.keys():
        np.testing.assert_allclose(told.figures[key], again.figures[key], rtol=1e-9)
    for name in published():
        record = published_record(name)
        figures = rows[record.env_id, record.policy].figures
        assert figures["efficiency"] == record.evaluation.efficiencies.mean()
    monkeypatch.setattr(leaderboard, "packaged_rows", lambda: packaged)
    assert main(["leaderboard", str(tmp_path), "--packaged"]) == 0


def test_an_id_without_best_known_costs_has_no_rows_of_its_own(monkeypatch):
    monkeypatch.setattr("rigid_envs.scores.leaderboard.best_known", lambda env_id: None)
    assert [row.policy for row in leaderboard.packaged_rows()] == [
        published_record(name).policy for name in published()
    ]


def test_the_page_of_the_repository_is_that_of_its_data(packaged):
    docs = Path(__file__).parents[2] / "docs"
    rows = leaderboard.sorted_rows([*map(leaderboard.row_of, read_results(docs)), *packaged])
    mend = "write it anew: rigid-envs leaderboard docs --packaged"
    assert (docs / "leaderboard.md").read_text() == leaderboard.markdown(rows), mend


def test_no_two_of_forty_policies_look_the_same():
    assert len({leaderboard.look(k) for k in range(40)}) == 40


def test_a_file_that_is_no_json_is_named(folder, capsys):
    (folder / "cut.json").write_text('{"format": "rigid')
    assert main(["leaderboard", str(folder)]) == 2
    told = capsys.readouterr().err
    assert "cut.json" in told and len(told.splitlines()) == 1


def test_without_matplotlib_it_is_refused_before_anything_is_read(folder, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["leaderboard", str(folder)]) == 1
    assert capsys.readouterr().err.count('pip install "rigid-envs[render]"') == 1
    assert not (folder / "leaderboard.md").exists()


FORGED = (
    "best | 100.0 % | <script>alert(1)</script> [click](http://x.example) `a` $\\frac$ **b** \\"
)


def test_a_name_is_shown_letter_by_letter_and_forges_no_row(folder):
    for key in ("algo", "unranked"):
        row = result(folder, "zero") | {key: FORGED}
        write_document(folder / "below" / f"forged_{key}.json", row)
    text = leaderboard.write_leaderboard(folder)
    shown = MarkdownIt("commonmark", {"html": True}).enable("table").render(text)
    cells = [html.unescape(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", shown)]
    assert cells.count(FORGED) == 3  # of all policies, those that are ranked, and the others
    assert "<script" not in shown and "<a " not in shown and "<b>" not in shown


def drawn(env_id, policy, *efficiency):
    """A row of which the plot shows nothing but the efficiency."""
    figures = {"efficiency": efficiency[0], "efficiency_95": efficiency[1:]}
    return leaderboard.Row(f"RigidEnvs/{env_id}-v0", policy, figures, None, "", None)


@pytest.fixture
def rows():
    """Of three ids."""
    pytest.importorskip("matplotlib")
    return [
        drawn("BallPark", "shortest_path", 0.9, 0.8, 0.95),
        drawn("BallPark", "ppo", 0.7, 0.65, 0.72),
        drawn("Detumble", "ppo", 0.6, 0.5, 0.65),
        drawn("Detumble", "riccati", 0.4, 0.3, 0.45),
        drawn("CoinPark", "zero", 0.0, 0.0, 0.1),
    ]


def test_every_row_has_its_point_and_its_interval_beside_the_name_of_its_id(rows):
    figure = leaderboard.draw(rows)
    (axes,) = figure.axes
    ids = list(dict.fromkeys(row.env_id for row in rows))
    assert [label.get_text() for label in axes.get_yticklabels()] == [
        env_id.split("/")[-1] for env_id in ids
    ]
    places = dict(zip(ids, axes.get_yticks(), strict=True))
    points = [tuple(point) for line in axes.lines for point in line.get_xydata()]
    ends = [path for lines in axes.collections for path in lines.get_segments()]
    assert len(points) == len(ends) == len(rows)
    assert axes.get_xlabel() == "efficiency"
    for row in rows:
        mean, ends_of_row = row.figures["efficiency"], row.figures["efficiency_95"]
        near = [(x, y) for x, y in points if abs(y - places[row.env_id]) < 0.3]
        assert any(x == mean for x, _ in near)
        assert any(
            np.allclose(line[:, 0], ends_of_row) and abs(line[0, 1] - places[row.env_id]) < 0.3
            for line in ends
        )
    assert len({y for _, y in points}) == len(points)  # no point hides another
    (axes,) = leaderboard.draw(rows[:2]).axes
    assert sum(line.get_ydata()[0] for line in axes.lines) == 0.0  # on both sides of the name


def test_policies_are_told_from_one_another_and_named_in_the_legend(rows):
    (axes,) = leaderboard.draw(rows).axes
    legend = axes.get_legend()
    names = [text.get_text() for text in legend.get_texts()]
    assert "reference controller" in names and len(set(names)) == len(names) == len(axes.lines)
    assert {(line.get_color(), line.get_marker()) for line in axes.lines} == {
        leaderboard.look(k) for k in range(len(names))
    }
    low, high = axes.get_xlim()
    assert -0.1 < low < 0.0 and 1.0 < high < 1.1  # whole, and no room is left empty


def test_a_plot_says_what_its_vertical_axis_shows():
    figure = pytest.importorskip("matplotlib.figure")
    axes = figure.Figure().subplots()
    leaderboard.dress(axes, "success")
    assert axes.get_ylabel() == "success"
