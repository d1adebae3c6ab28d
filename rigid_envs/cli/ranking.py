"""`rigid-envs leaderboard`: its arguments."""

import argparse
from pathlib import Path
from typing import Any

from rigid_envs.cli.words import refuse

__all__ = ["add_leaderboard"]


def add_leaderboard(verbs: Any) -> None:
    """Add the verb to the parser of the command."""
    ranking = verbs.add_parser(
        "leaderboard",
        help="one table and plot of evaluations",
        description="Collect all results below a folder, of `rigid-envs evaluate --out` and of "
        "rigid_envs.evaluate, into leaderboard.md and leaderboard.png there.",
        allow_abbrev=False,
    )
    ranking.add_argument("folder", type=Path, metavar="FOLDER")
    ranking.add_argument(
        "--packaged",
        action="store_true",
        help="also of what comes with the package: published policies and controllers",
    )
    ranking.set_defaults(act=_leaderboard)


def _leaderboard(options: argparse.Namespace, rest: list[str]) -> None:
    refuse(rest)
    from rigid_envs.leaderboard import write_leaderboard

    text = write_leaderboard(options.folder, options.packaged)
    print(f"{text}\nwritten to {options.folder}: leaderboard.md, leaderboard.png")
