"""The command line `python -m agents VERB`."""

import argparse
import sys
from collections.abc import Sequence

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import DamagedFileError
from rigid_envs.tools.cli.scoring import leaderboard_
from rigid_envs.tools.cli.words import answer, parser_of

from ..storage.runs import RunInUseError
from . import verbs

_SHORT = ("train", "--total_timesteps", "800_000")
"""Without arguments: two thirds of the steps of the recipe, for a first look."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb.

    Args:
        argv: Words of the command line; None takes those of the process.

    Returns:
        The exit status: 0; 1 for a failure; 2 for bad usage; 128 + n after signal n.
    """
    words = list(sys.argv[1:] if argv is None else argv) or list(_SHORT)
    if words[0].startswith("-") and words[0] not in ("-h", "--help", "--version"):
        words = ["train", *words]
    mistakes = ConfigError, DamagedFileError
    return answer(_parser(), words, mistakes, (RunInUseError, FloatingPointError))


def _parser() -> argparse.ArgumentParser:
    return parser_of(
        "python -m agents",
        "Train, evaluate and watch agents. Without arguments: train on BallPark with "
        "PPO for 0.8 M steps, evaluate on 500 unseen starts, and say where everything was written.",
        *(verbs.train, verbs.evaluate, leaderboard_, verbs.enjoy),
        *(verbs.benchmark, verbs.search, verbs.baselines, verbs.curves, verbs.publish),
    )
