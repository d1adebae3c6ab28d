"""Display of an environment: pictures of its rows, or a window that shows them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from rigid_envs.core import Core
from rigid_envs.settings import refusal
from rigid_envs.tasks import Task

if TYPE_CHECKING:
    from rigid_envs.render.viewer import Viewer
    from rigid_envs.render.window import Window

__all__ = ["MODES", "Shown", "frames_per_second"]

Image = npt.NDArray[np.uint8]

MODES = ("human", "rgb_array")
_CAMERA = ("target", "distance", "azimuth", "elevation", "field_of_view", "follow")


class Shown:
    """What an environment has for its pictures: `render_mode`, `render` by subclasses, `moment`.

    Raises:
        ConfigError: message ``config.<key>: ...``.
    """

    task: Task
    _core: Core

    def _set_look(
        self, mode: str | None, width: Any, height: Any, camera: Mapping[str, Any] | None
    ) -> None:
        """Check and keep the arguments that concern pictures."""
        if mode is not None and mode not in MODES:
            raise refusal("render_mode", mode, f"None or one of {list(MODES)}")
        for name, value in (("width", width), ("height", height)):
            if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 16:
                raise refusal(name, value, "a number of pixels, an integer from 16")
        for key in camera or {}:
            if key not in _CAMERA:
                raise refusal("camera", key, f"some of the keys {list(_CAMERA)}")
        self.render_mode = mode
        self._look = {"width": int(width), "height": int(height), "camera": dict(camera or {})}
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
        raise NotImplementedError


class Display:
    """Pictures of the rows of a core; the renderer is imported with the first one."""

    def __init__(self, core: Core, look: Mapping[str, Any], title: str) -> None:
        """Nothing is drawn yet."""
        from rigid_envs.render.drawing import Look

        self._core, self._title, self._look = core, title, Look(**look)
        self._viewers: dict[int, Viewer] = {}
        self._window: Window | None = None

    def pictures(self, rows: Iterable[int]) -> tuple[Image, ...]:
        """RGB pictures of rows, each of shape (height, width, 3)."""
        return tuple(self._viewer(row).picture() for row in rows)

    def show(self, rows: Iterable[int], fps: float) -> None:
        """Show rows side by side in a window, in real time."""
        from rigid_envs.render.picture import tiled
        from rigid_envs.render.window import Window

        if self._window is None:
            self._window = Window(self._title)
        self._window.show(tiled(self.pictures(rows)), fps)

    def close(self) -> None:
        """Close the window and free the memory."""
        for viewer in self._viewers.values():
            viewer.close()
        self._viewers.clear()
        if self._window is not None:
            self._window.close()
            self._window = None

    def _viewer(self, row: int) -> Viewer:
        from rigid_envs.render.viewer import Viewer

        if row not in self._viewers:
            self._viewers[row] = Viewer(self._core, row, self._look)
        return self._viewers[row]


def frames_per_second(task: Task) -> int:
    """Pictures per second of real time, one for each control period."""
    return max(1, round(1.0 / task.dt))
