"""Whatever a path is, a command ends in one line that names it, with a status and no trace."""

import re
from pathlib import Path

import pytest

from rigid_envs.tools.cli import main
from tests.paths import NOT_A_FILE, NOT_A_FOLDER, PATHS

READ = [
    ["replay", "PATH"],
    ["replay", "PATH", "--html", "out.html"],
    ["leaderboard", "PATH"],
    ["evaluate", "BallPark", "--policy", "PATH", "--starts", "2"],
    ["best", "BallPark", "--with", "PATH"],
    ["dataset", "--check", "PATH"],
    ["dataset", "BallPark", "--policy", "PATH", "--episodes", "1"],
    ["verify", "--policies", "PATH"],
    ["verify", "PATH/row.json"],
    ["describe", "PATH"],
    ["compile", "PATH"],
    ["play", "PATH"],
]
WRITTEN = [
    ["docs", "PATH", "--ids", "BallPark"],
    ["films", "PATH", "--ids", "BallPark"],
    ["gallery", "racket", "--out", "PATH"],
    ["best", "BallPark", "--starts", "1", "--out", "PATH"],
    ["bench", "--quick", "--ids", "BallPark", "--json", "PATH/out.json"],
    ["verify", "--json", "PATH/out.json"],
    ["frames", "--ids", "BallPark", "--page", "PATH/page.md"],
    ["evaluate", "BallPark", "--policy", "zero", "--starts", "2", "--out", "PATH/out.json"],
]

FIXED = [  # verbs that take no hyperparameters
    *(["list"], ["docs", "new"], ["bench"], ["verify"], ["verify", "--policies"], ["best"]),
    *(["leaderboard", "."], ["frames"], ["films", "new"], ["gallery", "--out", "new"]),
    *(["replay", "some.npz"], ["dataset", "--check", "some"]),
]
OPEN = [
    *(["describe", "BallPark"], ["compile", "BallPark"], ["play", "BallPark", "--help-keys"]),
    ["evaluate", "BallPark", "--policy", "zero", "--starts", "1", "--out", "new"],
    ["dataset", "BallPark", "--policy", "random", "--episodes", "1", "--out", "new"],
]


@pytest.mark.parametrize("words", FIXED + OPEN, ids=" ".join)
def test_an_option_that_a_verb_does_not_have_is_refused_before_anything_is_done(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*words, "--nonsense", "1"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert ("argument = '--nonsense'" if words in FIXED else "config.nonsense: unknown") in err
    assert not list(tmp_path.iterdir())


def test_all_verbs_are_asked(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    verbs = re.findall(r"^    (\w+)\b", capsys.readouterr().out, re.MULTILINE)
    assert len(verbs) > 10 and set(verbs) == {words[0] for words in FIXED + OPEN}


@pytest.mark.parametrize("kind", NOT_A_FILE)
@pytest.mark.parametrize("words", READ, ids=" ".join)
def test_what_is_not_there_or_not_what_it_should_be_is_named_in_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    kind: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    refuse(PATHS[kind](tmp_path), words, capsys)
    assert not (tmp_path / "out.html").exists()


@pytest.mark.parametrize("kind", NOT_A_FOLDER)
@pytest.mark.parametrize("words", WRITTEN, ids=" ".join)
def test_what_cannot_be_a_folder_is_named_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], kind: str
) -> None:
    refuse(PATHS[kind](tmp_path), words, capsys)


def test_a_file_in_the_place_of_a_folder_of_pages_is_a_mistake_of_the_caller(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "docs").write_text("mine")
    assert main(["docs", str(tmp_path / "docs"), "--ids", "BallPark"]) == 2
    assert "docs; expected a folder: this is a file" in capsys.readouterr().err
    assert (tmp_path / "docs").read_text() == "mine"


def refuse(path: Path, words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """Run a command that must end in one line with the path in it, and change no file there."""
    before = path.read_bytes() if path.is_file() else None
    assert main([word.replace("PATH", str(path)) for word in words]) in (1, 2)
    said = capsys.readouterr().err
    assert said.startswith("rigid-envs: ") and said.count("\n") == 1, said
    assert str(path) in said
    assert before is None or path.read_bytes() == before


def test_the_name_of_a_file_cannot_steer_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "\x1b[2J\r.json").touch()
    assert main(["leaderboard", str(tmp_path)]) == 2
    assert "\\x1b[2J\\r.json" in capsys.readouterr().err
