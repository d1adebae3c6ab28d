"""Progress of commands: one line on a terminal, and elsewhere a line now and then."""

import io
import itertools
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rigid_envs.mechanics.laws import Outcome
from rigid_envs.scores.best import best_known
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.tools.cli import main
from rigid_envs.tools.cli import words as progress
from rigid_envs.tools.laws import SUBJECTS
from tests.bench.examples import FIGURES
from tests.fixtures import Capture, Patch


@pytest.fixture
def clock(monkeypatch: Patch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(progress, "_pace", progress._Pace())
    return now


def test_off_a_terminal_lines_come_ever_more_seldom(clock: list[float], capsys: Capture) -> None:
    times = []
    for second in range(3600):
        clock[0] = float(second)
        progress.tell(f"{second}")
        times += [int(line) for line in capsys.readouterr().err.splitlines()]
    assert times[0] == 10 and len(times) < 60
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert gaps == sorted(gaps) and gaps[0] == 10 and gaps[-1] > 300


def test_a_quick_command_says_nothing_and_a_cleared_line_neither(
    clock: list[float], capsys: Capture
) -> None:
    progress.tell("1 of 500")
    clock[0] = 60.0
    progress.tell("")
    assert capsys.readouterr().err == ""


def test_on_a_terminal_it_is_one_line(
    clock: list[float], capsys: Capture, monkeypatch: Patch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    progress.tell("1 of 500")
    progress.tell("")
    assert capsys.readouterr().err == "\r\x1b[K1 of 500\r\x1b[K"


CLEAR = "\r\x1b[K"
WORK = {  # of the verbs that tell progress: what does it, and what it gives; None is left to do it
    "dataset BallPark --policy zero": ("rigid_envs.tools.datasets.write", "name"),
    "evaluate BallGrid --policy zero --starts 1": None,
    "best BallGrid": ("rigid_envs.tools.cli.scoring._measured", best_known("BallGrid")),
    "bench --ids BallGrid": ("rigid_envs.tools.bench.bench", FIGURES),
    "verify upright_coin": (
        "rigid_envs.tools.laws.check_all",
        [Outcome(SUBJECTS["upright_coin"].laws[0], 0.0, 0.0)],
    ),
    "verify --policies BallGrid": None,
    "verify --scores BallGrid": ("rigid_envs.scores.best_known", None),
    "verify row.json": None,
    "gallery racket --out .": ("rigid_envs.tools.gallery.write_figures", []),
    "films . --ids BallGrid": ("rigid_envs.tools.cli.watching.write_films", None),
    "frames --ids BallGrid": ("rigid_envs.tools.bench.frames.frame_times", []),
    "compile BallGrid": ("rigid_envs.envs.lookup.compile_all", [("BallGrid step", True)]),
}


class Stream(io.StringIO):
    """One of the streams of a command to a terminal, where what both say stands together."""

    def __init__(self, screen: list[str]) -> None:
        super().__init__()
        self.screen = screen

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        self.screen.append(text)
        return super().write(text)

    def lines(self) -> list[str]:
        """What stands on the terminal in the end."""
        return [line.rpartition(CLEAR)[2] for line in "".join(self.screen).split("\n")]


def streams(monkeypatch: Patch) -> tuple[Stream, Stream]:
    """Those of output and of errors, from here on."""
    screen: list[str] = []
    out, err = Stream(screen), Stream(screen)
    monkeypatch.setattr("sys.stdout", out)
    monkeypatch.setattr("sys.stderr", err)
    return out, err


def told(result: Any) -> Callable[..., Any]:
    """Work that tells progress wherever it can, and gives a result or an error."""

    def work(*args: Any, **more: Any) -> Any:
        for each in (*args, *more.values()):
            if callable(each):
                each("half way")
        if isinstance(result, BaseException):
            raise result
        return result

    return work


@pytest.mark.parametrize("words", WORK)
def test_on_a_terminal_nothing_stands_behind_the_progress_and_in_the_end_it_is_gone(
    tmp_path: Path, monkeypatch: Patch, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    evaluate("BallGrid", "zero", n=1).save("row.json")
    if work := WORK[words]:
        monkeypatch.setattr(work[0], told(work[1]))
    out, err = streams(monkeypatch)
    assert main(words.split()) in (0, 1)
    assert any(err.getvalue().split(CLEAR))
    assert err.lines() == out.getvalue().split("\n")


def test_what_is_logged_has_a_line_of_its_own_on_the_stream_of_the_moment(
    monkeypatch: Patch,
) -> None:
    log = logging.getLogger("rigid_envs.engine")
    with progress.messages():
        _, err = streams(monkeypatch)
        progress.tell("half way")
        log.info("compiled the step")
        progress.tell("whole")
        progress.tell("")
    log.info("compiled the reset")
    assert err.lines() == ["rigid-envs: compiled the step", ""]


@pytest.mark.parametrize(
    ("error", "status"), [(ValueError("bad"), 2), (OSError("bad"), 1), (KeyboardInterrupt(), 130)]
)
def test_what_ends_a_command_has_a_status_and_a_line_of_its_own(
    monkeypatch: Patch, error: BaseException, status: int
) -> None:
    monkeypatch.setattr("rigid_envs.tools.laws.check_all", told(error))
    _, err = streams(monkeypatch)
    assert main(["verify", "upright_coin"]) == status
    assert "half way" in err.getvalue()
    assert "\n".join(err.lines()) == ("rigid-envs: bad\n" if error.args else "")


def test_ctrl_c_ends_a_command_that_has_not_begun_yet(monkeypatch: Patch) -> None:
    monkeypatch.setattr("rigid_envs.tools.cli.command_line.run", told(KeyboardInterrupt()))
    _, err = streams(monkeypatch)
    assert main(["list"]) == 130
    assert err.getvalue() == ""
