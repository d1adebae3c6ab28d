"""Keyboard, mouse and gamepad as a stick and commands."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.play.steering import RIGHT, TWIST, UP, blended

__all__ = ["COMMANDS", "HELP", "Hands", "dead"]

Array = npt.NDArray[np.float64]

_KEYS = {
    "right": (RIGHT, 1.0), "d": (RIGHT, 1.0), "left": (RIGHT, -1.0), "a": (RIGHT, -1.0),
    "up": (UP, 1.0), "w": (UP, 1.0), "down": (UP, -1.0), "s": (UP, -1.0),
    "e": (TWIST, 1.0), "q": (TWIST, -1.0),
}  # fmt: skip
"""Axis of the stick and side of every key."""

COMMANDS = {
    "space": "pause", "p": "pause", "r": "again", "n": "next", "return": "next",
    "tab": "slow", "h": "help", "f1": "help", "escape": "quit",
}  # fmt: skip
"""What other keys do."""

HELP = {RIGHT: "right, left (D, A)", UP: "up, down (W, S)", TWIST: "E, Q"}
"""Keys of each axis of the stick, in words."""

_BUTTONS = {0: "again", 1: "help", 2: "slow", 3: "next", 4: "again", 6: "pause"}
_PAD = {11: "up", 12: "down", 13: "left", 14: "right"}
_STICKS = {0: (RIGHT, 1.0), 1: (UP, -1.0), 2: (TWIST, 1.0)}  # left stick, right stick sideways
_DEAD, _FULL = 0.15, 32767.0
_REACH = 0.35  # of the picture's width, from its middle to a full deflection of the mouse


def dead(value: float) -> float:
    """Deflection of a gamepad's stick: 0 in the dead zone, and from there on linear to 1."""
    size = max(0.0, abs(value) - _DEAD) / (1.0 - _DEAD)
    return float(np.copysign(min(size, 1.0), value))


class Hands:
    """What is held now.

    Args:
        pygame: the module.
        size: width and height of the picture in which the mouse steers, in pixels.

    Attributes:
        directions: pressed since they were last taken, (right, up) each, for moves on a grid.
    """

    def __init__(self, pygame: Any, size: tuple[int, int]) -> None:
        """Nothing is held."""
        self._pygame, self._size = pygame, size
        self._held: set[str] = set()
        self._keys, self._mouse, self._pad = np.zeros(3), np.zeros(3), np.zeros(3)
        self.directions: deque[tuple[float, float]] = deque(maxlen=2)

    def take(self, event: Any) -> str | None:
        """Take an event of pygame; returns the command that it gives, if any."""
        pygame = self._pygame
        kind = event.type
        if kind == pygame.QUIT:
            return "quit"
        if kind in (pygame.KEYDOWN, pygame.KEYUP):
            return self._key(pygame.key.name(event.key), kind == pygame.KEYDOWN)
        if kind in (pygame.CONTROLLERBUTTONDOWN, pygame.CONTROLLERBUTTONUP):
            pressed = kind == pygame.CONTROLLERBUTTONDOWN
            if event.button in _PAD:
                return self._key(_PAD[event.button], pressed)
            return _BUTTONS.get(event.button) if pressed else None
        if kind == pygame.CONTROLLERAXISMOTION and event.axis in _STICKS:
            axis, sign = _STICKS[event.axis]
            self._pad[axis] = sign * dead(event.value / _FULL)
        elif kind == pygame.WINDOWFOCUSLOST:
            self.release()
        elif kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEMOTION, pygame.MOUSEBUTTONUP):
            self._point(event, kind == pygame.MOUSEBUTTONDOWN)
        return None

    def stick(self, dt: float) -> Array:
        """Right, up and twist after a time dt [s], each in [-1, 1]."""
        aim = np.zeros(3)
        for name in self._held:
            axis, side = _KEYS[name]
            aim[axis] = np.clip(aim[axis] + side, -1.0, 1.0)
        self._keys = blended(self._keys, aim, dt)
        return np.clip(self._keys + self._mouse + self._pad, -1.0, 1.0)

    def release(self) -> None:
        """Let go of everything."""
        self._held.clear()
        self.directions.clear()
        for part in (self._keys, self._mouse, self._pad):
            part[:] = 0.0

    def _key(self, name: str, pressed: bool) -> str | None:
        if name not in _KEYS:
            return COMMANDS.get(name) if pressed else None
        if not pressed:
            self._held.discard(name)
            return None
        if name not in self._held:
            self._held.add(name)
            axis, side = _KEYS[name]
            if axis != TWIST:
                self.directions.append((side, 0.0) if axis == RIGHT else (0.0, side))
        return None

    def _point(self, event: Any, pressed: bool) -> None:
        """Left button: right and up, by where the mouse is; right button: twist."""
        held = self._pygame.mouse.get_pressed() if not hasattr(event, "buttons") else event.buttons
        if event.type == self._pygame.MOUSEBUTTONUP:
            held = tuple(down and k + 1 != event.button for k, down in enumerate(held))
        elif pressed:
            held = tuple(down or k + 1 == event.button for k, down in enumerate(held))
        width, height = self._size
        reach = _REACH * width
        x = (event.pos[0] - 0.5 * width) / reach
        y = (0.5 * height - event.pos[1]) / reach
        length = max(1.0, float(np.hypot(x, y)))
        self._mouse[:] = 0.0
        if held[0]:
            self._mouse[RIGHT], self._mouse[UP] = x / length, y / length
            if pressed:
                self.directions.append((x, y))
        if held[2]:
            self._mouse[TWIST] = np.clip(x, -1.0, 1.0)
