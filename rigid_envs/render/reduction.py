"""Reduction of a drawing to a picture: the mean of every square of four pixels."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rigid_envs.kernels.compiler import kernel

__all__ = ["halved"]

Image = npt.NDArray[np.uint8]


def halved(drawing: Image) -> Image:
    """Picture of half the width and height.

    Args:
        drawing: blue, green, red and a fourth number, lowest line first, (height, width, 4), with
            even height and width.

    Returns:
        RGB, first line on top, shape (height / 2, width / 2, 3).
    """
    height, width, _ = drawing.shape
    picture = np.empty((height // 2, width // 2, 3), dtype=np.uint8)
    _loop()(drawing, picture)
    return picture


@functools.cache
def _loop() -> Callable[[Image, Image], None]:
    return kernel(_halve, "render.reduction", ())


def _halve(drawing: Image, picture: Image) -> None:
    height, width, _ = picture.shape
    for i in range(height):
        low, high = 2 * (height - 1 - i), 2 * (height - 1 - i) + 1
        for j in range(width):
            for k in range(3):
                total = np.uint16(2)  # so that the mean is rounded to the nearest
                for line in (low, high):
                    total += np.uint16(drawing[line, 2 * j, 2 - k])
                    total += np.uint16(drawing[line, 2 * j + 1, 2 - k])
                picture[i, j, k] = total >> 2
