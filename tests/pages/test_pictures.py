"""Pictures of the documentation: there, small, fresh; what pages say of them stands in data."""

import json
import re
from pathlib import Path

import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import DamagedFileError
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.pages.films import MAX_BYTES, SHEET, stale_films, with_table
from rigid_envs.tools.pages.writing import film_of

ROOT = Path(__file__).parents[2]
FILMS = ROOT / "docs" / "environments" / "films"
GUIDE = ROOT / "docs" / "rendering.md"
IDS = tuple(ENVIRONMENTS)


def test_every_environment_has_a_film_that_is_fresh():
    assert not stale_films(FILMS, IDS), (
        "film them anew and look: rigid-envs films docs/environments/films"
    )


def test_films_and_all_pictures_together_are_small():
    sizes = [(FILMS / film_of(env_id)).stat().st_size for env_id in IDS]
    assert max(sizes) <= MAX_BYTES == 250_000
    files = [path for path in (ROOT / "docs").rglob("*.*") if "_build" not in path.parts]
    pictures = [path for path in files if path.suffix in (".png", ".svg", ".webp")]
    assert sum(path.stat().st_size for path in pictures) <= 12e6


def test_a_missing_a_changed_and_an_old_film_are_noticed(tmp_path):
    ids = IDS[:4]
    for env_id in ids:
        (tmp_path / film_of(env_id)).write_bytes((FILMS / film_of(env_id)).read_bytes())
    data = json.loads((FILMS / "films.json").read_text())
    data["films"][ids[1]]["sources"] = "0"
    (tmp_path / "films.json").write_text(json.dumps(data))
    (tmp_path / film_of(ids[2])).write_bytes(b"RIFF")
    (tmp_path / film_of(ids[3])).unlink()
    assert set(stale_films(tmp_path, ids)) == set(ids[1:])


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"films": {"a": {"file": 3}}}', "[" * 10**5])
def test_damaged_data_of_films_are_refused_by_name(tmp_path, text):
    (tmp_path / "films.json").write_text(text)
    with pytest.raises(DamagedFileError, match=r"films\.json: .*write all films anew"):
        stale_films(tmp_path, IDS)


def test_pages_show_the_films():
    for env_id in IDS:
        page = (ROOT / "docs" / "environments" / f"{Path(film_of(env_id)).stem}.md").read_text()
        assert f"](films/{film_of(env_id)})" in page
        assert f"docs/environments/films/{film_of(env_id)}" in (ROOT / "README.md").read_text()
    assert (FILMS / SHEET).is_file()


def test_times_on_the_page_are_those_of_the_data():
    text = GUIDE.read_text(encoding="utf-8")
    data = json.loads(GUIDE.with_suffix(".json").read_text())
    assert text == with_table(text, data)
    assert {times["env_id"] for times in data["frames"]} == set(IDS)
    with pytest.raises(ConfigError, match="no marks"):
        with_table("# Another page", data)


def test_pictures_take_no_longer_than_promised():
    data = json.loads(GUIDE.with_suffix(".json").read_text())
    for times in data["frames"]:
        assert times["frame"] <= 0.010
        assert times["first"] <= 1.0


def test_code_of_the_guide_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    for block in blocks:
        names: dict[str, object] = {}
        exec(block, names)
        assert names["picture"].shape == (480, 480, 3)
        assert names["second"].shape == (480, 480, 3)
