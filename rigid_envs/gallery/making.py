"""Draw entries of the gallery, as PNG and SVG."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.style import MUTED, STYLE, lay_out, new_figure, require_matplotlib

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Made", "compose", "make"]

_PNG: dict[str, Any] = {"Software": None}  # neither version nor date: equal pictures, equal bytes
_SVG: dict[str, Any] = {"Date": None, "Creator": None}


@dataclass(frozen=True)
class Made:
    """A figure that was drawn.

    Attributes:
        entry: of the registry.
        png: picture.
        svg: the same as vector graphics; empty if it was not asked for.
        numbers: what the figure shows, the main one first.
    """

    entry: Entry
    png: bytes
    svg: bytes
    numbers: tuple[Number, ...]


def make(entry: Entry, *, svg: bool = True) -> Made:
    """Draw a figure, with its title above and its numbers below.

    Args:
        entry: of the registry.
        svg: whether vector graphics are wanted, too.

    Raises:
        DependencyNotInstalled: matplotlib is missing.
    """
    require_matplotlib()
    from matplotlib import rc_context

    with rc_context(cast(Any, STYLE)):
        figure, numbers = compose(entry)
        vector = _save(figure, "svg", _SVG) if svg else b""
        return Made(entry, _save(figure, "png", _PNG), vector, numbers)


def compose(entry: Entry) -> tuple[Figure, tuple[Number, ...]]:
    """A figure with all that belongs to it, not yet a picture, and its numbers.

    Args:
        entry: of the registry.
    """
    figure = new_figure(entry.size)
    numbers = entry.draw(figure)
    _title_and_numbers(figure, entry, numbers)
    return figure, numbers


def _title_and_numbers(figure: Figure, entry: Entry, numbers: tuple[Number, ...]) -> None:
    """Title on top; at the bottom the legend of the figure, if it has one, and the numbers."""
    height = entry.size[1]
    figure.text(
        0.014, 1.0 - 0.1 / height, entry.title,
        va="top", fontsize=12.5, fontweight="bold", in_layout=False,
    )  # fmt: skip
    figure.text(
        0.014, 0.09 / height, "\n".join(map(str, numbers)),
        va="bottom", fontsize=8.5, color=MUTED, linespacing=1.35, in_layout=False,
    )  # fmt: skip
    below = 0.14 + 0.165 * len(numbers)
    for legend in figure.legends:
        legend.set_in_layout(False)
        legend.set_loc("lower center")
        legend.set_bbox_to_anchor((0.5, below / height))
        below += 0.07 + 0.2 * math.ceil(len(legend.get_texts()) / legend._ncols)  # type: ignore[attr-defined]
    lay_out(figure, below, 0.38)


def _save(figure: Figure, kind: str, metadata: dict[str, Any]) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, metadata=metadata)
    return buffer.getvalue()
