"""Smaller pictures, and all on one sheet; Pillow comes with matplotlib."""

from __future__ import annotations

import io
from collections.abc import Sequence

__all__ = ["contact_sheet", "palette_png"]

_COLUMNS, _WIDTH, _GAP = 4, 360, 14  # of the sheet [pixels]
_BACKGROUND = "#e3e7ec"


def palette_png(png: bytes, colors: int = 256) -> bytes:
    """The same picture with few colours, which takes less than half the bytes.

    Args:
        png: a picture.
        colors: number of colours, at most 256.
    """
    from PIL import Image

    buffer = io.BytesIO()
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    small = picture.quantize(colors, kmeans=2, dither=Image.Dither.NONE)
    small.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


def contact_sheet(pngs: Sequence[bytes]) -> bytes:
    """All pictures, small, in rows.

    Args:
        pngs: pictures of one width.
    """
    from PIL import Image

    small = []
    for png in pngs:
        picture = Image.open(io.BytesIO(png)).convert("RGB")
        size = (_WIDTH, round(_WIDTH * picture.height / picture.width))
        small.append(picture.resize(size, Image.Resampling.LANCZOS))
    rows = [small[k : k + _COLUMNS] for k in range(0, len(small), _COLUMNS)]
    heights = [max(picture.height for picture in row) for row in rows]
    width = _COLUMNS * (_WIDTH + _GAP) + _GAP
    sheet = Image.new("RGB", (width, sum(heights) + _GAP * (len(rows) + 1)), _BACKGROUND)
    top = _GAP
    for row, height in zip(rows, heights, strict=True):
        for k, picture in enumerate(row):
            cell = Image.new("RGB", (_WIDTH, height), "white")
            cell.paste(picture, (0, 0))
            sheet.paste(cell, (_GAP + k * (_WIDTH + _GAP), top))
        top += height + _GAP
    buffer = io.BytesIO()
    sheet.save(buffer, format="PNG")
    return buffer.getvalue()
