"""Pictures side by side, and in a window."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from rigid_envs.base.checks import Image
from rigid_envs.envs.display import needed


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


# Window that shows pictures one after another, and can be paused and closed.

_PATIENCE = 0.02  # time between looks at the keyboard while nothing moves [s]


def show(pictures: Callable[[], Iterator[Image]], fps: float, title: str) -> bool:
    """Show pictures until the window is closed.

    Space pauses, R begins again, Escape closes; the last picture stays until then.

    Args:
        pictures: gives them from the beginning, at every call.
        fps: pictures per second, at most.
        title: of the window.

    Returns:
        False if no window could be opened.

    Raises:
        DependencyNotInstalled: pygame is not installed.
    """
    pygame = load_pygame()
    window = Window(title)
    try:
        _run(pygame, window, pictures, fps)
    except pygame.error:
        return False
    finally:
        window.close()
    return True


def _run(pygame: Any, window: Window, pictures: Callable[[], Iterator[Image]], fps: float) -> None:
    source, paused = pictures(), False
    while True:
        for event in pygame.event.get() if window.is_open else ():
            key = event.key if event.type == pygame.KEYDOWN else None
            if event.type == pygame.QUIT or key == pygame.K_ESCAPE:
                return
            if key == pygame.K_SPACE:
                paused = not paused
            if key == pygame.K_r:
                source, paused = pictures(), False
        picture = None if paused else next(source, None)
        if picture is None:
            pygame.time.wait(round(1000 * _PATIENCE))
            continue
        window.show(picture, fps)
