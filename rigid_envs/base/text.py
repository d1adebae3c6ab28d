"""Text for Markdown and for plots: tables, and what comes from a file shown letter by letter."""

import re
from collections.abc import Iterable, Sequence


def in_markdown(text: str) -> str:
    """A text as a cell of a table: no markup, no link, no HTML, and no end of the cell.

    Args:
        text: One line; it may come from a file.
    """
    return re.sub(r"[\\`*\[\]<>|&~$:]", r"\\\g<0>", text)


def in_plot(text: str) -> str:
    """A text as a label of matplotlib: no formula, which could have errors.

    Args:
        text: One line; it may come from a file.
    """
    return text.replace("$", r"\$")


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]], align: str) -> str:
    """A table in the dialect of GitHub.

    Args:
        header: Titles of the columns.
        rows: Cells, in Markdown, one sequence for each row.
        align: For each column "<" of words or ">" of numbers.
    """
    rules = [{"<": "---", ">": "---:"}[side] for side in align]
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, rules, *rows))
