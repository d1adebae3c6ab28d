"""`rigid-envs frames`: how long a picture takes."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rigid_envs import ENVIRONMENTS
from rigid_envs.catalogue import checked_id
from rigid_envs.cli.progress import tell
from rigid_envs.cli.words import refuse
from rigid_envs.files import write_atomic
from rigid_envs.pages.pictures import as_text, with_table
from rigid_envs.provenance import provenance

__all__ = ["add_frames"]


def add_frames(verbs: Any) -> None:
    """Add the verb to the command.

    Args:
        verbs: of `argparse`, from `add_subparsers`.
    """
    timing = verbs.add_parser(
        "frames",
        help="time of a picture of every environment",
        description="Measure pictures of 480 x 480 pixels on one thread, with and without shadows, "
        "and the first one of a new process. Takes a minute on an idle machine.",
        allow_abbrev=False,
    )
    timing.add_argument("--ids", nargs="+", metavar="ID", help="these environments only")
    timing.add_argument(
        "--page",
        type=Path,
        metavar="FILE.md",
        help="write the table into this page, and the data beside it as FILE.json; in the "
        "repository it is docs/rendering.md",
    )
    timing.set_defaults(act=_frames)


def _frames(options: argparse.Namespace, rest: list[str]) -> None:
    refuse(rest)
    from rigid_envs.bench.frames import frame_times, installed_size  # draws: only here

    ids = [checked_id(name) for name in options.ids or ENVIRONMENTS]
    page = "" if options.page is None else options.page.read_text(encoding="utf-8")
    data = {
        "provenance": provenance(),
        "frames": [asdict(times) for times in frame_times(ids, report=tell)],
        "bytes": installed_size(),
    }
    tell("")
    if options.page is None:
        print(as_text(data))
        return
    text = with_table(page, data)
    write_atomic(options.page.with_suffix(".json"), json.dumps(data, indent=1) + "\n")
    write_atomic(options.page, text)
