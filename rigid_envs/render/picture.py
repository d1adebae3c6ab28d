"""Picture from a drawing: reduced to its size, with lines of text."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import DependencyNotInstalled

__all__ = ["finished", "pillow", "tiled"]

Image = npt.NDArray[np.uint8]

_INK = (38, 44, 54)
_LEAST = 6  # pixels; smaller letters cannot be read


def finished(drawing: Image, reduction: int, text: Sequence[str]) -> Image:
    """Picture of a drawing, in which every pixel is the mean of several ones.

    Args:
        drawing: blue, green, red and a fourth number, lowest line first, (height, width, 4).
        reduction: number of pixels along each side of which the mean is taken.
        text: lines for the upper left corner.

    Returns:
        RGB, first line on top, shape (height / reduction, width / reduction, 3).

    Raises:
        DependencyNotInstalled: Pillow is not installed.
    """
    pictures, fonts, draw = pillow()
    height, width, _ = drawing.shape
    raw = pictures.frombuffer("RGBX", (width, height), drawing.data, "raw", "BGRX", 0, -1)
    picture = raw.reduce(reduction).convert("RGB")
    if text:
        size = _fitting(fonts, text, picture.width, picture.height)
        page = draw.Draw(picture)
        for k, line in enumerate(text):
            place = (size // 2, size // 2 + k * (size + size // 3))
            page.text(place, line, fill=_INK, font=_font(fonts, size))
    return np.array(picture)


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


@functools.cache
def pillow() -> tuple[Any, Any, Any]:
    """Pillow's modules `Image`, `ImageFont` and `ImageDraw`, with their FreeType loaded.

    Raises:
        DependencyNotInstalled: Pillow is not installed.
    """
    try:
        from PIL import Image, ImageDraw, ImageFont
    except ImportError as error:
        raise DependencyNotInstalled(
            'pictures need Pillow: pip install "rigid-envs[render]"'
        ) from error
    ImageFont.load_default(10)
    return Image, ImageFont, ImageDraw


@functools.cache
def _font(fonts: Any, size: int) -> Any:
    return fonts.load_default(size)


def _fitting(fonts: Any, text: Sequence[str], width: int, height: int) -> int:
    """Size of letters: a line of 32 in the height, or what the longest line has room for."""
    size = max(_LEAST, height // 32)
    length = max(_font(fonts, size).getlength(line) for line in text) + size
    return size if length <= width else max(_LEAST, int(size * width / length))
