"""Text that may come from a file, such that Markdown and matplotlib show it letter by letter."""

from __future__ import annotations

import re

__all__ = ["in_markdown", "in_plot"]


def in_markdown(text: str) -> str:
    """A text as a cell of a table: no markup, no link, no HTML, and no end of the cell.

    Args:
        text: One line.
    """
    return re.sub(r"[\\`*\[\]<>|&~$:]", r"\\\g<0>", text)


def in_plot(text: str) -> str:
    """A text as a label: no formula, which could have errors.

    Args:
        text: One line.
    """
    return text.replace("$", r"\$")
