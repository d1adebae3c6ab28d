"""`rigid-envs dataset`: its arguments."""

import argparse
from pathlib import Path
from typing import Any

from rigid_envs.cli.progress import tell
from rigid_envs.cli.words import config_of, refuse

__all__ = ["add_dataset"]


def add_dataset(verbs: Any) -> None:
    """Add the verb to the parser of the command."""
    collecting = verbs.add_parser(
        "dataset",
        help="episodes of a policy as a Minari data set; or one played again",
        usage="rigid-envs dataset ID --policy NAME|FILE [OPTION ...] [--KEY VALUE ...]\n"
        "       rigid-envs dataset --check DATASET [--out FOLDER]",
        description="Play episodes and write them as a data set of Minari, with what is needed to "
        "play them again to the bit. Any hyperparameter can be given as an option.",
        allow_abbrev=False,
    )
    collecting.add_argument("id", metavar="ID", nargs="?")
    collecting.add_argument(
        "--policy",
        metavar="NAME|FILE",
        help="`random`; `reference` for the best reference controller, or its name; a trained "
        "policy: a file (.safetensors), or `BallPark`, the published one of that id",
    )
    collecting.add_argument("--episodes", type=int, default=100, metavar="N", help="(100)")
    collecting.add_argument("--seed", type=int, default=0, metavar="S", help="of the starts (0)")
    collecting.add_argument(
        "--name", metavar="DATASET", help="(rigid-envs/<environment>/<policy>-v0)"
    )
    collecting.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="of all data sets (MINARI_DATASETS_PATH, or ~/.minari/datasets)",
    )
    collecting.add_argument("--overwrite", action="store_true", help="replace one of that name")
    collecting.add_argument(
        "--check", metavar="DATASET", help="play its episodes again, and compare every bit"
    )
    collecting.set_defaults(act=_dataset)


def _dataset(options: argparse.Namespace, rest: list[str]) -> int:
    if options.check is not None:
        refuse([*rest, *([options.id] if options.id else [])])
        return _check(options)
    if options.id is None or options.policy is None:
        raise ValueError("expected ID and --policy NAME, or --check DATASET")
    from rigid_envs import datasets

    name = datasets.write(
        options.id,
        options.policy,
        options.episodes,
        seed=options.seed,
        name=options.name,
        folder=options.out,
        overwrite=options.overwrite,
        config=config_of(rest),
        tell=tell,
    )
    tell("")
    place = f" --out {options.out}" if options.out else ""
    print(f"written: {name}\nto play it again: rigid-envs dataset --check {name}{place}")
    return 0


def _check(options: argparse.Namespace) -> int:
    from rigid_envs import datasets

    found = datasets.check(options.check, options.out)
    for line in found.differences:
        print(f"FAILS: {line}")
    verdict = "FAILS" if found.differences else "holds"
    print(
        f"{options.check}: {found.episodes} episodes, {found.steps} steps, bit for bit: {verdict}"
    )
    return 1 if found.differences else 0
