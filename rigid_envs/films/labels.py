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
    width = pictures[0].shape[1]
    if any(labels):
        pictures = [
            np.concatenate([_strip(label, width), picture])
            for label, picture in zip(labels, pictures, strict=True)
        ]
    page = tiled(pictures)
    page[:, width::width] = _RULE  # between neighbours
    return page


@functools.lru_cache(64)
def _strip(label: str, width: int) -> Image:
    """Line of text as wide as a picture; what is too long is cut."""
    pictures, fonts, pens = pillow()
    size = max(11, width // 26)
    font = fonts.load_default(size)
    image = pictures.new("RGB", (width, 2 * size), _PAPER)
    draw = pens.Draw(image)
    text = label
    while draw.textlength(text, font=font) > width - size and len(text) > len(_CUT):
        text = text.removesuffix(_CUT)[:-1] + _CUT
    draw.text((size // 2, size), text, fill=_INK, font=font, anchor="lm")
    strip = np.array(image)
    strip[-1] = _RULE
    return strip
