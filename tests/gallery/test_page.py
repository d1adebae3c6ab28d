"""The gallery as files: what the command writes, and that docs/gallery is what it would write."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from rigid_envs.tools.cli import main
from rigid_envs.tools.gallery import DATA, FIGURES, SHEET, SOURCES, Made, page
from rigid_envs.tools.pages.films import sources_hash
from rigid_envs.watch.figures import Match
from tests.programs import printed

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs" / "gallery"
Capture = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((DOCS / DATA).read_text())
    return loaded


def test_pictures_are_as_new_as_what_draws_them(document: dict[str, Any]) -> None:
    assert document["sources"] == sources_hash(*SOURCES), (
        "what draws figures has changed: run `rigid-envs gallery --docs docs/gallery`"
    )


def test_page_is_that_of_the_data_and_names_every_figure(document: dict[str, Any]) -> None:
    text = (ROOT / "docs" / "gallery.md").read_text()
    assert text == page(document, "gallery")
    assert [figure["name"] for figure in document["figures"]] == list(FIGURES)
    for name, entry in FIGURES.items():
        assert f"(gallery/{name}.png)" in text
        assert entry.caption in text and entry.law in text and entry.command in text


def test_data_holds_numbers_within_bounds_and_provenance(document: dict[str, Any]) -> None:
    assert {"versions", "kernel_hash", "git_commit"} <= document["provenance"].keys()
    assert "matplotlib" in document["provenance"]["versions"]
    for figure in document["figures"]:
        assert figure["numbers"], figure["name"]
        assert all(number["holds"] for number in figure["numbers"]), figure["name"]


def test_pictures_are_there_and_small() -> None:
    files = {path.name for path in DOCS.iterdir()}
    assert files == {DATA, SHEET, *(f"{name}.png" for name in FIGURES)}
    assert sum(path.stat().st_size for path in DOCS.iterdir()) < 3_000_000


def test_list_names_every_figure_and_imports_no_matplotlib() -> None:
    report = (
        "import sys; from rigid_envs.tools.cli import main; status = main(['gallery', '--list']); "
        "assert 'matplotlib' not in sys.modules; sys.exit(status)"
    )
    said = printed("-c", report, cwd=ROOT)
    for name, entry in FIGURES.items():
        assert f"{name} " in said and entry.title in said


def test_command_writes_pictures_and_data(tmp_path: Path, capsys: Capture) -> None:
    folder = tmp_path / "new" / "figures"
    assert main(["gallery", "race", "chandler", "--out", str(folder)]) == 0
    assert "written to" in capsys.readouterr().out
    assert {path.name for path in folder.iterdir()} == {
        *("race.png", "race.svg", "chandler.png", "chandler.svg"),
        DATA,
    }
    written = json.loads((folder / DATA).read_text())
    assert [figure["name"] for figure in written["figures"]] == ["race", "chandler"]
    assert written["figures"][0]["files"] == {"png": "race.png", "svg": "race.svg"}


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["nothing", "--list"], "figure = 'nothing'; expected one of"),
        (["race"], "--out = None; expected either --out DIR or --docs DIR"),
        (["--out", "x", "--docs", "y"], "expected either --out DIR or --docs DIR"),
        (["race", "--docs", "x"], "expected none beside --docs"),
        (["race", "--out", __file__], "expected a folder: this is a file"),
        (["--frames", "3"], "argument = '--frames'"),
    ],
)
def test_wrong_words_are_refused(words: list[str], complaint: str, capsys: Capture) -> None:
    assert main(["gallery", *words]) == 2
    assert complaint in capsys.readouterr().err


def test_a_number_beyond_its_bound_fails_the_command(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    good, bad = (Match("drift", error, 0.0, 1.0) for error in (0.5, 1.5))
    made = {
        "race": Made(FIGURES["race"], b"", b"", (good, good)),
        "chandler": Made(FIGURES["chandler"], b"", b"", (good, bad)),
    }
    for names, status in ((["race"], 0), (["race", "chandler"], 1)):
        drawn = [made[name] for name in names]
        monkeypatch.setattr("rigid_envs.tools.gallery.write_figures", lambda *_, d=drawn: d)
        assert main(["gallery", *names, "--out", str(tmp_path)]) == status
        said = capsys.readouterr().out
        assert all(f"{name} " in said for name in names) and said.count(str(good)) == len(names)
        assert ("\nbeyond their bounds: chandler\n" in said) == bool(status)


def test_command_without_matplotlib_says_how_to_install_it(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["gallery", "race", "--out", str(tmp_path)]) == 1  # as for every missing package
    assert 'pip install "rigid-envs[render]"' in capsys.readouterr().err
