"""Progress of commands: one line on a terminal, and elsewhere a line now and then."""

import itertools

import pytest

from rigid_envs.cli import progress


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(progress, "_pace", progress._Pace())
    return now


def test_off_a_terminal_lines_come_ever_more_seldom(
    clock: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    times = []
    for second in range(3600):
        clock[0] = float(second)
        progress.tell(f"{second}")
        times += [int(line) for line in capsys.readouterr().err.splitlines()]
    assert times[0] == 10 and len(times) < 60
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert gaps == sorted(gaps) and gaps[0] == 10 and gaps[-1] > 300


def test_a_quick_command_says_nothing_and_a_cleared_line_neither(
    clock: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    progress.tell("1 of 500")
    clock[0] = 60.0
    progress.tell("")
    assert capsys.readouterr().err == ""


def test_on_a_terminal_it_is_one_line(
    clock: list[float], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    progress.tell("1 of 500")
    progress.tell("")
    assert capsys.readouterr().err == "\r\x1b[K1 of 500\r\x1b[K"
