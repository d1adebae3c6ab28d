"""The verbs `publish` and `baselines`: policies into the library, records onto a page."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..storage.runs import find_run
from .words import refuse

__all__ = ["add_baselines", "add_publish"]


def add_publish(parser: argparse.ArgumentParser) -> None:
    """Add the options of the verb.

    Args:
        parser: Parser of the verb.
    """
    parser.set_defaults(run=_publish)
    parser.description = (
        "Copy the best policy of complete runs into rigid_envs/policies, where rigid_envs.load "
        "finds it, and write beside it the record of its evaluation from the 500 test starts."
    )
    parser.add_argument("paths", nargs="+", type=Path, metavar="RUN")


def add_baselines(parser: argparse.ArgumentParser) -> None:
    """Add the options of the verb.

    Args:
        parser: Parser of the verb.
    """
    parser.set_defaults(run=_baselines)
    parser.description = (
        "Write FOLDER.md about all records below a folder, those of `benchmark`, and figures into "
        "the folder: learning curves, interquartile means, profiles, probabilities of improvement."
    )
    parser.add_argument("folder", type=Path, metavar="FOLDER")


def _publish(options: argparse.Namespace, rest: list[str]) -> int:
    refuse(rest)
    from ..training.recording import publish

    for path in options.paths:
        print(f"written: {publish(find_run(path))}, and its record", flush=True)
    return 0


def _baselines(options: argparse.Namespace, rest: list[str]) -> int:
    refuse(rest)
    from ..evaluation.baseline_figures import write_baselines

    write_baselines(options.folder)
    print(f"written: {options.folder}.md, and figures in {options.folder}")
    return 0
