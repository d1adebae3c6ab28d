"""The verb `ablate`: train the recipes with each of their parts alone."""

from __future__ import annotations

import argparse
from pathlib import Path

from rigid_envs.files import write_atomic
from rigid_envs.scores.starts import N_STARTS

from .words import refuse, seeds_of

__all__ = ["ablate", "add_ablate"]


def add_ablate(parser: argparse.ArgumentParser) -> None:
    """Add the options of the verb.

    Args:
        parser: Parser of the verb.
    """
    from ..ablations.plan import NAMES, PARTS

    parser.set_defaults(run=ablate)
    parser.description = (
        f"Train {', '.join(NAMES)} with each part of their recipes alone ({', '.join(PARTS)}), and "
        "write records as benchmark does, a folder for each part, and a page RECORDS.md about all "
        "records. The same command goes on."
    )
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, help="(all)")
    parser.add_argument("--names", nargs="+", choices=NAMES, default=NAMES, help="of ids (all)")
    parser.add_argument("--seeds", default="0-2", help="of the trainings (0-2)")
    parser.add_argument("--out", default="logs/ablations", metavar="FOLDER",
                        help="of the runs (%(default)s)")  # fmt: skip
    parser.add_argument("--records", type=Path, metavar="FOLDER", help="(OUT/records)")
    parser.add_argument("--quiet", action="store_true", help="no progress, only the results")


def ablate(options: argparse.Namespace, rest: list[str]) -> int:
    """Train each variant with several seeds."""
    refuse(rest)
    from ..ablations.page import markdown
    from ..ablations.plan import ablation
    from ..training.benchmark import train_all

    records = options.records or Path(options.out) / "records"
    for part in options.parts:
        configs = [
            ablation(name, part, seed, log_dir=options.out, run_name=f"{name}_{part}_{seed}")
            for seed in seeds_of(options.seeds)
            for name in options.names
        ]
        status = train_all(configs, records / part, N_STARTS, options.quiet)
        if status:
            return status
    page = records.with_suffix(".md")
    write_atomic(page, markdown(records))
    print(f"records: {records}, page: {page}")
    return 0
