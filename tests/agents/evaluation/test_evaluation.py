"""Every start is played once and counted once; the page of baselines follows from the records."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import tests.agents.drift  # noqa: F401, registers the environment
from agents.cli.command_line import main
from agents.evaluation import reports
from agents.evaluation.baselines import digest_of, figures_of, grouped, markdown
from agents.evaluation.reports import evaluate, table, write_report
from agents.storage.logs import write_evaluations
from rigid_envs.scores.best import best_known
from rigid_envs.scores.evaluation import published_record
from rigid_envs.scores.policies import RandomPolicy
from rigid_envs.scores.records import evaluation_of, record_file, write_record
from rigid_envs.scores.starts import FLOOR, play, row_seeds
from rigid_envs.scores.trained import FOLDER, published
from tests.agents.drift import Drift
from tests.agents.sessions import begun, rows, small


class Homing:
    """Straight to the origin."""

    def predict(self, observation, *, deterministic=True):
        return np.clip(-3 * observation, -1, 1).astype(np.float32), None


def homing(observation):
    """Straight to the origin."""
    return np.clip(-3 * observation, -1, 1).astype(np.float32)


def test_each_row_is_one_episode_as_if_it_were_alone():
    n = 40
    seeds = row_seeds(0, n, "test")
    together = play(homing, Drift(n, noise=0.9), seeds)
    assert 0 < together.successes.sum() < n
    columns = (together.returns, together.lengths, together.successes, together.costs)
    for k, seed in enumerate(seeds):
        assert alone(seed) == tuple(column[k] for column in columns)


def alone(seed):
    venv = Drift(1, noise=0.9)
    obs, _ = venv.reset(seed=[seed])
    total, cost, length, done = 0.0, 0.0, 0, False
    while not done:
        obs, reward, terminated, truncated, info = venv.step(homing(obs))
        done = terminated[0] or truncated[0]
        total += reward[0]
        cost += (info["final_info"] if done else info)["cost"][0]
        length += 1
    return total, length, bool(terminated[0]), cost


def test_the_random_policy_fills_the_space_evenly():
    box = RandomPolicy(Drift(1).single_action_space, np.random.default_rng(0))
    actions, _ = box.predict(np.zeros((10_000, 2)))
    assert actions.dtype == np.float32 and actions.shape == (10_000, 2)
    # Mean and variance of a uniform variable on [-1, 1], within 5 standard errors.
    np.testing.assert_allclose(actions.mean(axis=0), 0, atol=5 / math.sqrt(3 * 10_000))
    np.testing.assert_allclose(actions.var(axis=0), 1 / 3, atol=5 * math.sqrt(4 / 45 / 10_000))


def test_seeds_of_100_runs_and_all_purposes_are_distinct():
    runs = [*range(100), 2**32, 2**32 + 1, 2**40 + 7, np.int64(5000)]
    seeds = [s for run in runs for s in row_seeds(run, 64, "train")]
    for purpose in ("validation", "test", "random policy", "learner"):
        seeds += [s for run in runs for s in row_seeds(run, 64, purpose)]
    assert len(set(seeds)) == len(seeds) == 5 * 64 * len(runs)
    assert all(type(s) is int and 0 <= s < 2**63 for s in seeds)


def test_an_evaluation_repeats_another_seed_differs_and_no_global_stream_is_touched():
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    for policy in (homing, None):
        one, two = (evaluate(policy, "Drift-v0", 50, seed=1).values["return"] for _ in range(2))
        np.testing.assert_array_equal(one, two)
        other = evaluate(policy, "Drift-v0", 50, seed=2).values["return"]
        assert not np.isin(one, other).any()
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def test_figures_are_in_the_table_and_can_be_recomputed_from_the_episodes(tmp_path):
    found = evaluate(homing, "Drift-v0", 30, 0)
    figures = found.row() | {"random_policy": evaluate(None, "Drift-v0", 30, 0).summary()}
    lines = table(figures).splitlines()
    assert "30 unseen starts" in lines[0] and len({len(line) for line in lines[2:-2]}) == 1
    assert lines[4].startswith("homing") and f"{figures['policy']['cost_mean']:.3f}" in lines[4]
    assert lines[5].startswith("random policy")
    write_report(tmp_path, figures, found)
    row = json.loads((tmp_path / "results.json").read_text())
    assert evaluation_of(row).summary() == found.summary() == row["policy"]
    played = rows(tmp_path / "episodes.csv")
    assert [int(each["seed"]) for each in played] == row_seeds(0, 30, "test")
    assert sum(int(each["is_success"]) for each in played) == row["policy"]["successes"]
    assert np.mean([float(each["return"]) for each in played]) == row["policy"]["return_mean"]


DOCS = Path(__file__).parents[3] / "docs"
IDS = ("RigidEnvs/BallPark-v0", "RigidEnvs/SpinCapture-v0")
MEND = "write it anew: python -m agents baselines docs/baselines"


def records(seeds):
    """Of two policies on two ids: one costs twice the best known, one fails from half the starts.

    The k-th seed of the first fails from the first k starts.
    """
    like, index = published_record(published()[0]), np.arange(500)
    for env_id in IDS:
        best = best_known(env_id)
        assert best is not None
        for seed in range(seeds):
            one = replace(like, env_id=env_id, algo="ppo", policy="ppo", frame="world", seed=seed)
            least = np.maximum(best.costs, FLOOR)
            yield replace(one, successes=index >= seed, costs=2.0 * least)
            half = replace(one, algo="sac", policy="sac", costs=best.costs)
            yield replace(half, successes=index >= 250)


def page(folder, seeds):
    for each in records(seeds):
        file = record_file(folder, each.env_id, each.algo, each.frame, each.seed)
        write_record(file, each)
    return markdown(grouped(folder), "figures").splitlines()


def cells(lines, *start):
    (line,) = [each for each in lines if each.startswith(f"| {' | '.join(start)} |")]
    return [cell.strip() for cell in line.split("|")[1:-1]]


def test_means_and_intervals_are_those_of_the_seeds(tmp_path):
    lines = page(tmp_path, 3)
    row = cells(lines, "`BallPark`", "ppo")
    assert row[2:4] == ["3", "99.8 %"]  # of 100, 99.8 and 99.6
    assert row[4] == "99.6 .. 100.0"
    assert row[5] == "**0.499**"  # half of it
    assert row[7:10:2] == ["path [m]", "2.00"]
    assert cells(lines, "`SpinCapture`", "sac")[3:6] == ["50.0 %", "50.0 .. 50.0", "**0.500**"]
    assert cells(lines, "ppo", "2")[3] == "2 of 2" and cells(lines, "sac", "2")[3] == "0 of 2"
    assert cells(lines, "sac", "ppo")[3] == "83 %"  # 0.5 against 0.5, 0.499 and 0.498


@pytest.mark.parametrize(("rates", "told"), [((0.5, 0.99, 1.0), "50 s"), ((0.5, 0.9, 0.98), "-")])
def test_the_time_to_99_is_that_of_the_first_evaluation_from_which_so_many_succeed(
    tmp_path, rates, told
):
    for each in records(2):
        curve = {"timesteps": [1000, 2000, 4000], "success_rate": [*rates]}
        training = {**each.training, "timesteps": 4000, "cpu_seconds": 80.0 + 40.0 * each.seed}
        each = replace(each, training=training, curve={**each.curve, **curve} | {
            name: [1.0, 1.0, 1.0] for name in ("return_mean", "cost_mean")})  # fmt: skip
        file = record_file(tmp_path, each.env_id, each.algo, each.frame, each.seed)
        write_record(file, each)
    row = cells(markdown(grouped(tmp_path), "figures").splitlines(), "`BallPark`", "ppo")
    assert row[11:] == [told, "100 s"]


def test_one_seed_has_no_interval(tmp_path):
    lines = page(tmp_path, 1)
    row = cells(lines, "`BallPark`", "sac")
    assert (row[2], row[4], row[6]) == ("1", "-", "-")


def test_environments_with_one_seed_have_their_weight_and_no_interval(tmp_path):
    page(tmp_path, 3)
    for seed in (1, 2):
        record_file(tmp_path, IDS[0], "ppo", "world", seed).unlink()
    lines = markdown(grouped(tmp_path), "figures").splitlines()
    assert cells(lines, "ppo", "2")[2:7:4] == ["4", "-"] and cells(lines, "sac", "2")[6] != "-"
    assert cells(lines, "ppo", "2")[5] == "**0.500**"  # 0.5 counts as often as 0.5, 0.499 and 0.498
    assert cells(lines, "sac", "ppo")[4] == "-"


@pytest.mark.parametrize("seeds", [1, 2])
def test_page_and_figures_are_written(tmp_path, seeds):
    folder = tmp_path / "baselines"
    lines = page(folder, seeds)
    assert main(["baselines", str(folder)]) == 0
    text = (tmp_path / "baselines.md").read_text()
    assert (
        text
        == "\n".join(lines)
        .replace("figures/", "baselines/")
        .replace("[figures](figures)", "[baselines](baselines)")
        + "\n"
    )
    figures = {path.stem for path in folder.glob("*.png")}
    names = {"aggregates", "profiles", "improvement", "curves_ball", "curves_free_body"}
    assert figures == names and all(f"(baselines/{name}.png)" in text for name in names)


def run_of(folder, rates, **entries):
    """A run with some rates of success, of 4 starts, after every 1000 steps."""
    name = "_".join(map(str, [*entries.values(), "r"])).replace(".", "")
    run = begun(small(folder, run_name=name, **entries))
    wins = np.arange(4) < 4 * np.array(rates)[:, None]
    steps = 1000 * np.arange(1, len(wins) + 1)
    names = ("results", "ep_lengths", "successes", "costs")
    arrays = {"timesteps": steps} | {name: wins * 1.0 for name in names}
    write_evaluations(run / "evaluations.npz", arrays)
    return run


def test_curves_are_of_what_differs_in_more_than_the_seed(tmp_path, monkeypatch, capsys):
    drawn = []
    monkeypatch.setattr(reports, "save_figure", lambda figure, path: drawn.append(figure) or path)
    runs = [run_of(tmp_path, [0.25, 0.5, 1.0], seed=0), run_of(tmp_path, [0.5, 0.75], seed=1)]
    runs += [run_of(tmp_path, [0.25, 0.25], gamma=0.5)]
    reports.draw_runs(runs, tmp_path / "c.pdf")
    (axes,) = drawn[0].axes
    first, second = axes.get_lines()
    assert (first.get_label(), second.get_label()) == ("ppo, gamma 0.99", "ppo, gamma 0.5")
    np.testing.assert_allclose(first.get_xydata(), [[1000, 37.5], [2000, 62.5]])  # as far as both
    np.testing.assert_allclose(second.get_xydata(), [[1000, 25], [2000, 25]])
    assert len(axes.collections) == 1  # one band: of what has several seeds
    low, high = axes.get_ylim()
    assert low <= 0.0 and high >= 100.0  # all that a rate can be
    monkeypatch.undo()
    folders = [str(run.folder) for run in runs]
    assert main(["curves", *folders, "--out", str(tmp_path / "c.pdf")]) == 0
    assert (tmp_path / "c.pdf").read_bytes().startswith(b"%PDF")
    assert main(["curves", *folders, "--out", "c.doc"]) == 2
    assert "path = 'c.doc'; expected" in capsys.readouterr().err


def test_a_folder_without_records_is_refused(tmp_path, capsys):
    assert main(["baselines", str(tmp_path)]) == 2
    assert "expected records of `python -m agents benchmark`" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.push
def test_the_page_of_the_repository_is_that_of_its_records():
    groups = grouped(DOCS / "baselines")
    assert (DOCS / "baselines.md").read_text() == markdown(groups, "baselines"), MEND
    assert {path.stem for path in (DOCS / "baselines").glob("*.png")} == set(figures_of(groups)), (
        MEND
    )
    for name in figures_of(groups):
        with Image.open(DOCS / "baselines" / f"{name}.png") as image:
            assert image.info["Description"] == digest_of(groups), f"{name}.png: {MEND}"


def test_the_page_of_the_ablations_is_that_of_their_records():
    name, n_rows = "", 0
    for line in (DOCS / "ablations.md").read_text(encoding="utf-8").splitlines():
        name = line[3:].partition(",")[0] if line.startswith("## ") else name
        part, *told = [cell.strip() for cell in line.split("|")[1:-1]] or [""]
        folder = DOCS / "ablations" / part
        if not (part and folder.is_dir()):
            continue
        found = [json.loads(file.read_text()) for file in folder.glob(f"{name}*/*.json")]
        assert {each["evaluation"]["version"] for each in found} == {1}
        won = [np.array(list(each["successes"])) == "1" for each in found]
        rates = [100 * each.mean() for each in won]
        costs = [
            np.array(each["costs"])[starts].mean()
            for each, starts in zip(found, won, strict=True)
            if starts.any()
        ]
        assert told[0] == str(len(found)) and told[1] == f"{np.mean(rates):.1f} %"
        assert told[2] == f"({min(rates):.1f} .. {max(rates):.1f})"
        assert told[3] == (f"{np.mean(costs):.4g}" if costs else "-")
        n_rows += 1
    assert n_rows == 15


def test_baselines_and_policies_take_15_megabytes_at_most():
    folders = (DOCS / "baselines", FOLDER)
    sizes = [path.stat().st_size for folder in folders for path in folder.rglob("*.*")]
    assert sum(sizes) <= 15e6
