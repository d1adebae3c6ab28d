"""Whatever a path is, a command ends in one line that names it, with a status and no trace."""

from pathlib import Path

import pytest

from rigid_envs.cli import main
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
