"""`rigid-envs replay`: what it prints, writes and refuses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigid_envs.tools.cli import main
from rigid_envs.watch.replays.episode import play_again
from rigid_envs.watch.replays.replay import Replay, load_replay
from tests.fixtures import Capture, Patch
from tests.replays.examples import free_body, rolling_ball


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("replays")
    return [
        free_body(20).save(folder / "body.npz"),
        rolling_ball("policy", 0, 10).save(folder / "ball.npz"),
    ]


def test_episodes_are_printed_and_played_again(files: list[Path], capsys: Capture) -> None:
    assert main(["replay", *map(str, files)]) == 0
    text = capsys.readouterr().out
    assert "RigidEnvs/IntermediateAxis-v0   cost: torque impulse [N m s]" in text
    assert text.count("same bits") == 2 and "policy" in text


def test_the_status_says_whether_a_file_tells_what_its_actions_lead_to(
    files: list[Path], tmp_path: Path, capsys: Capture
) -> None:
    replay = load_replay(files[0])
    (episode,) = replay.episodes
    better = replace(episode, rewards=episode.rewards + 1.0)
    edited = replace(replay, episodes=(better,)).save(tmp_path / "edited.npz")
    assert main(["replay", str(files[1]), str(edited)]) == 1
    assert "other bits" in capsys.readouterr().out


def test_a_row_says_whether_the_last_step_was_a_success_and_how_the_episode_ended(
    files: list[Path], tmp_path: Path, capsys: Capture
) -> None:
    replay = load_replay(files[1])
    (episode,) = replay.episodes
    first, last = ([k == end for k in range(len(episode))] for end in (0, len(episode) - 1))
    told = ((last, True, False), (first, False, True), (first, False, False))
    episodes = [
        replace(episode, success=np.array(won), terminated=ended, truncated=cut)
        for won, ended, cut in told
    ]
    file = replace(replay, episodes=tuple(episodes)).save(tmp_path / "ends.npz")
    assert main(["replay", str(file)]) == 1
    rows = [line.split("  ") for line in capsys.readouterr().out.splitlines()[3:]]
    words = [[word.strip() for word in row if word.strip()][-3:-1] for row in rows]
    assert words == [["yes", "ended"], ["no", "cut off"], ["no", "left"]]


def test_a_page_of_several_files_is_written(
    files: list[Path], tmp_path: Path, capsys: Capture
) -> None:
    out = tmp_path / "page.html"
    assert main(["replay", *map(str, files), "--html", str(out)]) == 0
    assert f"written to {out}" in capsys.readouterr().out
    assert out.read_text().startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("words", "lengths"),
    [
        ("MANY", [1, 2, 3, 4]),  # a page has room for so many
        ("MANY BALL", [1, 10]),
        ("BALL MANY", [10, 1]),
        ("MANY --episodes 4 2", [5, 3]),
        ("MANY BALL --episodes 0", [1, 10]),
    ],
)
def test_the_first_episodes_of_a_file_or_the_first_of_each_are_shown_or_those_that_are_named(
    files: list[Path], tmp_path: Path, monkeypatch: Patch, words: str,
    lengths: list[int]
) -> None:  # fmt: skip
    ball = rolling_ball("policy", 0, 6)
    (whole,) = ball.episodes
    many = [play_again(ball.task, whole.start, whole.actions[:k]) for k in range(1, 6)]
    places = {
        "MANY": str(replace(ball, episodes=tuple(many)).save(tmp_path / "many.npz")),
        "BALL": str(files[1]),
    }
    shown: list[int] = []

    def note(file: Path, chosen: list[tuple[Replay, int]]) -> Path:
        shown.extend(len(replay.episodes[k]) for replay, k in chosen)
        return Path(places["MANY"])

    monkeypatch.setattr("rigid_envs.tools.cli.watching.write_html", note)
    given = [places.get(word, word) for word in words.split()]
    assert main(["replay", *given, "--html", str(tmp_path / "page.html")]) == 0
    assert shown == lengths


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("none.npz", "FILE = none.npz; expected a replay: there is no such file"),
        (__file__, "not a whole .npz archive"),
        ("BALL --html none/page.html", "expected a file in a folder that exists"),
        ("BALL --episodes 7 --html OUT", "episode = 7; expected 0 to 0"),
        ("BALL --more 3", "expected one of those that --help lists"),
        ("BALL --video a.avi", "expected a name that ends in"),
        ("BALL --video a.mp4 --speed 0", "--speed = 0.0; expected a positive"),
    ],
)
def test_what_cannot_be_shown_is_refused(
    files: list[Path], tmp_path: Path, arguments: str, message: str, capsys: Capture
) -> None:
    places = {"BALL": str(files[1]), "OUT": str(tmp_path / "page.html")}
    assert main(["replay", *(places.get(word, word) for word in arguments.split())]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.out == "" or "--episodes" in arguments  # which are counted once they are shown
    assert not (tmp_path / "page.html").exists()


def test_a_film_of_several_files_is_written(
    files: list[Path], tmp_path: Path, capsys: Capture
) -> None:
    pytest.importorskip("panda3d")
    film = tmp_path / "both.webp"
    words = [str(file) for file in files[:2]]
    assert main(["replay", *words, "--video", str(film), "--speed", "4"]) == 0
    assert f"written to {film}" in capsys.readouterr().out
    assert film.read_bytes()[8:12] == b"WEBP"
