"""Window that shows pictures one after another, and can be paused and closed."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import DependencyNotInstalled

__all__ = ["has_display", "library", "show"]

Image = npt.NDArray[np.uint8]

_PATIENCE = 0.02  # time between looks at the keyboard while nothing moves [s]


def library() -> Any:
    """The module `pygame`.

    Raises:
        DependencyNotInstalled: it is not installed.
    """
    try:
        import pygame
    except ImportError as error:
        raise DependencyNotInstalled(
            'a window needs pygame: pip install "rigid-envs[render]"'
        ) from error
    return pygame


def has_display() -> bool:
    """Whether a window can be opened here, as far as the environment of the process says."""
    if os.environ.get("SDL_VIDEODRIVER"):
        return True
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


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
    pygame = library()
    try:
        pygame.display.init()
        pygame.display.set_caption(title)
        _run(pygame, pictures, fps)
    except pygame.error:
        return False
    finally:
        pygame.display.quit()
    return True


def _run(pygame: Any, pictures: Callable[[], Iterator[Image]], fps: float) -> None:
    screen: Any = None
    clock, paused = pygame.time.Clock(), False
    source = pictures()
    while True:
        for event in pygame.event.get() if screen else ():
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
        height, width, _ = picture.shape
        if screen is None:
            screen = pygame.display.set_mode((width, height))
        image = pygame.image.frombuffer(np.ascontiguousarray(picture), (width, height), "RGB")
        screen.blit(image, (0, 0))
        pygame.display.flip()
        clock.tick(fps)
