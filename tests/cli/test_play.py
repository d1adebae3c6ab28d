"""`rigid-envs play` tells its keys, and refuses what cannot be before it opens a window."""

from pathlib import Path

import pytest

from rigid_envs.tools.cli import main
from tests.fixtures import Capture, Patch

COIN = "RigidEnvs/CoinPark-v0"


def test_keys_are_told_without_a_display(capsys: Capture) -> None:
    assert main(["play", COIN, "--help-keys"]) == 0
    said = capsys.readouterr().out
    assert "roll forwards" in said and "turn right / left" in said and "gamepad" in said


def test_what_is_played_is_saved(tmp_path: Path, monkeypatch: Patch, capsys: Capture) -> None:
    pygame = pytest.importorskip("pygame")
    pytest.importorskip("panda3d")
    from rigid_envs.watch.play.loop import GameWindow

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    turn = GameWindow.turn

    def hurried(table: GameWindow, _seconds: float) -> None:
        turn(table, 0.1)
        done = table.game.moment.time > 0.5
        key = pygame.K_ESCAPE if done else pygame.K_UP
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))

    monkeypatch.setattr(GameWindow, "turn", hurried)
    file = tmp_path / "mine.npz"
    assert main(["play", COIN, "--seed", "2", "--size", "240", "--save", str(file)]) == 0
    assert f"rigid-envs replay {file}" in capsys.readouterr().out
    assert main(["replay", str(file)]) == 0
    assert "same bits" in capsys.readouterr().out
