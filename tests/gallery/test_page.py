"""Pictures of the documentation and the gallery: there, small, fresh, and what is said of them."""

import json
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import DamagedFileError
from rigid_envs.envs.lookup import task_of
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools import gallery
from rigid_envs.tools.bench.figures import FrameTimes
from rigid_envs.tools.cli import main
from rigid_envs.tools.gallery import DATA, FIGURES, SOURCES, Made, page
from rigid_envs.tools.pages.films import (
    HEIGHT,
    MAX_BYTES,
    SHEET,
    WIDTH,
    sources_hash,
    stale_films,
    with_table,
)
from rigid_envs.tools.pages.tables import summary_of
from rigid_envs.tools.pages.writing import film_of
from rigid_envs.watch.figures import Match
from rigid_envs.watch.films import LETTERS
from rigid_envs.watch.pictures import font, wrapped
from tests.programs import printed

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs" / "gallery"


@pytest.fixture(scope="module")
def document():
    return json.loads((DOCS / DATA).read_text())


def test_pictures_are_as_new_as_what_draws_them(document):
    assert document["sources"] == sources_hash(*SOURCES), (
        "what draws figures has changed: run `rigid-envs gallery --docs docs/gallery`"
    )


def test_page_is_that_of_the_data_and_names_every_figure(document):
    text = (ROOT / "docs" / "gallery.md").read_text()
    assert text == page(document, "gallery")
    assert [figure["name"] for figure in document["figures"]] == list(FIGURES)
    for name, entry in FIGURES.items():
        assert f"(gallery/{name}.png)" in text
        assert entry.caption in text and entry.law in text and entry.command in text


def test_code_of_the_gallery_is_what_draws(tmp_path, monkeypatch):
    """The example runs here, each of the others where its figure is drawn: in test_figures.py."""
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "gallery.md").read_text()
    example, *sources = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names = {}
    exec(example, names)
    assert (tmp_path / "flip.png").read_bytes().startswith(b"\x89PNG")
    top, *_ = names["figure"].axes
    assert top.get_xlim() == (0.0, 30.0)
    assert sources == [entry.code for entry in FIGURES.values()]


def test_a_figure_shows_the_whole_of_itself_in_jupyter(monkeypatch):
    ipython = pytest.importorskip("IPython.display")
    shown = []
    monkeypatch.setattr(ipython, "display", shown.append)
    figure = FIGURES["race"](slope=0.5)
    figure._ipython_display_()
    width, height = np.frombuffer(shown[0].data[16:24], dtype=">u4")
    assert (width, height) == tuple(np.round(figure.get_size_inches() * figure.dpi))


def test_data_holds_numbers_within_bounds_and_provenance(document):
    assert {"versions", "kernel_hash", "git_commit"} <= document["provenance"].keys()
    assert "matplotlib" in document["provenance"]["versions"]
    for figure in document["figures"]:
        assert figure["numbers"], figure["name"]
        assert all(number["holds"] for number in figure["numbers"]), figure["name"]


def test_pictures_are_there_and_small():
    files = {path.name for path in DOCS.iterdir()}
    assert files == {DATA, gallery.SHEET, *(f"{name}.png" for name in FIGURES)}
    assert sum(path.stat().st_size for path in DOCS.iterdir()) < 3_000_000


def test_list_names_every_figure_and_imports_no_matplotlib():
    report = (
        "import sys; from rigid_envs.tools.cli import main; status = main(['gallery', '--list']); "
        "assert 'matplotlib' not in sys.modules; sys.exit(status)"
    )
    said = printed("-c", report, cwd=ROOT)
    for name, entry in FIGURES.items():
        assert f"{name} " in said and entry.title in said


def test_command_writes_pictures_and_data(tmp_path, capsys):
    folder = tmp_path / "new" / "figures"
    assert main(["gallery", "race", "chandler", "--out", str(folder)]) == 0
    assert capsys.readouterr().out.endswith(f"\n\nwritten to {folder}\n")
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
def test_wrong_words_are_refused(words, complaint, capsys):
    assert main(["gallery", *words]) == 2
    assert complaint in capsys.readouterr().err


