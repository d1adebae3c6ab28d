"""Comparisons: statistics against SciPy and by hand, tables and figures."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import rigid_envs
from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import in_latex
from rigid_envs.scores.comparison import AGGREGATES, Comparison, compare
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.statistics import mean_interval, optimality_gap, sign_test
from rigid_envs.tools.cli import main

ID, N = "RigidEnvs/Detumble-v0", 40
DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def found():
    return compare(ID, {"PPO": "Detumble", "100 %_done": "reference", "none": "zero"}, n=N)


def test_aggregates_are_those_of_scipy_with_its_percentile_intervals():
    x = np.random.default_rng(0).beta(4.0, 1.5, size=200)
    theirs = {
        "IQM": lambda x, axis: stats.trim_mean(x, 0.25, axis=axis),
        "median": np.median,
        "mean": np.mean,
        "optimality gap": lambda x, axis: np.mean(np.maximum(1.0 - x, 0.0), axis=axis),
    }
    like = evaluate(ID, "zero", n=1)
    cost = like.costs[0]
    episodes = {"success": np.ones(200), like.cost.name: cost / x}
    known = replace(like, values=episodes, best=np.full(200, cost))
    aggregates = Comparison({"mine": known}).aggregates["mine"]
    assert aggregates.keys() == AGGREGATES.keys() == theirs.keys()
    for name, statistic in theirs.items():
        value, *ends = aggregates[name]
        assert value == pytest.approx(statistic(x, axis=0))
        their = stats.bootstrap((x,), statistic, method="percentile", rng=1).confidence_interval
        # quantiles of 2000 and of 9999 draws are uncertain by 5 % or so of the width
        np.testing.assert_allclose(ends, their, atol=0.1 * (their.high - their.low))


def test_the_optimality_gap_is_what_lacks_and_more_than_the_target_makes_up_for_nothing():
    assert optimality_gap([[0.5, 1.0], [1.5]]) == 0.125
    assert optimality_gap([[0.5, 1.0], [1.5]], target=2.0) == pytest.approx(0.875)


def test_the_sign_test_is_the_binomial_of_what_differs():
    x = [1.0] * 8 + [-3.0] * 2 + [0.0] * 5
    by_hand = 2 * sum(math.comb(10, k) for k in range(3)) / 2**10
    assert sign_test(x) == pytest.approx(by_hand) == pytest.approx(0.109375)
    assert sign_test(np.negative(x)) == pytest.approx(by_hand)
    assert sign_test([1.0, -1.0]) == sign_test([0.0, 0.0]) == 1.0


def test_the_paired_interval_holds_a_known_difference_as_often_as_it_says():
    rng = np.random.default_rng(2)
    held, paired, alone = [], [], []
    for _ in range(400):
        hard = rng.normal(size=60)  # what both policies have from a start
        one, other = (hard + 0.3 * rng.normal(size=60) for _ in range(2))
        low, high = mean_interval(one + 0.1 - other, n_resamples=400)
        held.append(low <= 0.1 <= high)
        paired.append(high - low)
        alone.append(np.hypot(*(np.ptp(mean_interval(x, 400)) for x in (one, other))))
    # of 400 intervals 95 % +- 3 standard errors, and a little less for 60 starts
    assert 0.91 <= np.mean(held) <= 0.985
    assert np.mean(paired) < 0.5 * np.mean(alone)


def test_pairs_are_of_the_same_starts(found):
    for (first, second), pair in found.pairs.items():
        one, other = found.scores[first], found.scores[second]
        assert pair.difference.mean == pytest.approx(np.mean(one - other))
        assert pair.difference[1:] == pytest.approx(mean_interval(one - other), abs=1e-9)
        assert (pair.better, pair.worse) == ((one > other).sum(), (one < other).sum())
        assert pair.improvement.mean == pytest.approx(np.mean((np.sign(one - other) + 1) / 2))
        assert pair.p == pytest.approx(stats.binomtest(pair.better, N).pvalue)
    assert list(found.pairs) == [("PPO", "100 %_done"), ("PPO", "none"), ("100 %_done", "none")]


def test_a_policy_is_as_good_as_itself_and_as_one_of_another_rounding(found):
    mine = found.evaluations["PPO"]
    nearly = replace(mine, values={**mine.values, mine.cost.name: mine.costs * (1.0 + 1e-12)})
    for other in (mine, nearly):
        pair = Comparison({"a": mine, "b": other}).pairs["a", "b"]
        assert pair == ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5), 0, 0, 1.0)


def test_each_is_what_evaluate_gives_and_may_be_given_as_that(found):
    alone = rigid_envs.evaluate("Detumble", "reference", n=N)
    np.testing.assert_array_equal(found.evaluations["100 %_done"].costs, alone.costs)
    mixed = rigid_envs.compare("Detumble", {"a": alone, "b": rigid_envs.load("Detumble")}, n=N)
    assert list(mixed.evaluations) == ["a", "b"] and mixed.evaluations["a"] is alone
    assert mixed.aggregates["b"] == found.aggregates["PPO"]
    assert found.aggregates["PPO"]["mean"] == found.evaluations["PPO"].efficiency


def test_in_a_task_with_other_settings_success_is_compared():
    other = compare(ID, {"PPO": "Detumble", "none": "zero"}, n=N, config={"impulse": 0.4})
    assert other.measure == "success"
    configs = [each.config for each in other.evaluations.values()]
    assert configs == [{"frame": "reduced", "impulse": 0.4}, {"impulse": 0.4}]
    np.testing.assert_array_equal(other.scores["none"], np.zeros(N))
    assert "success, paired" in str(other)


def test_what_cannot_stand_side_by_side_is_refused():
    zero = evaluate(ID, "zero", n=2)
    changes = ({"n": 3}, {"seed": 1}, {"config": {"impulse": 0.4}}, {"env_id": "BallPark"})
    for change in changes:
        other = evaluate(**({"env_id": ID, "policy": "zero", "n": 2} | change))
        with pytest.raises(ValueError, match=r"policies: other = .*; expected the id, settings"):
            compare(ID, {"zero": zero, "other": other})
    for nothing in ({}, ["zero"]):
        with pytest.raises(ValueError, match="expected policies by name, at least one"):
            compare(ID, nothing)
    with pytest.raises(ValueError, match="can be printed"):
        compare(ID, {"\x1b[2J": zero})


def test_tables_for_latex_have_all_cells_and_no_command_but_their_own(found):
    policies, pairs = found.latex().split("\n\n")
    for table, n_rows in ((policies, 3), (pairs, 3)):
        begin, top, header, mid, *rows, bottom, end = table.strip().splitlines()
        assert (top, mid, bottom) == (r"\toprule", r"\midrule", r"\bottomrule")
        assert begin == r"\begin{tabular}{l" + "r" * 5 + "}" and end == r"\end{tabular}"
        assert len(rows) == n_rows
        for row in (header, *rows):
            assert row.endswith(r" \\") and len(re.findall(r"(?<!\\)&", row)) == 5
    assert r"100 \%\_done & 100.0 [" in policies and r"success [\%]" in policies
    assert "PPO - none & 0." in pairs and "PPO - 100 \\%\\_done & $-$0." in pairs
    assert "$<$ 0.001" in pairs
    assert in_latex(r"\a{b}^~") == r"\textbackslash{}a\{b\}\textasciicircum{}\textasciitilde{}"


def test_the_text_tells_every_figure_in_columns_of_100_characters(found):
    lines = str(found).splitlines()
    assert lines[0].startswith(f"{ID}: efficiency from {N} starts of seed 314159")
    assert max(map(len, lines)) <= 100
    mean, low, high = found.aggregates["PPO"]["IQM"]
    assert f"IQM             {mean:.3f} [{low:.3f}, {high:.3f}]" in lines[4]
    assert str(Comparison({"PPO": found.evaluations["PPO"]})).count("\n\n") == 1


def test_a_figure_is_written_in_the_format_of_its_ending_the_same_each_time(found, tmp_path):
    for ending, begin in ((".pdf", b"%PDF"), (".svg", b"<?xml"), (".png", b"\x89PNG")):
        one, other = tmp_path / f"one{ending}", tmp_path / f"other{ending}"
        found.figure(one), found.figure(other)
        assert one.read_bytes().startswith(begin) and one.read_bytes() == other.read_bytes()
    with pytest.raises(ConfigError, match=r"path = 'a\.doc'; expected a name with one of \.pdf, "):
        found.figure("a.doc")


def test_markers_are_whole_and_lines_differ_in_style_and_colour(found):
    profiles, means = found.figure().axes
    looks = {(line.get_color(), line.get_linestyle()) for line in profiles.get_lines()}
    assert len(looks) == len({style for _, style in looks}) == 3
    markers = [line for line in means.get_lines() if line.get_marker() == "o"]
    assert len(markers) == 3 and not any(line.get_clip_on() for line in markers)
    bars = [line.get_xdata() for line in means.get_lines() if line not in markers]
    np.testing.assert_array_equal(bars, [each["mean"][1:] for each in found.aggregates.values()])
    assert means.get_yticklabels()[1].get_text().startswith("100 %_done\n1.000 [")


def test_every_profile_is_within_its_interval(found):
    profiles, _ = found.figure().axes
    for band, line in zip(profiles.collections, profiles.get_lines(), strict=True):
        low, high = np.split(band.get_paths()[0].vertices[:-1, 1], 2)  # round it, from a corner
        assert ((low[1:] <= line.get_ydata()) & (line.get_ydata() <= high[:0:-1])).all()


@pytest.mark.long
@pytest.mark.push
def test_the_page_prints_what_it_says(tmp_path, monkeypatch, capsys):
    text = (DOCS / "scoring.md").read_text(encoding="utf-8")
    parts = r"```python\n([^`]+compare[^`]+)```\n\n```text\n([^`]+)```"
    ((code, told),) = re.findall(parts, text)
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    assert capsys.readouterr().out == told
    assert (tmp_path / "figure.pdf").exists() and "toprule" in (tmp_path / "table.tex").read_text()


def test_the_command_writes_files_also_of_results(found, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    found.evaluations["PPO"].save("row.json")
    words = ["compare", "Detumble", "--policy", "mine=row.json", "--policy", "zero", "--starts"]
    assert main([*words, str(N), "--out", "table.tex", "figure.svg"]) == 0
    out, _ = capsys.readouterr()
    assert "mine - zero" in out and out.endswith("written to table.tex\nwritten to figure.svg\n")
    assert (tmp_path / "table.tex").read_text().startswith("\\begin{tabular}")
    assert (tmp_path / "figure.svg").stat().st_size > 10_000
