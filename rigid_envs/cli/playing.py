"""`rigid-envs play`: its arguments."""

import argparse
from pathlib import Path
from typing import Any

from rigid_envs.cli.words import config_of, refuse_missing_folder

__all__ = ["add_play"]


def add_play(verbs: Any) -> None:
    """Add the verb to the parser of the command."""
    playing = verbs.add_parser(
        "play",
        help="steer an environment yourself, by keyboard, mouse or gamepad",
        usage="rigid-envs play ID [OPTION ...] [--KEY VALUE ...]",
        description="Open a window in which you steer, in real time, and see your result beside "
        "what the reference controller makes of the same start. Any hyperparameter can be given as "
        "an option, as for `describe`.",
        allow_abbrev=False,
    )
    playing.add_argument("id", metavar="ID")
    playing.add_argument("--seed", type=int, default=0, metavar="N", help="of the first start (0)")
    playing.add_argument("--size", type=int, default=640, metavar="PIXELS", help="(640)")
    playing.add_argument("--save", type=Path, metavar="FILE", help="a replay of all you play")
    playing.add_argument("--help-keys", action="store_true", help="say which keys do what")
    playing.set_defaults(act=_play)


def _play(options: argparse.Namespace, rest: list[str]) -> None:
    from rigid_envs.play import keys, play

    config = config_of(rest)
    if options.help_keys:
        print(keys(options.id, config))
        return
    refuse_missing_folder("--save", options.save)
    saved = play(options.id, options.seed, config, options.size, options.save)
    if saved:
        print(f"written to {saved}; to see it: rigid-envs replay {saved}")
