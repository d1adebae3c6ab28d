"""Programs of others run the recipes, each in its environment: the rows of docs/clients.md."""

import hashlib
import json
from pathlib import Path

import pytest

from tests.clients.__main__ import DATA, main
from tests.clients.page import markdown
from tests.clients.rows import ROWS, Row
from tests.clients.running import ROOT, run

HERE = Path(__file__).parent
CLEANRL = {
    "ppo.py": "edde76baef51f05a8654160dfb19a4fdb34d14d3",
    "LICENSE": "c4e562311a2917da1c770a80860d223965b41770",
}
"""Hashes of the files in the repository of CleanRL at fe8d8a0, as git names them."""

AT_A_PUSH = ("sb3_her", "cleanrl_ppo", "torchrl_envs")
"""One program that the tests need anyway, one with an environment of its own, one of rows."""


@pytest.mark.long
@pytest.mark.parametrize(
    "row",
    [
        pytest.param(row, id=row.recipe, marks=pytest.mark.push if row.recipe in AT_A_PUSH else ())
        for row in ROWS
    ],
)
def test_a_program_of_others_runs_its_recipe(row: Row) -> None:
    assert run(row)["result"]


@pytest.mark.long
def test_the_command_runs_what_is_named_and_writes_its_row(tmp_path: Path) -> None:
    assert main(["sb3_published", "--out", str(tmp_path)]) == 0
    found, before = (json.loads(path.read_text()) for path in (tmp_path / DATA.name, DATA))
    assert found.keys() == before.keys()
    assert {name for name in found if found[name] != before[name]} == {"sb3_published"}
    assert (tmp_path / "clients.md").read_text() == markdown(found)
    with pytest.raises(SystemExit):
        main(["nothing"])


def test_every_recipe_is_a_row_and_every_environment_has_a_use() -> None:
    assert {row.recipe for row in ROWS} == {path.stem for path in (HERE / "recipes").iterdir()}
    needed = {row.environment for row in ROWS if row.environment}
    assert needed == {path.stem for path in (HERE / "requirements").iterdir()}


def test_the_page_is_that_of_the_data_and_every_recipe_is_short() -> None:
    data = json.loads(DATA.read_text())
    mend = "write it anew: python -m tests.clients"
    assert list(data) == [row.recipe for row in ROWS], mend
    assert (ROOT / "docs" / "clients.md").read_text() == markdown(data), mend
    assert max(found["processor_seconds"] for found in data.values()) < 60.0


@pytest.mark.parametrize("name", CLEANRL)
def test_scripts_of_cleanrl_are_unmodified(name: str) -> None:
    data = (HERE / "cleanrl" / name).read_bytes()
    assert hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest() == CLEANRL[name]


def test_recipes_are_scripts_that_anybody_could_have_written() -> None:
    for path in (HERE / "recipes").iterdir():
        text = path.read_text()
        assert len(text.splitlines()) <= 55, path.name
        for word in ("monkeypatch", "unwrapped", "sys.path", "setattr", "_core"):
            assert word not in text, path.name
