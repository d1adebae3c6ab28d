"""Text in pictures."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Image
from rigid_envs.envs.display import needed

_Mask = npt.NDArray[np.float32]

_INK = np.array([38.0, 44.0, 54.0], dtype=np.float32)
_LEAST = 6  # pixels; smaller letters cannot be read


def write(picture: Image, text: Sequence[str]) -> None:
    """Write lines into the upper left corner; a long line makes all letters smaller.

    Args:
        picture: RGB, shape (height, width, 3); changed.
        text: the lines.

    Raises:
        DependencyNotInstalled: Pillow is not installed.
    """
    if not text:
        return
    height, width, _ = picture.shape
    size = max(_LEAST, height // 32)
    length = max(_length(line, size) for line in text) + size
    if length > width:
        size = max(_LEAST, int(size * width / length))
    for k, line in enumerate(text):
        top, left = size // 2 + k * (size + size // 3), size // 2
        part = picture[top : top + _height(size), left:]
        mask = _mask(line, size)[: part.shape[0], : part.shape[1]]
        part = part[:, : mask.shape[1]]
        part[...] = part + mask * (_INK - part) + 0.5


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
        letter, advance = _letter(character, size)
        part = mask[:, round(at) : round(at) + letter.shape[1]]
        np.maximum(part, letter[:, : part.shape[1]], out=part)
        at += advance
    return mask


@functools.lru_cache(maxsize=1024)
def _letter(letter: str, size: int) -> tuple[_Mask, float]:
    """Coverage of each pixel by a letter, shape (height, width, 1), and what it takes of a line."""
    pictures, _, pens = pillow()
    advance = font(size).getlength(letter)
    picture = pictures.new("L", (int(advance) + 2, _height(size)))
    pens.Draw(picture).text((0, 0), letter, fill=255, font=font(size))
    return np.asarray(picture, dtype=np.float32)[..., None] / 255.0, advance
