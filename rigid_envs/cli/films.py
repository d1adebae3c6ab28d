"""`rigid-envs films`: a short film of every environment, for its page."""

import argparse
from pathlib import Path
from typing import Any

from rigid_envs import ENVIRONMENTS
from rigid_envs.catalogue import checked_id
from rigid_envs.cli.progress import tell
from rigid_envs.cli.words import refuse

__all__ = ["add_films"]


def add_films(verbs: Any) -> None:
    """Add the verb to the command.

    Args:
        verbs: of `argparse`, from `add_subparsers`.
    """
    filming = verbs.add_parser(
        "films",
        help="a short film of every environment, as animated WebP",
        description="Film the reference controller of each environment for its page. In the "
        "repository the films are in docs/environments/films.",
        allow_abbrev=False,
    )
    filming.add_argument("folder", metavar="FOLDER", type=Path)
    filming.add_argument("--ids", nargs="+", metavar="ID", help="these environments only")
    filming.add_argument(
        "--check", action="store_true", help="say which films are missing or old; write nothing"
    )
    filming.set_defaults(act=_films)


def _films(options: argparse.Namespace, rest: list[str]) -> int:
    refuse(rest)
    from rigid_envs.pages.films import stale_films, write_films  # draws: only here

    own = (env_id for env_id in ENVIRONMENTS if env_id.startswith("RigidEnvs/"))
    ids = [checked_id(name) for name in options.ids or own]
    if options.check:
        stale = stale_films(options.folder, ids)
        for env_id, why in stale.items():
            print(f"{env_id}: {why}")
        return 1 if stale else 0
    write_films(options.folder, ids, tell)
    tell("")
    return 0
