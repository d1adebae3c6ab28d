"""`rigid-envs bench`: figures on a page and in JSON, and what it refuses."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from rigid_envs import ENVIRONMENTS
from rigid_envs.cli import main
from rigid_envs.cli.bench import as_text
from rigid_envs.provenance import provenance
from tests.bench.examples import FIGURES

Capture = pytest.CaptureFixture[str]


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


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--ids", "BalPark-v0"], "did you mean 'RigidEnvs/BallPark-v0'"),
        (
            ["--json", "nowhere/bench.json"],
            "--json = nowhere/bench.json; expected a file in a folder that exists",
        ),
    ],
)
def test_unknown_ids_and_a_missing_folder_are_refused(
    capsys: Capture, words: list[str], complaint: str
) -> None:
    assert main(["bench", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert complaint in err


@pytest.mark.long
def test_everything_is_measured_and_written_down(capsys: Capture, tmp_path: Path) -> None:
    file = tmp_path / "bench.json"
    env_id = next(iter(ENVIRONMENTS))
    assert main(["bench", "--quick", "--ids", env_id, "--json", str(file)]) == 0
    assert "import to first step" in capsys.readouterr().out
    document = json.loads(file.read_text())
    assert {len(row["samples"]) for row in document["steps_per_second"]} == {document["rounds"]}
    assert {"numpy", "numba", "gymnasium", "python"} <= set(document["provenance"]["versions"])
