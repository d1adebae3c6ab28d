"""Window that shows pictures."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.render.needed import needed

__all__ = ["Window", "has_display", "library"]

Image = npt.NDArray[np.uint8]


def library() -> Any:
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
        self._pygame = library()
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
