"""Figures as files: PNG, SVG and `figures.json`; the page of the documentation."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rigid_envs.files import write_atomic
from rigid_envs.gallery import FIGURES
from rigid_envs.gallery.entry import Entry
from rigid_envs.gallery.making import Made, make
from rigid_envs.gallery.motions import motion_of
from rigid_envs.gallery.page import SHEET, page
from rigid_envs.gallery.pictures import contact_sheet, palette_png
from rigid_envs.provenance import provenance, versions
from rigid_envs.replays.page import write_html

__all__ = ["DATA", "hash_of_sources", "write_docs", "write_figures"]

DATA = "figures.json"

Progress = Callable[[str], None]


def write_figures(
    folder: Path, entries: Sequence[Entry], progress: Progress = lambda _: None
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
            write_html(folder / f"{entry.name}.html", shown)
        drawn.append(made)
    _write_data(folder, where, drawn, ("png", "svg"))
    return drawn


def write_docs(folder: Path, progress: Progress = lambda _: None) -> list[Made]:
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


def hash_of_sources() -> str:
    """SHA-256 of the Python files of the gallery: whether pictures are older than what draws them.

    Returns:
        Hexadecimal digits.
    """
    root, digest = Path(__file__).parent, hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(root).as_posix()} {len(content)}\n".encode() + content)
    return digest.hexdigest()


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
        "sources": hash_of_sources(),
        "figures": [_entry(made, kinds) for made in drawn],
    }
    write_atomic(folder / DATA, json.dumps(document, indent=1, allow_nan=False) + "\n")
    return document


def _entry(made: Made, kinds: Sequence[str]) -> dict[str, Any]:
    entry = made.entry
    return {
        "name": entry.name,
        "title": entry.title,
        "caption": entry.caption,
        "law": entry.law,
        "source": entry.source,
        "command": entry.command,
        "files": {kind: f"{entry.name}.{kind}" for kind in kinds},
        "numbers": [number.as_json() for number in made.numbers],
    }
