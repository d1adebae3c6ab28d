"""Pictures side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

__all__ = ["tiled"]

Image = npt.NDArray[np.uint8]


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