def test_a_number_beyond_its_bound_fails_the_command(tmp_path, capsys, monkeypatch):
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


def test_command_without_matplotlib_says_how_to_install_it(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["gallery", "race", "--out", str(tmp_path)]) == 1  # as for every missing package
    assert 'pip install "rigid-envs[render]"' in capsys.readouterr().err


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


def test_films_have_one_size_and_last_as_long_as_one_likes_to_look():
    pictures = pytest.importorskip("PIL.Image")
    for env_id in IDS:
        with pictures.open(FILMS / film_of(env_id)) as film:
            assert film.size == (WIDTH, HEIGHT)
            assert 4.0 <= duration(film) <= 8.5


def test_text_of_films_can_be_read_on_a_phone():
    assert LETTERS * 360 / WIDTH > 11.0  # pixels of a letter in a film that is 360 wide
    films = json.loads((FILMS / "films.json").read_text())["films"]
    for env_id in IDS:
        shows = films[env_id]["shows"]
        what = summary_of(type(task_of(env_id)))
        for text, width in ((what, WIDTH), *((text, WIDTH // len(shows)) for text in shows)):
            lines = wrapped(text, width, LETTERS)
            assert len(lines) <= 2
            assert max(map(font(LETTERS).getlength, lines)) <= width - LETTERS  # not made smaller


def duration(film):
    """Duration of an animation [s]."""
    times = []
    for k in range(film.n_frames):
        film.seek(k)
        film.load()
        times.append(film.info["duration"])
    return sum(times) / 1000.0


def test_in_every_film_somebody_succeeds_and_only_who_does_not_act_fails():
    films = json.loads((FILMS / "films.json").read_text())["films"]
    for env_id in IDS:
        shows = films[env_id]["shows"]
        assert len(shows) == len(films[env_id]["seeds"])
        assert all("no success" not in text or text == "zero: no success" for text in shows)
        assert "no success" not in shows[-1]
        if env_id.endswith("Random-v0"):
            assert len(shows) > 1


def test_a_missing_a_changed_and_an_old_film_are_noticed(tmp_path, capsys):
    ids = IDS[:4]
    for env_id in ids:
        (tmp_path / film_of(env_id)).write_bytes((FILMS / film_of(env_id)).read_bytes())
    data = json.loads((FILMS / "films.json").read_text())
    data["films"][ids[1]]["sources"] = "0"
    (tmp_path / "films.json").write_text(json.dumps(data))
    (tmp_path / film_of(ids[2])).write_bytes(b"RIFF")
    (tmp_path / film_of(ids[3])).unlink()
    assert set(stale_films(tmp_path, ids)) == set(ids[1:])
    assert main(["films", str(tmp_path), "--check", "--ids", *ids[:2]]) == 1
    assert capsys.readouterr().out == f"{ids[1]}: older than what draws it\n"
    assert main(["films", str(tmp_path), "--check", "--ids", ids[0]]) == 0


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


def test_a_page_of_times_and_the_data_beside_it_are_written_together(tmp_path, monkeypatch):
    page, times = Path(shutil.copy(GUIDE, tmp_path)), [FrameTimes(IDS[0], 0.25, 0.125, 2.0)]
    monkeypatch.setattr("rigid_envs.tools.bench.figures.frame_times", lambda *_, **__: times)
    assert main(["frames", "--page", str(page)]) == 0
    text, data = page.read_text(encoding="utf-8"), json.loads(page.with_suffix(".json").read_text())
    assert text == with_table(text, data) and "250.0 ms" in text
    times[0] = FrameTimes(IDS[1], 0.5, 0.125, 2.0)
    assert main(["frames", "--page", str(page), "--ids", IDS[1]]) == 0
    rows = json.loads(page.with_suffix(".json").read_text())["frames"]
    assert [row["frame"] for row in rows] == [0.25, 0.5]
    assert [row.keys() - times[0]._asdict() for row in rows] == [set(), {"provenance"}]


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
        names = {}
        exec(block, names)
        assert names["picture"].shape == (480, 480, 3)
        assert names["second"].shape == (480, 480, 3)
