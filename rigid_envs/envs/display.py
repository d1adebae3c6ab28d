"""Packages of the extra "render", imported where they are needed."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium as gym
from gymnasium.error import DependencyNotInstalled

from rigid_envs.base.checks import Image
from rigid_envs.base.settings import Either, Integer, List, Null, Number, Rule, Text, refusal
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.task import Task

# Packages of the extra "render", imported where they are needed.


def needed(module: str, why: str) -> Any:
    """A module of the extra "render".

    Args:
        module: its name.
        why: the begin of the message, as "pictures need Pillow".

    Raises:
        DependencyNotInstalled: it is missing; names the command that installs it.
    """
    try:
        importlib.import_module(module.partition(".")[0])
        return importlib.import_module(module)
    except ImportError as error:
        raise DependencyNotInstalled(f'{why}: pip install "rigid-envs[render]"') from error


# Display of an environment: pictures of its rows, or a window that shows them.

MODES = ("human", "rgb_array")
_SIZE = Integer("width or height of a picture in pixels", 16, 8192)
_ANGLE = Number("angle", "deg", -360.0, 360.0)
_CAMERA: Mapping[str, Rule] = {
    "target": List("point in the middle of the picture", Number("", "m", -1e6, 1e6), 3, 3),
    "distance": Number("from target to camera", "m", 0.0, 1e6, above=True),
    "azimuth": _ANGLE,
    "elevation": Number("above the horizontal plane", "deg", -90.0, 90.0),
    "field_of_view": Number("vertical angle", "deg", 1.0, 150.0),
    "follow": Either("part that the camera follows", (Null(), Text("", "a text", bool))),
}


class Shown:
    """What an environment has for its pictures: `render_mode`, `render` by subclasses, `moment`.

    Raises:
        ConfigError: message ``config.<key>: ...``.
    """

    task: Task
    spec: Any
    _core: Core

    def _set_look(
        self, mode: Any, width: Any, height: Any, camera: Mapping[str, Any] | None
    ) -> None:
        """Check and keep the arguments that concern pictures."""
        if mode is not None and not (isinstance(mode, str) and mode in MODES):
            raise refusal("render_mode", mode, f"None or one of {list(MODES)}")
        sizes = {
            name: _checked(name, n, _SIZE) for name, n in (("width", width), ("height", height))
        }
        self.render_mode = mode
        self._look = {**sizes, "camera": _checked_camera(camera)}
        self._display: Display | None = None

    def __getstate__(self) -> dict[str, Any]:
        """All attributes except the display, which is made again where it is needed."""
        return {**self.__dict__, "_display": None}

    def _pictures(self, rows: Iterable[int]) -> tuple[Image, ...] | None:
        """Pictures of rows, or None in the mode "human", which shows them, and without a mode."""
        if self.render_mode is None:
            gym.logger.warn(
                f"{self._name}: render without a render_mode; "
                'make the environment with render_mode="rgb_array" or "human"'
            )
            return None
        if self._display is None:
            self._display = Display(self._core, self._look, self._name)
        if self.render_mode == "rgb_array":
            return self._display.pictures(rows)
        self._display.show(rows, frames_per_second(self.task))
        return None

    def _close_display(self) -> None:
        if self._display is not None:
            self._display.close()
            self._display = None

    @property
    def _name(self) -> str:
        """The id for messages."""
        return self.spec.id if self.spec is not None else type(self.task).__name__


class Display:
    """Pictures of the rows of a core; the renderer is imported with the first one."""

    def __init__(self, core: Core, look: Mapping[str, Any], title: str) -> None:
        """Nothing is drawn yet."""
        self._core, self._title = core, title
        self._drawing: Any = importlib.import_module("rigid_envs.watch.drawing")
        self._look = self._drawing.Look(**look)
        self._viewers: dict[int, Any] = {}
        self._window: Any = None

    def pictures(self, rows: Iterable[int]) -> tuple[Image, ...]:
        """RGB pictures of rows, each of shape (height, width, 3)."""
        return tuple(self._viewer(row).picture() for row in rows)

    def show(self, rows: Iterable[int], fps: float) -> None:
        """Show rows side by side in a window, in real time."""
        if self._window is None:
            self._window = self._drawing.Window(self._title)
        self._window.show(self._drawing.tiled(self.pictures(rows)), fps)

    def close(self) -> None:
        """Close the window and free the memory."""
        for viewer in self._viewers.values():
            viewer.close()
        self._viewers.clear()
        if self._window is not None:
            self._window.close()
            self._window = None

    def _viewer(self, row: int) -> Any:
        if row not in self._viewers:
            self._viewers[row] = self._drawing.Viewer(self._core, row, self._look)
        return self._viewers[row]


def frames_per_second(task: Task) -> int:
    """Pictures per second of real time, one for each control period."""
    return max(1, round(1.0 / task.dt))


def _checked_camera(camera: Any) -> dict[str, Any]:
    """Fields of `rigid_envs.watch.scene.Camera`."""
    keys = f"None or a dictionary with some of the keys {list(_CAMERA)}"
    if camera is None:
        return {}
    if not isinstance(camera, Mapping):
        raise refusal("camera", camera, keys)
    for key in camera:
        if key not in _CAMERA:
            raise refusal("camera", key, keys)
    return {key: _checked(f"camera.{key}", value, _CAMERA[key]) for key, value in camera.items()}


def _checked(key: str, value: Any, rule: Rule) -> Any:
    try:
        return rule.check(value)
    except (ValueError, TypeError, OverflowError):
        raise refusal(key, value, str(rule)) from None
