"""Pictures of several episodes side by side, each under its label."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from rigid_envs.render.lettering import pillow
from rigid_envs.render.picture import tiled

__all__ = ["labelled"]

Image = npt.NDArray[np.uint8]

_CUT = "..."
_INK, _PAPER, _RULE = (38, 44, 54), (255, 255, 255), (208, 213, 221)


def labelled(pictures: Sequence[Image], labels: Sequence[str]) -> Image:
    """Pictures of one size side by side, each under a line of text where there is any.

    Args:
        pictures: at least one.
        labels: one each; if all are empty there is no line.
    """
    if any(labels):
        width = pictures[0].shape[1]
        pictures = [
            np.concatenate([_strip(label, width), picture])
            for label, picture in zip(labels, pictures, strict=True)
        ]
    page = tiled(pictures)
    if len(pictures) > 1:
        width = pictures[0].shape[1]
        page[:, width::width] = _RULE  # between neighbours
    return page


@functools.lru_cache(64)
def _strip(label: str, width: int) -> Image:
    """Line of text as wide as a picture; what is too long is cut."""
    pictures, fonts, pens = pillow()
    size = max(11, width // 26)
    font = fonts.load_default(size)
    strip = pictures.new("RGB", (width, 2 * size), _PAPER)
    draw = pens.Draw(strip)
    text = label
    while draw.textlength(text, font=font) > width - size and len(text) > len(_CUT):
        text = text.removesuffix(_CUT)[:-1] + _CUT
    draw.text((size // 2, size), text, fill=_INK, font=font, anchor="lm")
    draw.line([(0, 2 * size - 1), (width, 2 * size - 1)], fill=_RULE)
    return np.array(strip)
