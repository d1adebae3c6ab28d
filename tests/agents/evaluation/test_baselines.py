"""The page of the baselines: its figures follow from the records, few or many."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from agents.cli.command_line import main
from agents.evaluation.baselines import digest_of, figures_of, grouped, markdown
from rigid_envs.scores.best import best_known
from rigid_envs.scores.records import Record, read_record, record_file, write_record
from rigid_envs.scores.repeating import published_record
from rigid_envs.scores.starts import FLOOR
from rigid_envs.scores.trained import FOLDER, published
from tests.fixtures import Capture

DOCS = Path(__file__).parents[3] / "docs"
IDS = ("RigidEnvs/BallPark-v0", "RigidEnvs/SpinCapture-v0")
MEND = "write it anew: python -m agents baselines docs/baselines"


def records(seeds: int) -> Iterator[Record]:
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


def page(folder: Path, seeds: int) -> list[str]:
    for each in records(seeds):
        file = record_file(folder, each.env_id, each.algo, each.frame, each.seed)
        write_record(file, each)
    return markdown(grouped(folder), "figures").splitlines()


def cells(lines: list[str], *start: str) -> list[str]:
    (line,) = [each for each in lines if each.startswith(f"| {' | '.join(start)} |")]
    return [cell.strip() for cell in line.split("|")[1:-1]]


def test_means_and_intervals_are_those_of_the_seeds(tmp_path: Path) -> None:
    lines = page(tmp_path, 3)
    row = cells(lines, "`BallPark`", "ppo")
    assert row[2:4] == ["3", "99.8 %"]  # of 100, 99.8 and 99.6
    assert row[4] == "99.6 .. 100.0"
    assert row[5] == "**0.499**"  # half of it
    assert row[7:10:2] == ["path [m]", "2.00"]
    assert cells(lines, "`SpinCapture`", "sac")[3:6] == ["50.0 %", "50.0 .. 50.0", "**0.500**"]
    assert cells(lines, "ppo", "2")[3] == "2 of 2" and cells(lines, "sac", "2")[3] == "0 of 2"
    assert cells(lines, "sac", "ppo")[3] == "83 %"  # 0.5 against 0.5, 0.499 and 0.498


def test_one_seed_has_no_interval(tmp_path: Path) -> None:
    lines = page(tmp_path, 1)
    row = cells(lines, "`BallPark`", "sac")
    assert (row[2], row[4], row[6]) == ("1", "-", "-")


def test_environments_with_one_seed_have_their_weight_and_no_interval(tmp_path: Path) -> None:
    page(tmp_path, 3)
    for seed in (1, 2):
        record_file(tmp_path, IDS[0], "ppo", "world", seed).unlink()
    lines = markdown(grouped(tmp_path), "figures").splitlines()
    assert cells(lines, "ppo", "2")[2:7:4] == ["4", "-"] and cells(lines, "sac", "2")[6] != "-"
    assert cells(lines, "ppo", "2")[5] == "**0.500**"  # 0.5 counts as often as 0.5, 0.499 and 0.498
    assert cells(lines, "sac", "ppo")[4] == "-"


@pytest.mark.parametrize("seeds", [1, 2])
def test_page_and_figures_are_written(tmp_path: Path, seeds: int) -> None:
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


def test_a_folder_without_records_is_refused(tmp_path: Path, capsys: Capture) -> None:
    assert main(["baselines", str(tmp_path)]) == 2
    assert "expected records of `python -m agents benchmark`" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.push
def test_the_page_of_the_repository_is_that_of_its_records() -> None:
    groups = grouped(DOCS / "baselines")
    assert (DOCS / "baselines.md").read_text() == markdown(groups, "baselines"), MEND
    assert {path.stem for path in (DOCS / "baselines").glob("*.png")} == set(figures_of(groups)), (
        MEND
    )
    for name in figures_of(groups):
        with Image.open(DOCS / "baselines" / f"{name}.png") as image:
            assert image.info["Description"] == digest_of(groups), f"{name}.png: {MEND}"


def test_the_page_of_the_ablations_is_that_of_their_records() -> None:
    name, rows = "", 0
    for line in (DOCS / "ablations.md").read_text(encoding="utf-8").splitlines():
        name = line[3:].partition(",")[0] if line.startswith("## ") else name
        part, *told = [cell.strip() for cell in line.split("|")[1:-1]] or [""]
        folder = DOCS / "ablations" / part
        if not (part and folder.is_dir()):
            continue
        found = [read_record(file) for file in folder.glob(f"{name}*/*.json")]
        rates = [100 * each.evaluation.success.mean for each in found]
        costs = [each.costs[each.successes].mean() for each in found if each.successes.any()]
        assert told[0] == str(len(found)) and told[1] == f"{np.mean(rates):.1f} %"
        assert told[2] == f"({min(rates):.1f} .. {max(rates):.1f})"
        assert told[3] == (f"{np.mean(costs):.4g}" if costs else "-")
        rows += 1
    assert rows == 15


def test_baselines_and_policies_take_15_megabytes_at_most() -> None:
    folders = (DOCS / "baselines", FOLDER)
    sizes = [path.stat().st_size for folder in folders for path in folder.rglob("*.*")]
    assert sum(sizes) <= 15e6
