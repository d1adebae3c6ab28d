"""What a player sees: the picture, and below it results, the action and the keys."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.films.animation import library

__all__ = ["Status", "board_height", "page"]

Image = npt.NDArray[np.uint8]

_PAPER, _INK, _MUTED = (255, 255, 255), (38, 44, 54), (110, 118, 130)
_RULE, _BAR, _GOOD, _BAD = (208, 213, 221), (0, 114, 178), (0, 130, 95), (190, 80, 0)


@dataclass(frozen=True)
class Status:
    """What is written.

    Attributes:
        title: environment, seed, speed.
        own: own result so far.
        others: results of others from the same start.
        verdict: how the episode ended; empty while it runs.
        success: whether that was a success.
        gauges: name and value of every entry of the action.
        note: what can be done now.
        help: lines of text over the picture; none to see the picture.
    """

    title: str
    own: str
    others: str
    verdict: str
    success: bool
    gauges: tuple[tuple[str, float], ...]
    note: str
    help: tuple[str, ...] = ()


def board_height(width: int) -> int:
    """Height of the part below a picture, in pixels."""
    return round(7.6 * _size(width))


def page(picture: Image, status: Status) -> Image:
    """The picture with the board below it, and help over it.

    Args:
        picture: RGB, shape (height, width, 3).
        status: what is written.
    """
    if status.help:
        picture = _covered(picture, status.help)
    return np.concatenate([picture, _board(picture.shape[1], status)])


@functools.lru_cache(8)
def _board(width: int, status: Status) -> Image:
    image, draw, size = *_blank(width, board_height(width)), _size(width)
    left, right = size, width - size
    draw.line([(0, 0), (width, 0)], fill=_RULE)
    _text(draw, (left, 1.3 * size), status.title, size, _MUTED)
    _text(draw, (right, 1.3 * size), status.note, size, _MUTED, "rm")
    _text(draw, (left, 3.2 * size), f"you: {status.own}", round(1.3 * size), _INK)
    colour = _GOOD if status.success else _BAD
    _text(draw, (right, 3.2 * size), status.verdict, round(1.3 * size), colour, "rm")
    _text(draw, (left, 4.8 * size), status.others, size, _INK)
    _gauges(draw, status.gauges, (left, right), 6.2 * size, size)
    return np.array(image)


def _gauges(
    draw: Any,
    gauges: Sequence[tuple[str, float]],
    ends: tuple[int, int],
    middle: float,
    size: int,
) -> None:
    """Bars from the middle to the value of every entry."""
    step = (ends[1] - ends[0]) / max(len(gauges), 1)
    for k, (name, value) in enumerate(gauges):
        left = ends[0] + k * step
        _text(draw, (left, middle), name, size, _MUTED)
        begin, end = left + max(4.5 * size, 0.3 * step), left + step - 1.2 * size
        zero, low, high = 0.5 * (begin + end), middle - 0.22 * size, middle + 0.22 * size
        draw.rectangle([begin, low, end, high], fill=(236, 239, 243))
        tip = zero + 0.5 * (end - begin) * value
        draw.rectangle([min(zero, tip), low, max(zero, tip), high], fill=_BAR)
        draw.line([(zero, low - 2), (zero, high + 2)], fill=_MUTED)


def _covered(picture: Image, lines: Sequence[str]) -> Image:
    """The picture, paler, with lines of text in two columns that a tabulator parts."""
    height, width, _ = picture.shape
    size = _size(width)
    pale = (0.14 * picture + 0.86 * 255.0).astype(np.uint8)
    image = library().fromarray(pale)
    draw = _pen(image)
    top = 0.5 * (height - 1.7 * size * len(lines))
    for k, line in enumerate(lines):
        first, _, second = line.partition("\t")
        row = top + 1.7 * size * (k + 0.5)
        _text(draw, (1.5 * size, row), first, size, _INK)
        _text(draw, (0.34 * width, row), second, size, _INK)
    return np.array(image)


def _size(width: int) -> int:
    """Height of a letter."""
    return max(10, width // 38)


def _blank(width: int, height: int) -> tuple[Any, Any]:
    image = library().new("RGB", (width, height), _PAPER)
    return image, _pen(image)


def _pen(image: Any) -> Any:
    from PIL import ImageDraw

    return ImageDraw.Draw(image)


def _text(
    draw: Any, place: tuple[float, float], text: str, size: int, fill: Any, anchor: str = "lm"
) -> None:
    draw.text(place, text, fill=fill, font=_font(size), anchor=anchor)


@functools.cache
def _font(size: int) -> Any:
    from PIL import ImageFont

    return ImageFont.load_default(size)
