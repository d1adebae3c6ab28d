"""Sections as Markdown, in the dialect of GitHub."""

from collections.abc import Sequence

from rigid_envs.pages.document import Code, Section
from rigid_envs.pages.task_tables import Table

__all__ = ["markdown", "table_lines"]

_RULES = {"<": "---", ">": "---:", "=": "---"}


def markdown(sections: Sequence[Section], level: int = 2) -> str:
    """Headings from the given level on; every paragraph is one line."""
    parts = []
    for section in sections:
        parts += [f"{'#' * level} {section.title}", *map(_block, section.body)]
        parts += [markdown(section.parts, level + 1)] if section.parts else []
    return "\n\n".join(parts)


def table_lines(table: Table) -> list[str]:
    """Header, rule and rows of a table."""
    rows = [
        [_cell(text, kind) for text, kind in zip(row, table.kinds, strict=True)]
        for row in table.rows
    ]
    rules = [_RULES[kind] for kind in table.kinds]
    return [f"| {' | '.join(cells)} |" for cells in (table.header, rules, *rows)]


def _block(block: str | Table | Code) -> str:
    if isinstance(block, Table):
        return "\n".join(table_lines(block))
    return f"```python\n{block.text}\n```" if isinstance(block, Code) else block


def _cell(text: str, kind: str) -> str:
    """A cell with bars escaped: a bar would end the cell, also between backticks."""
    escaped = text.replace("|", r"\|")
    return f"`{escaped}`" if kind == "=" and text else escaped
