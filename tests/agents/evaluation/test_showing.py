"""A trained policy can be looked at: a film beside its learning curve, and what `enjoy` shows."""

import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from agents.cli.command_line import main
from agents.evaluation import showing as short_film
from agents.evaluation.showing import try_film
from rigid_envs import load
from rigid_envs.scores.starts import TEST_SEED
from tests.films.test_film import read_video
from tests.programs import python

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("without_display")]

pygame = pytest.importorskip("pygame")
pytest.importorskip("panda3d")

SMALL = "--n_envs 8 --n_steps 16 --batch_size 64 --n_epochs 1 --eval_episodes 4 --quiet"
TRAIN = ["train", *SMALL.split()]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    logs = tmp_path_factory.mktemp("logs")
    words = [*TRAIN, "--total_timesteps", "512"]
    with pytest.MonkeyPatch.context() as patch:
        # A busy machine would leave out the end of the film.
        patch.setattr(short_film, "BUDGET", 600.0)
        assert main([*words, "--log_dir", str(logs)]) == 0
    return logs / "ppo" / "BallPark-v0_1"


@pytest.mark.push
def test_training_leaves_a_film_of_its_policy(run):
    meta, pictures = read_video(run / "film.mp4")
    assert meta["codec"] == "h264" and len(pictures) > 20
    steps = int((run / "episodes.csv").read_text().splitlines()[1].split(",")[3])
    shown = steps * 0.1 + 1.0  # in real time, and the end stays for a second
    assert meta["duration"] == pytest.approx(shown, abs=0.2)


