"""`rigid-envs gallery`: draw the figures."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rigid_envs.cli.progress import tell
from rigid_envs.cli.words import refuse
from rigid_envs.pages.tables import table

__all__ = ["add_gallery"]


def add_gallery(verbs: Any) -> None:
    """Add the verb to the command.

    Args:
        verbs: of `argparse`, from `add_subparsers`.
    """
    drawing = verbs.add_parser(
        "gallery",
        help="figures of rotation and rolling, simulation against closed form",
        description="Draw figures as PNG and SVG, and write captions, numbers and provenance to "
        "figures.json. The exit status is 1 if a number is beyond its bound.",
        allow_abbrev=False,
    )
    drawing.add_argument("names", nargs="*", metavar="NAME", help="these figures only")
    drawing.add_argument("--out", type=Path, metavar="DIR", help="folder of the files")
    drawing.add_argument("--list", action="store_true", help="name the figures, draw nothing")
    drawing.add_argument(
        "--docs",
        type=Path,
        metavar="DIR",
        help="draw all figures, small, into DIR instead, and write the page DIR.md about them; in "
        "the repository it is docs/gallery",
    )
    drawing.set_defaults(act=_gallery)


def _gallery(options: argparse.Namespace, rest: list[str]) -> int:
    refuse(rest)
    from rigid_envs.gallery import FIGURES, checked_name  # imports the systems: only here

    names = list(dict.fromkeys(map(checked_name, options.names or FIGURES)))
    if options.list:
        rows = [(FIGURES[name].name, FIGURES[name].title) for name in names]
        print(table(("name", "figure"), rows, "<<"))
        return 0
    return _draw(names, options)


def _draw(names: Sequence[str], options: argparse.Namespace) -> int:
    from rigid_envs.gallery import FIGURES
    from rigid_envs.gallery.writing import write_docs, write_figures

    if (options.out is None) == (options.docs is None):
        raise ValueError(f"--out = {options.out}; expected either --out DIR or --docs DIR")
    if options.docs and options.names:
        raise ValueError(f"names = {names}; expected none beside --docs: the page shows all")
    folder: Path = options.out or options.docs
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"folder = {folder}; expected a folder: this is a file")
    folder.mkdir(parents=True, exist_ok=True)
    if options.docs:
        drawn = write_docs(folder, tell)
    else:
        drawn = write_figures(folder, [FIGURES[name] for name in names], tell)
    tell("")
    rows = [(made.entry.name, str(made.numbers[0])) for made in drawn]
    print(table(("name", "number"), rows, "<<"))
    print(f"\nwritten to {folder}")
    broken = [made.entry.name for made in drawn if not all(n.holds for n in made.numbers)]
    if broken:
        print(f"beyond their bounds: {', '.join(broken)}")
    return 1 if broken else 0
