"""The figures of the gallery, and their page."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from rigid_envs.base.files import markdown_table, write_atomic
from rigid_envs.engine.provenance import provenance, versions
from rigid_envs.scores.leaderboard import file_of
from rigid_envs.systems import modules_of_all
from rigid_envs.tools.motions import motion_of
from rigid_envs.tools.pages.films import sources_hash
from rigid_envs.watch import figures
from rigid_envs.watch.pictures import tiled
from rigid_envs.watch.replays.page import write_html

# Figures of rigid-body rotation: simulation against closed form, each with the number it shows.
#
# A figure is an `Exhibit`: caption, law, source, and a function that draws it and computes its
# numbers. `rigid-envs gallery` writes them as PNG and SVG. matplotlib, of the extra `render`, is
# imported when a figure is drawn.

FIGURES: dict[str, figures.Exhibit] = {
    name: entry
    for module in modules_of_all("figures")
    for name, entry in vars(module).items()
    if isinstance(entry, figures.Exhibit)
}
"""All figures by name, in the order of the page."""


# Draw entries of the gallery, as PNG and SVG.

_PNG: dict[str, Any] = {"Software": None}  # neither version nor date: equal pictures, equal bytes
_SVG: dict[str, Any] = {"Date": None, "Creator": None}


class Made(NamedTuple):
    """A figure that was drawn.

    Attributes:
        entry: of the registry.
        png: picture.
        svg: the same as vector graphics; empty if it was not asked for.
        numbers: what the figure shows, the main one first.
    """

    entry: figures.Exhibit
    png: bytes
    svg: bytes
    numbers: tuple[figures.Match, ...]


def make(entry: figures.Exhibit, *, svg: bool = True) -> Made:
    """Draw a figure, with its title above and its numbers below.

    Args:
        entry: of the registry.
        svg: whether vector graphics are wanted, too.

    Raises:
        DependencyNotInstalled: matplotlib is missing.
    """
    figure, numbers = entry.compose()
    from matplotlib import rc_context

    with rc_context(cast(Any, figures.STYLE)):
        vector = file_of(figure, "svg", _SVG) if svg else b""
        return Made(entry, file_of(figure, "png", _PNG), vector, numbers)


# The page of the gallery, in Markdown, from the data of the figures.

SHEET = "contact_sheet.png"
_NUMBERS = ("number", "simulated", "theory", "difference", "bound")
_HEADING = (
    "<!-- Written by `rigid-envs gallery --docs docs/gallery`: change the figures.py of "
    "its system, not this page. -->"
)
_INTRODUCTION = (
    "What rotating and rolling bodies do, simulated with the systems of this library and set "
    "against closed forms that share no formula with them. Each figure shows the number that says "
    "how well the two agree.",
    "`pip install 'rigid-envs[render]'`, then `rigid-envs gallery --out DIR` makes all of them as "
    "PNG and SVG, and of what moves an interactive replay, NAME.html, to be opened in a browser; "
    "`rigid-envs gallery NAME ... --out DIR` makes some, `rigid-envs gallery --list` names them.",
    "Every figure is a function of its parameters, and gives a figure of matplotlib; those of the "
    "gallery are the defaults. Its code stands below it, without helpers.",
    """```python
from rigid_envs.systems.free_body.figures import flip

figure = flip(moments=(1.0, 1.5, 2.0), omega=(0.05, 2.0, 0.0), duration=30.0)
figure.savefig("flip.png")
```""",
)


def page(document: Mapping[str, Any], folder: str) -> str:
    """The page about figures.

    Args:
        document: content of `figures.json`.
        folder: of the pictures, as seen from the page.
    """
    shown = document["figures"]
    data = f"Versions, machine and commit are in [figures.json]({folder}/figures.json)."
    parts = [_HEADING, "# Gallery", *_INTRODUCTION, data]
    parts.append(f"![All figures of this page, small]({folder}/{SHEET})")
    parts.append("\n".join(f"- [{each['title']}](#{each['name']})" for each in shown))
    for figure in shown:
        parts += _section(figure, folder)
    return "\n\n".join(parts) + "\n"


def _section(figure: Mapping[str, Any], folder: str) -> list[str]:
    """Anchor of the figure's name, heading, picture, caption, law, numbers, command, code."""
    return [
        f'<a id="{figure["name"]}"></a>\n\n## {figure["title"]}',
        f"![{figure['title']}]({folder}/{figure['files']['png']})",
        figure["caption"],
        f"```text\n{figure['law']}\n```",
        markdown_table(_NUMBERS, map(_cells, figure["numbers"]), "<>>>>"),
        f"`{figure['command']}`. Source: {figure['source']}.",
        *_code(FIGURES[figure["name"]]),
    ]


