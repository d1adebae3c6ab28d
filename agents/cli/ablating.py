"""The verb `ablate`: train the recipes with each of their parts alone."""

from __future__ import annotations

import argparse
from pathlib import Path

from rigid_envs.base.files import write_atomic
from rigid_envs.scores.starts import N_STARTS

from .words import add_sweep_options, refuse, seeds_of, workers_of

__all__ = ["ablate", "add_ablate"]

_REGISTRATION = "agents.ablations.registration"


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
    add_sweep_options(parser, "logs/ablations", "0-2")


def ablate(options: argparse.Namespace, rest: list[str]) -> int:
    """Train each variant with several seeds."""
    refuse(rest)
    from ..ablations.page import markdown
    from ..ablations.plan import ablation
    from ..sweeps.sweep import Training, train_all

    records = options.records or Path(options.out) / "records"
    trainings = []
    for part in dict.fromkeys(options.parts):
        for seed in seeds_of(options.seeds):
            for name in dict.fromkeys(options.names):
                own = {"log_dir": options.out, "run_name": f"{name}_{part}_{seed}"}
                config = ablation(name, part, seed, **own)
                trainings.append(Training(config, records / part, N_STARTS))
    status = train_all(
        trainings,
        workers_of(options, [_REGISTRATION]),
        quiet=options.quiet,
        patience=options.patience,
    )
    if status:
        return status
    page = records.with_suffix(".md")
    write_atomic(page, markdown(records))
    print(f"records: {records}, page: {page}")
    return 0
