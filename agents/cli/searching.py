"""The verb `search`: search hyperparameters by Optuna under Ray Tune."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from .words import refuse, refuse_jobs, require_ray

__all__ = ["add_search"]


def add_search(parser: argparse.ArgumentParser) -> None:
    """Add the options of the verb.

    Args:
        parser: Parser of the verb.
    """
    parser.set_defaults(run=_search)
    parser.description = (
        "Search hyperparameters, as a YAML file says: a recipe in which any value may be a range. "
        "Optuna proposes, Ray Tune trains, and what counts are evaluations on validation starts. "
        "Writes a table of all trials and the best as configs for `train --config`. With "
        "--resume, the same command goes on where it was stopped."
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="such as configs/searches/*.yaml")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="(logs/search/NAME)")
    parser.add_argument(
        "--resume",
        action="store_true",
        help="go on with the search in the folder, which must be your own: Ray keeps pickles there",
    )
    parser.add_argument(
        "--ray", metavar="ADDRESS", default="local", help="of a cluster (%(default)s)"
    )
    parser.add_argument(
        "--jobs",
        type=int,
        metavar="N",
        default=os.cpu_count() or 1,
        help="trials at the same time, without a cluster (%(default)s)",
    )


def _search(options: argparse.Namespace, rest: list[str]) -> int:
    refuse(rest)
    refuse_jobs(options.jobs)
    from ..config.search import read_search

    search = read_search(options.file)
    require_ray()
    from ..sweeps.cluster import connect
    from ..sweeps.search import search_recipe

    connect(options.ray, options.jobs)
    out = options.out or Path("logs/search") / options.file.stem
    found = search_recipe(search, out, tuple(options.allow_import), options.resume)
    for path in found.configs:
        note = path.read_text(encoding="utf-8").splitlines()[0]
        print(f"{path}  {note}")
    print(f"all trials: {out / 'trials.csv'}")
    if found.n_trials < search.trials:
        print(f"{found.n_trials} of {search.trials} trials are done; --resume goes on")
        return 1
    return 0