def _code(entry: figures.Exhibit) -> list[str]:
    """A block that opens, with the function that draws a figure."""
    told = f"Code, in <code>{entry.draw.__module__}</code>"
    return [f"<details><summary>{told}</summary>", f"```python\n{entry.code}```", "</details>"]


def _cells(number: Mapping[str, Any]) -> tuple[str, ...]:
    unit = f" [{number['unit']}]" if number["unit"] else ""
    what = number["what"].replace("|", r"\|") + unit
    value, expected = (f"{number[key]:.7g}" for key in ("value", "expected"))
    cells = ("", "") if number["expected"] == 0.0 else (value, expected)  # 0: it is an error
    return (what, *cells, f"{number['error']:.1e}", f"{number['bound']:.0e}")


# Smaller pictures, and all on one sheet; Pillow comes with matplotlib.

_WIDTH, _GAP = 360, 14  # of the sheet [pixels]
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
    """All pictures, small, side by side.

    Args:
        pngs: pictures of one width.
    """
    from PIL import Image, ImageOps

    large = [Image.open(io.BytesIO(png)).convert("RGB") for png in pngs]
    size = _WIDTH, max(round(_WIDTH * each.height / each.width) for each in large)
    small = [ImageOps.pad(each, size, Image.Resampling.LANCZOS, "white") for each in large]
    framed = [np.asarray(ImageOps.expand(each, _GAP // 2, _BACKGROUND)) for each in small]
    buffer = io.BytesIO()
    Image.fromarray(tiled(framed)).save(buffer, format="PNG")
    return buffer.getvalue()


# Figures as files: PNG, SVG and `figures.json`; the page of the documentation.

DATA = "figures.json"
SOURCES = ("tools/gallery.py", "watch/figures.py", "systems/*/figures.py")
"""Files that draw the figures, below `rigid_envs`."""


def write_figures(
    folder: Path,
    entries: Sequence[figures.Exhibit],
    progress: Callable[[str], None] = lambda _: None,
) -> list[Made]:
    """Draw figures into a folder: NAME.png, NAME.svg, and what they show in `figures.json`.

    What moves is in NAME.html, too, to be looked at in a browser.

    Args:
        folder: exists; files of the same names are replaced.
        entries: figures of the registry.
        progress: called with the name of a figure before it is drawn.

    Raises:
        DependencyNotInstalled: matplotlib is missing.
    """
    where, drawn = _provenance(), []
    for entry in entries:
        progress(entry.name)
        made = make(entry)
        write_atomic(folder / f"{entry.name}.png", made.png)
        write_atomic(folder / f"{entry.name}.svg", made.svg)
        replay = motion_of(entry.name)
        if replay is not None:
            shown = [(replay, k) for k in range(len(replay.episodes))]
            write_html(folder / f"{entry.name}.html", shown, entry.title)
        drawn.append(made)
    _write_data(folder, where, drawn, ("png", "svg"))
    return drawn


def write_docs(folder: Path, progress: Callable[[str], None] = lambda _: None) -> list[Made]:
    """Draw all figures for the documentation, small, and write the page about them.

    Args:
        folder: of the pictures, exists; the page lies beside it, as FOLDER.md.
        progress: called with the name of a figure before it is drawn.

    Raises:
        DependencyNotInstalled: matplotlib is missing.
    """
    where, drawn = _provenance(), []
    for entry in FIGURES.values():
        progress(entry.name)
        made = make(entry, svg=False)
        write_atomic(folder / f"{entry.name}.png", palette_png(made.png))
        drawn.append(made)
    sheet = contact_sheet([made.png for made in drawn])
    write_atomic(folder / SHEET, palette_png(sheet))
    document = _write_data(folder, where, drawn, ("png",))
    write_atomic(folder.with_name(f"{folder.name}.md"), page(document, folder.name))
    return drawn


def _provenance() -> dict[str, Any]:
    """Taken before anything is written, which would count as a change of the checkout."""
    where = provenance()
    where["versions"] |= versions(("matplotlib",))
    return where


def _write_data(
    folder: Path, where: dict[str, Any], drawn: Sequence[Made], kinds: Sequence[str]
) -> dict[str, Any]:
    document = {
        "provenance": where,
        "sources": sources_hash(*SOURCES),
        "figures": [_entry(made, kinds) for made in drawn],
    }
    write_atomic(folder / DATA, json.dumps(document, indent=1, allow_nan=False) + "\n")
    return document


def _entry(made: Made, kinds: Sequence[str]) -> dict[str, Any]:
    entry = made.entry
    words = ("name", "title", "caption", "law", "source", "command")
    return {
        **{key: getattr(entry, key) for key in words},
        "files": {kind: f"{entry.name}.{kind}" for kind in kinds},
        "numbers": [number.as_json() for number in made.numbers],
    }
