"""The command line `python -m agents VERB`: its verbs and options."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from gymnasium.error import DependencyNotInstalled

from rigid_envs import __version__
from rigid_envs.base.checks import ConfigError, shown
from rigid_envs.base.files import DamagedFileError
from rigid_envs.scores.starts import N_STARTS
from rigid_envs.tasks.registry import ENVIRONMENTS

from ..config.entries import ALGORITHMS
from ..config.reading import add_config_options
from ..environments import import_allowed
from ..storage.runs import RunInUseError
from . import verbs
from .evaluating import add_baselines, add_evaluate, add_publish, add_search, add_zoo
from .words import add_policy_options, add_sweep_options

_SHORT = ("train", "--total_timesteps", "1_500_000")
"""Without a word: less than half of the steps of the recipe, for who sees it for the first time."""


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
    options, rest = _parser().parse_known_args(words)
    try:
        import_allowed(options.allow_import)
        status: int = options.run(options, rest)
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    except (
        RunInUseError,
        FloatingPointError,
        OSError,
        ImportError,
        DependencyNotInstalled,
    ) as error:
        print(f"error: {shown(str(error))}", file=sys.stderr)
        return 1
    except (ConfigError, DamagedFileError) as error:
        print(f"error: {shown(str(error))}", file=sys.stderr)
        return 2
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m agents",
        description="Train, evaluate and watch agents. Without a word: train on BallPark with PPO "
        "for 1.5 M steps, evaluate on 500 unseen starts, and say where everything was written.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"rigid-envs {__version__}")
    commands = parser.add_subparsers(metavar="VERB", required=True)
    _add_train(commands.add_parser("train", help="train, then evaluate", allow_abbrev=False))
    add_evaluate(commands.add_parser("evaluate", help="success and efficiency on unseen starts"))
    _add_leaderboard(commands.add_parser("leaderboard", help="one table and plot of evaluations"))
    _add_enjoy(commands.add_parser("enjoy", help="watch one episode, in a window or as a film"))
    _add_benchmark(
        commands.add_parser("benchmark", help="train all environments, with several seeds")
    )
    add_search(commands.add_parser("search", help="search hyperparameters"))
    add_baselines(commands.add_parser("baselines", help="page and figures of all records"))
    add_publish(commands.add_parser("publish", help="put a policy into the library"))
    add_zoo(commands.add_parser("zoo", help="write configs for RL Baselines3 Zoo"))
    for verb in commands.choices.values():
        verb.add_argument(
            "--allow_import",
            metavar="MODULE",
            action="append",
            default=[],
            help="import a module first, which may register environments of its own",
        )
    return parser


def _add_train(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=verbs.train)
    parser.usage = "python -m agents train [--config FILE | --resume RUN] [--ENTRY VALUE ...]"
    parser.description = (
        "Train from a config file; every entry of it can be given as an option too, and "
        "--env_kwargs.NAME VALUE sets a hyperparameter of the task. Ctrl-C and SIGTERM save "
        "first, and say how to go on."
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="(that of the environment)")
    parser.add_argument("--resume", type=Path, metavar="RUN", help="go on with a run, to the bit")
    parser.add_argument("--overwrite", action="store_true", help="delete a run of the same name")
    parser.add_argument("--print_config", action="store_true", help="print the config and stop")
    parser.add_argument("--quiet", action="store_true", help="no progress, only the result")
    add_config_options(parser)


def _add_leaderboard(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=verbs.leaderboard)
    parser.description = (
        "Collect all results below a folder, ours and of rigid_envs.evaluate, into leaderboard.md "
        "and leaderboard.png there."
    )
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument(
        "--packaged",
        action="store_true",
        help="also of what comes with the package: published policies and controllers",
    )


def _add_enjoy(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=verbs.enjoy)
    parser.description = (
        "Print one episode, step by step, and show it: in a window where there is a display (Space "
        "pauses, R plays it again, Esc closes), and else in a film, enjoy.mp4 in the folder of the "
        "policy. --video and --html write files instead."
    )
    add_policy_options(parser)
    parser.add_argument("--seed", type=int, help="of the start (the first of the evaluation)")
    parser.add_argument("--random", action="store_true", help="act at random instead")
    parser.add_argument(
        "--against",
        metavar="CONTROLLER",
        help="show a controller beside it, from the same start: one by its name, `reference` for "
        "the best one, `nmpc` where there is one, `sampling`, `zero` or `random`",
    )
    parser.add_argument("--video", metavar="FILE", help="write a film: FILE.mp4, .gif or .webp")
    parser.add_argument("--html", metavar="FILE", help="write a page for a browser")
    parser.add_argument("--table", action="store_true", help="print only")


def _add_benchmark(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=verbs.benchmark)
    parser.description = (
        "Train every environment with its config (configs/NAME_reduced_ALGO.yaml, else "
        "configs/NAME_ALGO.yaml, else the defaults of the algorithm that suits it), with several "
        "seeds, and write a record of each: config, learning curve, times, and success and cost "
        "from each test start. Each training is a process of its own, which can die without harm: "
        "it begins again at its last checkpoint. What has a record is left out: the same command "
        "goes on where it was stopped, and several may share the work."
    )
    parser.add_argument("--ids", "--env_id", nargs="+", metavar="ID", default=list(ENVIRONMENTS),
                        help="(all)")  # fmt: skip
    parser.add_argument("--algo", choices=tuple(ALGORITHMS), help="(the one that suits each)")
    parser.add_argument("--frame", choices=("world", "reduced"), help="(as the config says)")
    parser.add_argument("--steps", metavar="N", help="of each training (as its config says)")
    parser.add_argument("--episodes", type=int, default=N_STARTS, metavar="N", help="(500)")
    parser.add_argument(
        "--overwrite", action="store_true", help="begin anew what was trained with another config"
    )
    add_sweep_options(parser, "logs/benchmark", "0")