def test_training_ends_with_the_path_of_the_film_and_shows_no_progress_where_it_is_quiet(
    tmp_path, capsys, monkeypatch
):
    told = []
    monkeypatch.setattr("agents.evaluation.reports.tell", told.append)
    words = [*TRAIN, "--total_timesteps", "128"]
    assert main([*words, "--env_id", "RigidEnvs/RollPump-v0", "--log_dir", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    found = re.search(r"In (\S+):\n +(film\.mp4) +what it does\n", said)
    assert found is not None and (Path(found[1]) / found[2]).is_file() and not told


def test_a_film_costs_at_most_its_time(run, tmp_path, monkeypatch):
    from rigid_envs.watch.drawing import Drawing

    draw, clock = Drawing.picture, [0.0]

    def slow(self, *given):
        clock[0] += 0.05
        return draw(self, *given)

    monkeypatch.setattr(Drawing, "picture", slow)
    monkeypatch.setattr(short_film, "BUDGET", 1.5)
    monkeypatch.setattr(short_film, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    path = try_film(load(run / "best_model"), tmp_path, TEST_SEED)
    assert clock[0] < 1.6
    assert path is not None and len(read_video(path)[1]) > 3


def test_a_film_changes_no_result(run):
    names = ("results.json", "episodes.csv", "progress.csv")
    before = [(run / name).read_bytes() for name in names]
    state = np.random.get_state()[1].tobytes()  # noqa: NPY002
    try_film(load(run / "best_model"), run, TEST_SEED)
    assert [(run / name).read_bytes() for name in names] == before
    assert np.random.get_state()[1].tobytes() == state  # noqa: NPY002
    assert "film" not in json.loads((run / "results.json").read_text())


def test_without_the_extra_training_says_so_in_a_line_and_ends_well(tmp_path):
    code = """
import sys
for name in ("imageio_ffmpeg", "moviepy", "panda3d", "pygame"):
    sys.modules[name] = None
from agents.cli.command_line import main
sys.exit(main(sys.argv[1:]))
"""
    words = [*TRAIN, "--total_timesteps", "128"]
    answer = python("-c", code, *words, "--log_dir", tmp_path)
    assert answer.returncode == 0, answer.stderr
    assert answer.stderr.count("\n") == 1 and 'pip install "rigid-envs[render]"' in answer.stderr
    assert "film.mp4" not in answer.stdout and "python -m agents enjoy" in answer.stdout
    run = tmp_path / "ppo" / "BallPark-v0_1"
    assert (run / "results.json").exists() and not (run / "film.mp4").exists()


def test_whatever_fails_does_not_fail_the_training(run, tmp_path, monkeypatch, capsys):
    def broken(*_, **__):
        raise OSError("no space")

    monkeypatch.setattr("rigid_envs.watch.films.write_film", broken)
    assert try_film(load(run / "best_model"), tmp_path, TEST_SEED) is None
    assert capsys.readouterr().err == "no film of the policy: OSError: no space\n"


@pytest.mark.push
def test_enjoy_without_a_display_writes_a_film_and_says_where(run, capsys):
    assert main(["enjoy", str(run), "--seed", "4"]) == 0
    *table, film = capsys.readouterr().out.splitlines()
    assert "return" in table[-1] and film.startswith(f"film: {run / 'enjoy.mp4'} (")
    assert read_video(run / "enjoy.mp4")[0]["size"][0] == 480


def test_enjoy_shows_policy_and_controller_side_by_side(run, tmp_path, capsys):
    film = tmp_path / "a.mp4"
    words = ["--against", "reference", "--video", str(film), "--seed", "4"]
    assert main(["enjoy", str(run), *words]) == 0
    said = capsys.readouterr().out
    assert re.search(r"PPO: .*shortest_path: path [\d.]+ m", said) and str(film) in said
    assert "960 x" in said and film.stat().st_size > 1000


def test_enjoy_writes_a_page_for_a_browser(run, tmp_path):
    page = tmp_path / "a.html"
    assert main(["enjoy", str(run), "--html", str(page), "--against", "three_rolls"]) == 0
    text = page.read_text()
    assert "three_rolls" in text and "PPO" in text
    assert not (tmp_path / "enjoy.mp4").exists()


def test_enjoy_opens_a_window_where_there_is_a_display(run, monkeypatch, capsys):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    seen = []
    flip = pygame.display.flip

    def counted():
        flip()
        seen.append(pygame.display.get_surface().get_size())
        key = {3: pygame.K_SPACE, 5: pygame.K_r, 8: pygame.K_ESCAPE}.get(len(seen))
        if key is not None:
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))
            if key == pygame.K_SPACE:  # and goes on
                pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))

    monkeypatch.setattr(pygame.display, "flip", counted)
    (run / "enjoy.mp4").unlink(missing_ok=True)
    assert main(["enjoy", str(run)]) == 0
    assert len(seen) == 8 and seen[0][0] == 480
    assert not (run / "enjoy.mp4").exists() and "film" not in capsys.readouterr().out
    assert not pygame.display.get_init()


def test_enjoy_prints_only_if_asked(run, capsys):
    (run / "enjoy.mp4").unlink(missing_ok=True)
    assert main(["enjoy", str(run), "--table"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("return")
    assert not (run / "enjoy.mp4").exists()


def test_enjoy_without_the_extra_prints_and_says_what_to_install(run, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert main(["enjoy", str(run)]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[-1].startswith("return")
    assert said.err.startswith("not shown: ") and 'pip install "rigid-envs[render]"' in said.err
    assert main(["enjoy", str(run), "--video", "a.mp4"]) == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--video a.avi", r"--video: film = 'a\.avi'; expected a name that ends in"),
        ("--video no/a.mp4", "expected a file in a folder that exists"),
        ("--html a.txt", r"--html = a\.txt; expected NAME\.html"),
        ("--against nobody", "controller = 'nobody'; expected one of"),
        ("--table --video a.mp4", "--table prints only; leave out --video"),
    ],
)
def test_a_mistake_is_refused_before_anything_is_played(run, words, message, capsys):
    assert main(["enjoy", str(run), *words.split()]) == 2
    said = capsys.readouterr()
    assert re.search(message, said.err) and said.err.count("\n") == 1 and said.out == ""
