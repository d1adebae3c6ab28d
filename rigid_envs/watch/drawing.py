"""Moments of an environment as pictures and in a window."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from rigid_envs.base.checks import Image
from rigid_envs.envs.display import needed
from rigid_envs.tasks.core import Core, Moment
from rigid_envs.tasks.task import Task
from rigid_envs.watch.pixels import Pixels
from rigid_envs.watch.scene import Camera
from rigid_envs.watch.views import view_of

# Pictures side by side.


def tiled(pictures: Sequence[Image]) -> Image:
    """Pictures of one size side by side, in as many lines as columns or one less."""
    n = len(pictures)
    columns = int(np.ceil(np.sqrt(n)))
    lines = -(-n // columns)
    height, width, depth = pictures[0].shape
    page = np.full((lines * height, columns * width, depth), 255, dtype=np.uint8)
    for k, picture in enumerate(pictures):
        i, j = divmod(k, columns)
        page[i * height : (i + 1) * height, j * width : (j + 1) * width] = picture
    return page


# Pictures of moments of one episode.


@dataclass(frozen=True)
class Look:
    """Size and point of view of pictures.

    Attributes:
        width: in pixels.
        height: in pixels.
        camera: fields of `Camera` that differ from those of the scene.
        shadows: whether parts cast shadows on the floor.
    """

    width: int = 480
    height: int = 480
    camera: Mapping[str, Any] = field(default_factory=dict)
    shadows: bool = True


class Drawing:
    """Pictures of an episode; traces grow with every picture.

    Args:
        task: the task.
        parameters: parameters of the system by name, of the episode.
        look: size and point of view.

    Attributes:
        parameters: of the system.
        camera: point of view.

    Raises:
        DependencyNotInstalled: a package that draws is not installed.
    """

    def __init__(self, task: Task, parameters: Mapping[str, float], look: Look) -> None:
        """Make the scene."""
        self.parameters = dict(parameters)
        self._view = view_of(task, self.parameters)
        scene = self._view.scene
        self.camera: Camera = replace(scene.camera, **look.camera)
        self._pixels = Pixels(scene, look.width, look.height, self.camera, look.shadows)

    def picture(self, moment: Moment, extend: bool = True) -> Image:
        """RGB picture of a moment, shape (height, width, 3).

        Args:
            moment: what is drawn.
            extend: whether traces grow by it.
        """
        return self._pixels.draw(self._view.frame(moment), extend)

    def clear(self) -> None:
        """Forget the traces: another episode with the same parameters begins."""
        self._pixels.clear()

    def close(self) -> None:
        """Free the memory."""
        self._pixels.close()


# Pictures of one row of an environment.


class Viewer:
    """Pictures of a row: a line of a trace has a point for each moment of which one was made."""

    def __init__(self, core: Core, row: int, look: Look) -> None:
        """Nothing is drawn yet."""
        self._core, self._row, self._look = core, row, look
        self._episode = (-1, -1.0)  # number of the episode, time of the last picture
        self._drawing: Drawing | None = None

    def picture(self) -> Image:
        """RGB picture of the present state, shape (height, width, 3)."""
        moment, number = self._core.moment(self._row), self._core.episode(self._row)
        if self._drawing is None or self._drawing.parameters != moment.parameters:
            self.close()
            self._drawing = Drawing(self._core.task, moment.parameters, self._look)
        last, time = self._episode
        if number != last or moment.time < time:
            self._drawing.clear()
        extend = (number, moment.time) != self._episode
        self._episode = (number, moment.time)
        return self._drawing.picture(moment, extend)

    def close(self) -> None:
        """Free the memory."""
        if self._drawing is not None:
            self._drawing.close()
            self._drawing = None


# Window that shows pictures.


def load_pygame() -> Any:
    """The module `pygame`.

    Raises:
        DependencyNotInstalled: it is not installed.
    """
    return needed("pygame", "a window needs pygame")


def has_display() -> bool:
    """Whether a window can be opened here, as far as the environment of the process says."""
    if os.environ.get("SDL_VIDEODRIVER"):
        return True
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


class Window:
    """A window of pygame.

    Args:
        title: of the window.

    Raises:
        DependencyNotInstalled: pygame is not installed.
    """

    def __init__(self, title: str) -> None:
        """No window yet: the first picture opens it."""
        self._pygame = load_pygame()
        self._title = title
        self._screen: Any = None
        self._clock: Any = None

    @property
    def is_open(self) -> bool:
        """Whether a picture has been shown."""
        return self._screen is not None

    def show(self, picture: Image, fps: float) -> None:
        """Show a picture, at the earliest 1 / fps seconds after the last one.

        Args:
            picture: RGB, shape (height, width, 3).
            fps: pictures per second; 0 does not wait.
        """
        pygame = self._pygame
        height, width, _ = picture.shape
        if self._screen is None or self._screen.get_size() != (width, height):
            pygame.display.init()
            self._screen = pygame.display.set_mode((width, height))
            pygame.display.set_caption(self._title)
            self._clock = pygame.time.Clock()
        surface = pygame.image.frombuffer(np.ascontiguousarray(picture), (width, height), "RGB")
        self._screen.blit(surface, (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        if fps:
            self._clock.tick(fps)

    def close(self) -> None:
        """Close the window."""
        if self._screen is not None:
            self._pygame.display.quit()
            self._screen = None
