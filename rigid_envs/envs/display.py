"""Display of an environment: pictures of its rows, or a window that shows them."""

import importlib
from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium as gym
from gymnasium.error import ClosedEnvironmentError, DependencyNotInstalled, ResetNeeded

from rigid_envs.base import settings
from rigid_envs.base.checks import Image
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.task import Task


def needed(module: str, why: str) -> Any:
    """A module of the extra "render".

    Args:
        module: its name.
        why: the begin of the message, as "pictures need Pillow".

    Raises:
        DependencyNotInstalled: it is missing; names the command that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise DependencyNotInstalled(f'{why}: pip install "rigid-envs[render]"') from error


MODES = ("human", "rgb_array")
_SIZE = settings.Integer("width or height of a picture in pixels", 16, 8192)
_ANGLE = settings.Number("angle", "deg", -360.0, 360.0)
_CAMERA: Mapping[str, settings.Rule] = {
    "target": settings.List(
        "point in the middle of the picture", settings.Number("", "m", -1e6, 1e6), 3, 3
    ),
    "distance": settings.Number("from target to camera", "m", 0.0, 1e6, above=True),
    "azimuth": _ANGLE,
    "elevation": settings.Number("above the horizontal plane", "deg", -90.0, 90.0),
    "field_of_view": settings.Number("vertical angle", "deg", 1.0, 150.0),
    "follow": settings.Either(
        "part that the camera follows", (settings.Null(), settings.Text("", "a text", bool))
    ),
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
            raise settings.refusal("render_mode", mode, f"None or one of {list(MODES)}")
        sides = {"width": width, "height": height}
        sizes = {name: settings.checked(name, n, _SIZE) for name, n in sides.items()}
        self.render_mode = mode
        self._look = {**sizes, "camera": _checked_camera(camera)}
        # drawing of each row, with episode and time of its last picture; types of `watch`, above
        self._drawn: dict[int, tuple[Any, int, float]] = {}
        self._window: Any = None

    def _refuse_without_episode(self, what: str, closed: bool, fresh: bool) -> None:
        """Refuse what needs an episode.

        Raises:
            ResetNeeded: before the first `reset`.
            ClosedEnvironmentError: after `close`.
        """
        if closed:
            raise ClosedEnvironmentError(f"{self._name}: {what} after close; call reset first")
        if fresh:
            raise ResetNeeded(f"{self._name}: {what} before the first reset; call reset first")

    def __getstate__(self) -> dict[str, Any]:
        """All attributes except drawings and window, which are made again where they are needed."""
        return {**self.__dict__, "_drawn": {}, "_window": None}

    def _pictures(self, rows: Iterable[int]) -> tuple[Image, ...] | None:
        """Pictures of rows, or None in the mode "human", which shows them, and without a mode."""
        if self.render_mode is None:
            gym.logger.warn(
                f"{self._name}: render without a render_mode; "
                'make the environment with render_mode="rgb_array" or "human"'
            )
            return None
        pictures = tuple(self._picture(row) for row in rows)
        if self.render_mode == "rgb_array":
            return pictures
        watch = importlib.import_module("rigid_envs.watch.pictures")
        if any(self._drawn[row][2] for row in rows):  # a start alone is shown by checkers
            watch.check_display()
        self._window = self._window or watch.Window(self._name)
        self._window.show(watch.tiled(pictures), frames_per_second(self.task))
        return None

    def _picture(self, row: int) -> Image:
        """Picture of a row: a trace has a point for each moment of which one was made."""
        watch = importlib.import_module("rigid_envs.watch.drawing")  # the renderer: only here
        moment, episode = self._core.moment(row), self._core.episode(row)
        drawing, *last = self._drawn.get(row, (None, -1, -1.0))
        if drawing is None or drawing.view.parameters != moment.parameters:
            if drawing is not None:
                drawing.close()
            drawing = watch.drawing_of(self.task, moment.parameters, watch.Look(**self._look))
        if episode != last[0] or moment.time < last[1]:
            drawing.clear()
        self._drawn[row] = drawing, episode, moment.time
        picture: Image = drawing.picture(moment, extend=last != [episode, moment.time])
        return picture

    def _close_display(self) -> None:
        """Close the window and free the memory."""
        for drawing, *_ in self._drawn.values():
            drawing.close()
        if self._window is not None:
            self._window.close()
        self._drawn, self._window = {}, None

    @property
    def _name(self) -> str:
        """The id for messages."""
        return self.spec.id if self.spec is not None else type(self.task).__name__


def frames_per_second(task: Task) -> int:
    """Pictures per second of real time, one for each control period."""
    return max(1, round(1.0 / task.dt))


def _checked_camera(camera: Any) -> dict[str, Any]:
    """Fields of `rigid_envs.watch.views.Camera`."""
    keys = f"None or a dictionary with some of the keys {list(_CAMERA)}"
    if camera is None:
        return {}
    if not isinstance(camera, Mapping):
        raise settings.refusal("camera", camera, keys)
    checked = {}
    for key, value in camera.items():
        if key not in _CAMERA:
            raise settings.refusal("camera", key, keys)
        checked[key] = settings.checked(f"camera.{key}", value, _CAMERA[key])
    return checked
