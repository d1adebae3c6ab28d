"""Window that shows pictures one after another, and can be paused and closed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.render.window import Window, library

__all__ = ["show"]

Image = npt.NDArray[np.uint8]

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
    pygame = library()
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
