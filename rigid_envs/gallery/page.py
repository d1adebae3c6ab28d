"""The page of the gallery, in Markdown, from the data of the figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["SHEET", "page"]

SHEET = "contact_sheet.png"
_HEADING = (
    "<!-- Written by `rigid-envs gallery --docs docs/gallery`: change rigid_envs/gallery, "
    "not this page. -->"
)
_INTRODUCTION = (
    "What rotating and rolling bodies do, simulated with the systems of this library and set "
    "against closed forms that share no formula with them. Each figure shows the number that says "
    "how well the two agree.",
    "`pip install 'rigid-envs[render]'`, then `rigid-envs gallery --out DIR` makes all of them as "
    "PNG and SVG, and of what moves an interactive replay, NAME.html, to be opened in a browser; "
    "`rigid-envs gallery NAME ... --out DIR` makes some, `rigid-envs gallery --list` names them.",
)


def page(document: Mapping[str, Any], folder: str) -> str:
    """The page about figures.

    Args:
        document: content of `figures.json`.
        folder: of the pictures, as seen from the page.
    """
    figures = document["figures"]
    data = f"Versions, machine and commit are in [figures.json]({folder}/figures.json)."
    parts = [_HEADING, "# Gallery", *_INTRODUCTION, data]
    parts.append(f"![All figures of this page, small]({folder}/{SHEET})")
    parts += ["\n".join(_contents(figure) for figure in figures)]
    for figure in figures:
        parts += _section(figure, folder)
    return "\n\n".join(parts) + "\n"


def _contents(figure: Mapping[str, Any]) -> str:
    return f"- [{figure['title']}](#{figure['name']})"


def _section(figure: Mapping[str, Any], folder: str) -> list[str]:
    """Heading with an anchor of the figure's name, picture, caption, law, numbers, command."""
    return [
        f'<a id="{figure["name"]}"></a>\n\n## {figure["title"]}',
        f"![{figure['title']}]({folder}/{figure['files']['png']})",
        figure["caption"],
        f"```text\n{figure['law']}\n```",
        "\n".join(_numbers(figure["numbers"])),
        f"`{figure['command']}`. Source: {figure['source']}.",
    ]


def _numbers(numbers: list[dict[str, Any]]) -> list[str]:
    rows = ["| number | simulated | theory | difference | bound |"]
    rows.append("| --- | ---: | ---: | ---: | ---: |")
    for number in numbers:
        unit = f" [{number['unit']}]" if number["unit"] else ""
        what = number["what"].replace("|", r"\|") + unit
        error = number["expected"] == 0.0
        cells = ("", "") if error else (_plain(number["value"]), _plain(number["expected"]))
        difference, bound = f"{number['error']:.1e}", f"{number['bound']:.0e}"
        rows.append(f"| {' | '.join([what, *cells, difference, bound])} |")
    return rows


def _plain(value: float) -> str:
    return f"{value:.7g}"
