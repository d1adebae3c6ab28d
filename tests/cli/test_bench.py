"""`rigid-envs bench`: figures on a page and in JSON, and what it refuses."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rigid_envs.engine.provenance import provenance
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.bench.figures import Figures
from rigid_envs.tools.bench.measuring import Throughput
from rigid_envs.tools.cli import main
from rigid_envs.tools.cli.collecting import _speed, as_factor, as_text, as_time
from tests.bench.examples import FIGURES
from tests.fixtures import Capture, Patch


def test_the_report_fits_a_page_and_names_the_peers() -> None:
    text = as_text(provenance(), FIGURES)
    assert max(map(len, text.splitlines())) <= 100
    assert re.search(r"^IntermediateAxis-v0 +950k", text, re.MULTILINE)
    assert re.search(r"^MuJoCo RK4 x 4 +40k", text, re.MULTILINE)
    assert re.search(r"^BallPark-v0 +162\.5 ns +3\.56$", text, re.MULTILINE)
    assert re.search(r"^IntermediateAxis-v0 +single, made +CartPole-v1 +4\.75 x ", text, re.M)
    assert re.search(r"^6000 s in steps of 0\.05 s +7\.0e-14 +9\.0e-10 +1\.0e-06$", text, re.M)
    assert re.search(r"^RigidEnvs/IntermediateAxis-v0 +0\.80 s +6\.00 s$", text, re.MULTILINE)
    assert not re.search("goal|target|met", text)  # an installed user has no targets
    assert "substeps per control period" in text
    assert "substeps per control period" not in as_text(provenance(), replace(FIGURES, mujoco=()))


def test_three_digits_are_shown_and_the_unit_that_they_need() -> None:
    speeds = [Throughput("", "", [each, each]) for each in (40e3, 999.4e3, 999.6e3, 1.234e6, 12e6)]
    assert [_speed(each).split()[0] for each in speeds] == ["40k", "999k", "1M", "1.23M", "12M"]
    assert [as_time(each) for each in (45.64e-9, 999.9e-9, 1e-6, 1.234e-6)] == [
        *("45.6 ns", "999.9 ns", "1.00 us", "1.23 us"),
    ]
    factors = [as_factor(each) for each in (0.1234, 4.75, 999.4, 999.6, 12345.6)]
    assert factors == ["0.123 x", "4.75 x", "999 x", "1000 x", "12346 x"]


@pytest.mark.parametrize(
    ("quick", "started"), [([], ["BallPark", "BallGrid"]), (["--quick"], ["BallPark"])]
)
def test_start_up_is_measured_of_each_kind_of_task_and_in_a_quick_look_of_the_first(
    quick: list[str], started: list[str], tmp_path: Path, monkeypatch: Patch
) -> None:
    asked: list[Any] = []

    def measured(*given: Any) -> Figures:
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
def test_everything_is_measured_and_written_down(capsys: Capture, tmp_path: Path) -> None:
    file = tmp_path / "bench.json"
    env_id = next(iter(ENVIRONMENTS))
    assert main(["bench", "--quick", "--ids", env_id, "--json", str(file)]) == 0
    assert "import to first step" in capsys.readouterr().out
    document = json.loads(file.read_text())
    assert {len(row["samples"]) for row in document["steps_per_second"]} == {document["rounds"]}
    assert {"numpy", "numba", "gymnasium", "python"} <= set(document["provenance"]["versions"])
