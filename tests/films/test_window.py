"""The keys of the window in which pictures are shown."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from rigid_envs.watch.window import show

pygame: Any = pytest.importorskip("pygame")
N = 3  # pictures


def shown(monkeypatch: pytest.MonkeyPatch, *typed: str | tuple[str, str]) -> list[int]:
    """Numbers of the pictures, if at each look at the keyboard one of these is found.

    A word is a key that is pressed, a pair a key and what is done with it; "" is nothing.
    """
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    names = {"space": pygame.K_SPACE, "r": pygame.K_r, "escape": pygame.K_ESCAPE, "x": pygame.K_x}
    script, numbers = iter(typed), []

    def events() -> list[Any]:
        word = next(script)  # the window must close before the script is over
        if word == "close":
            return [pygame.event.Event(pygame.QUIT)]
        key, kind = (word, "KEYDOWN") if isinstance(word, str) else word
        return [pygame.event.Event(getattr(pygame, kind), key=names[key])] if key else []

    def pictures() -> Iterator[Any]:
        for k in range(N):
            numbers.append(k)
            yield np.full((8, 8, 3), k, dtype=np.uint8)

    monkeypatch.setattr(pygame.event, "get", events)
    assert show(pictures, 1000.0, "a test")
    assert next(script, None) is None  # and no sooner
    return numbers


def test_the_last_picture_stays_until_the_window_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown(monkeypatch, "", "", "", "", "close") == [0, 1, 2]
    assert shown(monkeypatch, "", "", "", "", "escape") == [0, 1, 2]


def test_escape_closes_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown(monkeypatch, "", "escape") == [0, 1]
    assert shown(monkeypatch, "space", "escape") == [0]


def test_space_pauses_and_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown(monkeypatch, "space", "", "", "escape") == [0]
    assert shown(monkeypatch, "space", "", "space", "", "close") == [0, 1, 2]


def test_r_begins_again_also_after_the_end_or_a_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown(monkeypatch, "", "r", "", "close") == [0, 1, 0, 1]
    assert shown(monkeypatch, "", "", "", "r", "close") == [0, 1, 2, 0]
    assert shown(monkeypatch, "space", "r", "", "close") == [0, 0, 1]


def test_other_keys_and_keys_let_go_do_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    others = [(key, "KEYUP") for key in ("space", "r", "escape")]
    assert shown(monkeypatch, "x", *others, "close") == [0, 1, 2]


def test_where_no_window_can_be_opened_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    assert not show(lambda: iter([np.zeros((8, 8, 3), np.uint8)]), 1000.0, "a test")
