"""Every tutorial runs as the script that it is; `.ci/docs` runs them as notebooks, for the site."""

import ast
from pathlib import Path

import pytest

from tests.programs import printed

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "tutorials"
NAMES = sorted(path.stem for path in FOLDER.glob("*.py"))
SHORT = {"03_make_it_yours", "06_dzhanibekov"}  # seconds; the others train, film or search
each = pytest.mark.parametrize(
    "name",
    [name if name in SHORT else pytest.param(name, marks=pytest.mark.long) for name in NAMES],
)


def test_all_are_on_the_site_and_begin_with_a_title() -> None:
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    for name in NAMES:
        text = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
        assert f"\ntutorials/{name}\n" in index
        assert text.startswith("# %% [markdown]\n# # "), name
        assert ast.parse(text)


@each
def test_it_runs_as_a_script(name: str, tmp_path: Path) -> None:
    printed(FOLDER / f"{name}.py", cwd=tmp_path, PYTHONPATH=str(ROOT), MPLBACKEND="Agg")


@pytest.mark.parametrize("name", NAMES)
def test_it_is_a_notebook(name: str) -> None:
    jupytext = pytest.importorskip("jupytext")
    nbformat = pytest.importorskip("nbformat")
    notebook = jupytext.read(FOLDER / f"{name}.py")
    nbformat.validate(notebook)
    assert {cell["cell_type"] for cell in notebook.cells} == {"markdown", "code"}
