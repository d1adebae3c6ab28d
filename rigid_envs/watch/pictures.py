"""Pictures: text in them, side by side, and in a window."""

import functools
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Image
from rigid_envs.envs.display import needed

# Text in pictures.

_Mask = npt.NDArray[np.float32]

_INK = np.array([38.0, 44.0, 54.0], dtype=np.float32)
_LEAST = 6  # pixels; smaller letters cannot be read
_FINE = 4  # parts of a pixel at which letters are placed


def write(picture: Image, text: Sequence[str], size: int | None = None) -> None:
    """Write lines into the upper left corner; a long line makes all letters smaller.

    Args:
        picture: RGB, shape (height, width, 3); changed.
        text: the lines.
        size: height of a letter in pixels; a share of the picture's, if left out.

    Raises:
        DependencyNotInstalled: Pillow is not installed.
    """
    if not text:
        return
    height, width, _ = picture.shape
    size = size or max(_LEAST, height // 32)
    length = max(_length(line, size) for line in text) + size
    if length > width:
        size = max(_LEAST, int(size * width / length))
    for k, line in enumerate(text):
        top, left = size // 2 + k * (size + size // 3), size // 2
        part = picture[top : top + _height(size), left:]
        mask = _mask(line, size)[: part.shape[0], : part.shape[1]]
        part = part[:, : mask.shape[1]]
        part[...] = part + mask * (_INK - part) + 0.5


@functools.lru_cache(maxsize=64)
def wrapped(text: str, width: int, size: int) -> tuple[str, ...]:
    """The fewest lines of whole words that `write` can write in this size, about equally long.

    Args:
        text: words; a number stays with the word before it.
        width: of the picture, in pixels; a word that is too long for it is a line of its own.
        size: height of a letter in pixels.
    """
    fewest = len(_filled(text, width, size))
    narrower = (_filled(text, w, size) for w in range(width + 1))
    return next(tuple(lines) for lines in narrower if len(lines) == fewest)


def _filled(text: str, width: int, size: int) -> list[str]:
    """Lines, each with as many words as it can take."""
    first, *others = re.split(r" (?!\d)", text)
    lines = [first]
    for word in others:
        if _length(f"{lines[-1]} {word}", size) + size <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines


def lines_height(n: int, size: int) -> int:
    """Height of a picture that has room for lines as `write` writes them, in pixels."""
    return 2 * size + (n - 1) * (size + size // 3)


@functools.cache
def pillow() -> tuple[Any, Any, Any]:
    """Pillow's modules `Image`, `ImageFont` and `ImageDraw`, with their FreeType loaded.

    Raises:
        DependencyNotInstalled: Pillow is not installed.
    """
    names = ("PIL.Image", "PIL.ImageFont", "PIL.ImageDraw")
    pictures, fonts, pens = (needed(name, "pictures need Pillow") for name in names)
    fonts.load_default(10)
    return pictures, fonts, pens


@functools.cache
def font(size: int) -> Any:
    """Font of letters of this height in pixels."""
    _, fonts, _ = pillow()
    return fonts.load_default(size)


def _height(size: int) -> int:
    return size + size // 2


def _length(line: str, size: int) -> float:
    return sum(_letter(letter, size)[1] for letter in line)


@functools.lru_cache(maxsize=64)
def _mask(line: str, size: int) -> _Mask:
    """Coverage of each pixel by the letters of a line, shape (height, width, 1)."""
    mask = np.zeros((_height(size), int(_length(line, size)) + size, 1), dtype=np.float32)
    at = 0.0
    for character in line:
        left = int(at)
        letter, advance = _letter(character, size, int(_FINE * (at - left)))
        part = mask[:, left : left + letter.shape[1]]
        np.maximum(part, letter[:, : part.shape[1]], out=part)
        at += advance
    return mask


@functools.lru_cache(maxsize=4096)
def _letter(letter: str, size: int, shift: int = 0) -> tuple[_Mask, float]:
    """Coverage of each pixel by a letter, shape (height, width, 1), and what it takes of a line.

    Drawn finer and averaged: FreeType fits small letters to pixels, and their gaps are uneven then.

    Args:
        letter: the letter.
        size: its height in pixels.
        shift: how far it is moved to the right, in parts of a pixel.
    """
    pictures, _, pens = pillow()
    fine = font(_FINE * size)
    advance = fine.getlength(letter) / _FINE
    picture = pictures.new("L", (_FINE * (int(advance) + 3), _FINE * _height(size)))
    pens.Draw(picture).text((shift, 0), letter, fill=255, font=fine)
    return np.asarray(picture.reduce(_FINE), dtype=np.float32)[..., None] / 255.0, advance


# Pictures side by side, and in a window.

_IN_A_LINE = 3


def tiled(pictures: Sequence[Image]) -> Image:
    """Pictures of one size: up to three side by side, more in lines, as many as columns or less."""
    n = len(pictures)
    columns = n if n <= _IN_A_LINE else int(np.ceil(np.sqrt(n)))
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
    names = ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform in ("darwin", "win32") or any(map(os.environ.get, names))


def check_display() -> None:
    """Refuse a window where nobody would see it.

    Raises:
        ValueError: no display.
    """
    if not has_display():
        raise ValueError(
            'DISPLAY = None; expected a display for the window: without one, "rgb_array" renders '
            "pictures, `python -m agents enjoy` and `rigid-envs replay --video` write films"
        )


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
        for event in pygame.event.get() if pygame.display.get_init() else ():
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
