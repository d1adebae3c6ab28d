"""Tables and paragraphs of plain text, of limited width."""

import shutil
import sys
import textwrap
from collections.abc import Sequence

__all__ = ["WIDTH", "line_width", "paragraphs", "table"]

WIDTH = 100
_GAP = 2
_NARROWEST = 8


def line_width() -> int:
    """Largest length of a line: `WIDTH`, or that of the terminal if it is narrower."""
    if not sys.stdout.isatty():
        return WIDTH
    return min(WIDTH, max(shutil.get_terminal_size().columns, 40))


def table(
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    align: str = "",
    indent: int = 2,
    width: int | None = None,
) -> str:
    """Aligned columns under a ruled header; cells that are too long are wrapped between words.

    Args:
        header: Titles of the columns.
        rows: Cells, one sequence per row.
        align: "<" or ">" for each column; "<" where it is too short.
        indent: Blanks before every line.
        width: Largest length of a line; None for `line_width`.
    """
    width = line_width() if width is None else width
    cells = [list(header), *map(list, rows)]
    sizes = [max(len(row[k]) for row in cells) for k in range(len(header))]
    words = [
        max(len(word) for row in cells for word in row[k].split() or [""])
        for k in range(len(header))
    ]
    room = width - indent - _GAP * (len(header) - 1)
    while sum(sizes) > room and max(sizes) > _NARROWEST:
        # the widest column that can be wrapped between words, if there is one
        k = max(range(len(header)), key=lambda k: (sizes[k] > words[k], sizes[k]))
        sizes[k] -= 1
    sides = align.ljust(len(header), "<")
    lines = [line for row in cells for line in _lines(row, sizes, sides)]
    n_header = len(_lines(cells[0], sizes, sides))
    lines.insert(n_header, (" " * _GAP).join("-" * size for size in sizes))
    return "\n".join((" " * indent + line).rstrip() for line in lines)


def paragraphs(text: str, indent: int = 2) -> str:
    """Text with its paragraphs filled to `line_width`; an item of a list hangs from its dash."""
    margin = " " * indent
    return "\n\n".join(
        textwrap.fill(
            " ".join(part.split()),
            line_width(),
            initial_indent=margin,
            subsequent_indent=margin + "  " * part.startswith("- "),
        )
        for part in text.split("\n\n")
    )


def _lines(row: Sequence[str], sizes: Sequence[int], sides: str) -> list[str]:
    """The lines of one row of cells."""
    wrapped = [
        textwrap.wrap(cell, size, break_on_hyphens=False) or [""]
        for cell, size in zip(row, sizes, strict=True)
    ]
    height = max(map(len, wrapped))
    return [
        (" " * _GAP).join(
            f"{part[k] if k < len(part) else '':{side}{size}}"
            for part, size, side in zip(wrapped, sizes, sides, strict=True)
        )
        for k in range(height)
    ]
