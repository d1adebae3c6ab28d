"""The command line: `python -m agents VERB`: train, evaluate, leaderboard, enjoy, benchmark.

Importing torch and SB3 takes seconds, so it waits until it is clear that there is work to do.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import re
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigid_envs import ENVIRONMENTS
from rigid_envs.files import DamagedFileError

from .checks import ConfigError
from .config import ALGORITHMS
from .loading import add_config_options, dump_yaml, load_config, parse_yaml, read_yaml
from .runs import Run, RunInUseError, create_run, find_run, open_run
from .seeds import TEST_SEED, row_seeds

if TYPE_CHECKING:
    from .training import Outcome

__all__ = ["main"]

_DEFAULT = "RigidEnvs/BallPark-v0"
_STARTS = 500
_RESULTS = Path("logs/results")


def main(argv: Sequence[str] | None = None) -> int:
    """Do what the command line says.

    Args:
        argv: Its words; None takes those of the process.

    Returns:
        The exit status: 0; 1 for a failure; 2 for bad usage; 128 + n after signal n.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    if not words or (words[0].startswith("-") and words[0] not in ("-h", "--help")):
        words = ["train", *words]
    options, rest = _parser().parse_known_args(words)
    try:
        for module in options.allow_import:
            importlib.import_module(module)
        status: int = options.act(options, rest)
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    except (RunInUseError, FloatingPointError, OSError, ImportError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except (ConfigError, DamagedFileError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m agents",
        description="Train, evaluate and watch agents. Without a verb: train on BallPark with "
        "PPO, evaluate on 500 unseen starts, and say where everything was written.",
        allow_abbrev=False,
    )
    verbs = parser.add_subparsers(metavar="VERB", required=True)
    _add_train(verbs.add_parser("train", help="train, then evaluate", allow_abbrev=False))
    _add_evaluate(verbs.add_parser("evaluate", help="metrics and scores on unseen starts"))
    _add_leaderboard(verbs.add_parser("leaderboard", help="one table and plot of evaluations"))
    _add_enjoy(verbs.add_parser("enjoy", help="print one episode, step by step"))
    _add_benchmark(verbs.add_parser("benchmark", help="train every environment; one table of all"))
    for verb in verbs.choices.values():
        verb.add_argument(
            "--allow-import",
            "--allow_import",
            metavar="MODULE",
            action="append",
            default=[],
            help="import a module first, which may register environments of its own",
        )
    return parser


def _add_train(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(act=_train)
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


def _add_evaluate(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(act=_evaluate)
    parser.description = (
        "Play one episode from each of the fixed starts: a policy, or with --controller what needs "
        "no training: a reference controller by its name, `reference` for the best one, `sampling` "
        "or `random`."
    )
    _add_policy_options(parser, "?")
    parser.add_argument("--controller", metavar="NAME", help="in place of a policy")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--ids", nargs="+", metavar="ID", default=[], help="for --controller")
    which.add_argument("--all", action="store_true", help="all ids that have such a controller")
    parser.add_argument("--episodes", type=int, default=_STARTS, metavar="N", help="(500)")
    parser.add_argument("--seed", type=int, default=TEST_SEED, help=f"of the starts ({TEST_SEED})")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="for results.json, episodes.csv (the run); of controllers, ID/NAME is added to it "
        "(logs/results)",
    )


def _add_leaderboard(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(act=_leaderboard)
    parser.description = (
        "Collect all results.json below a folder into leaderboard.md and leaderboard.png there."
    )
    parser.add_argument("folder", type=Path, metavar="FOLDER")


def _add_enjoy(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(act=_enjoy)
    _add_policy_options(parser)
    parser.add_argument("--seed", type=int, help="of the start (the first of the evaluation)")
    parser.add_argument("--random", action="store_true", help="act at random instead")


def _add_benchmark(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(act=_benchmark)
    parser.description = (
        "Train every environment with its config (configs/NAME_ALGO.yaml, or else the defaults of "
        "the algorithm that suits it), compare with a random policy on the same unseen starts, "
        "and write one table. The same command goes on where it was stopped."
    )
    parser.add_argument("--ids", nargs="+", metavar="ID", default=list(ENVIRONMENTS), help="(all)")
    parser.add_argument("--steps", metavar="N", help="of each training (as its config says)")
    parser.add_argument("--seed", default="0", help="of the trainings (0)")
    parser.add_argument("--episodes", type=int, default=_STARTS, metavar="N", help="(500)")
    parser.add_argument("--out", default="logs/benchmark", metavar="FOLDER", help="(%(default)s)")
    parser.add_argument("--quiet", action="store_true", help="no progress, only the table")


def _add_policy_options(parser: argparse.ArgumentParser, number: str | None = None) -> None:
    parser.add_argument("path", type=Path, metavar="RUN_OR_POLICY", nargs=number)
    parser.add_argument("--which", choices=("best", "last"), default="best", help="of a run (best)")


def _train(options: argparse.Namespace, rest: list[str]) -> int:
    known = {f.name for kind in ALGORITHMS.values() for f in dataclasses.fields(kind)}
    entries = {key: value for key, value in vars(options).items() if key in known}
    run = _resumed(options, entries, rest) if options.resume else _started(options, entries, rest)
    if run is None:
        return 0
    from .training import train_in

    again = f"python -m agents train --resume {run.folder}"
    again += "".join(f" --allow-import {module}" for module in options.allow_import)
    try:
        outcome = train_in(run, options.quiet)
        if outcome.stopped_by is not None:
            print(
                f"stopped by {signal.Signals(outcome.stopped_by).name} after "
                f"{outcome.timesteps:,} steps; all is saved. To go on:\n  {again}"
            )
            return 128 + outcome.stopped_by
        return _finish(run, outcome)
    except KeyboardInterrupt:
        print("interrupted; the training is complete and saved. To evaluate it: ", again)
        raise
    finally:
        run.close()


def _started(options: argparse.Namespace, entries: dict[str, str], rest: list[str]) -> Run | None:
    config = load_config(_recipe(options.config, entries), entries, rest)
    if options.print_config:
        print(dump_yaml(config), end="")
        return None
    return create_run(config, options.overwrite)


def _recipe(path: Path | None, entries: dict[str, str]) -> dict[str, Any]:
    """Entries of the config file that was named, or else of the environment's own."""
    if path is not None:
        return read_yaml(path)
    from .recipes import recipe_for

    env_id = str(parse_yaml(entries.get("env_id", _DEFAULT)))
    algo = parse_yaml(entries["algo"]) if "algo" in entries else None
    return recipe_for(env_id, algo)


def _resumed(options: argparse.Namespace, entries: dict[str, str], rest: list[str]) -> Run | None:
    changes = [*entries, *rest, *(["config"] if options.config else [])]
    if changes or options.overwrite:
        raise ConfigError(
            f"--resume goes on with the run as it was started; leave out {changes or '--overwrite'}"
        )
    if options.print_config:
        print(dump_yaml(find_run(options.resume).config()), end="")
        return None
    return open_run(options.resume)


def _finish(run: Run, outcome: Outcome) -> int:
    from .reports import conclude, table

    figures = conclude(run, outcome, _STARTS, TEST_SEED)
    print(
        f"\n{table(figures)}\n\ntrained in {outcome.seconds:.0f} s. In {run.folder}:\n"
        "  best_model/, last_model/                policies\n"
        "  results.json, episodes.csv              the table above, and every start of it\n"
        "  learning_curve.png, evaluations.npz     how it learnt\n"
        "  progress.csv, monitor.csv, tensorboard/ logs\n"
        f"Watch it: python -m agents enjoy {run.folder}"
    )
    return 0


def _evaluate(options: argparse.Namespace, rest: list[str]) -> int:
    _refuse(rest)
    _refuse_episodes(options.episodes)
    if (options.path is None) == (options.controller is None):
        raise ConfigError("expected a run or policy, or --controller NAME")
    if options.controller is not None:
        return _evaluate_controller(options)
    if options.ids or options.all:
        raise ConfigError("--ids, --all: a policy knows its environment; leave them out")
    from .reports import report, table, write_report

    figures, episodes = report(
        _policy_file(options.path, options.which), options.episodes, options.seed
    )
    print(table(figures))
    folder = options.out or (options.path if _is_run(options.path) else None)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        write_report(folder, figures, episodes)
        print(f"written to {folder}: results.json, episodes.csv")
    return 0


def _evaluate_controller(options: argparse.Namespace) -> int:
    from rigid_envs.scores.untrained import untrained_policy

    from .reports import report_controller, table, write_report

    if not (options.ids or options.all):
        raise ConfigError("--controller: expected --ids ID ... or --all")
    chosen = []
    for env_id in ENVIRONMENTS if options.all else dict.fromkeys(options.ids):
        try:
            chosen.append((env_id, *untrained_policy(env_id, options.controller)))
        except ValueError as error:
            if not options.all:
                raise ConfigError(f"--controller: {error}") from None
    if not chosen:
        raise ConfigError(f"--controller: no id has a controller {options.controller!r}")
    for env_id, name, player in chosen:
        figures, episodes = report_controller(name, player, env_id, options.episodes, options.seed)
        folder = (options.out or _RESULTS) / env_id.split("/")[-1] / name
        folder.mkdir(parents=True, exist_ok=True)
        write_report(folder, figures, episodes)
        print(f"{table(figures)}\nwritten to {folder}: results.json, episodes.csv\n", flush=True)
    return 0


def _leaderboard(options: argparse.Namespace, rest: list[str]) -> int:
    _refuse(rest)
    from .leaderboard import leaderboard

    print(f"{leaderboard(options.folder)}\nwritten to {options.folder}: leaderboard.md, .png")
    return 0


def _enjoy(options: argparse.Namespace, rest: list[str]) -> int:
    _refuse(rest)
    from .policies import load_policy
    from .watching import watch

    policy = load_policy(_policy_file(options.path, options.which))
    seed = row_seeds(TEST_SEED, 1, "test")[0] if options.seed is None else options.seed
    document = policy.document
    watch(None if options.random else policy, document["env_id"], document["env_kwargs"], seed)
    return 0


def _benchmark(options: argparse.Namespace, rest: list[str]) -> int:
    _refuse(rest)
    _refuse_episodes(options.episodes)
    from .benchmark import benchmark
    from .recipes import config_for

    entries = {"seed": parse_yaml(options.seed), "log_dir": options.out}
    if options.steps is not None:
        entries["total_timesteps"] = parse_yaml(options.steps)
    configs = [
        config_for(env_id, {**entries, "run_name": re.split("[:/]", env_id)[-1]})
        for env_id in dict.fromkeys(options.ids)
    ]
    folder = Path(options.out)
    status = benchmark(configs, folder, options.episodes, options.quiet)
    if status >= 128:
        print(f"stopped by {signal.Signals(status - 128).name}; the same command goes on")
    else:
        print(
            f"\n{(folder / 'benchmark.md').read_text()}\nwritten to {folder}: benchmark.md, .json"
        )
    return status


def _policy_file(path: Path, which: str) -> Path:
    if _is_run(path):
        path = path / f"{which}_model"
    return path / "policy.safetensors" if path.is_dir() else path


def _is_run(path: Path) -> bool:
    return (path / "config.yaml").is_file()


def _refuse_episodes(n: int) -> None:
    if not 1 <= n <= 1_000_000:
        raise ConfigError(f"--episodes: expected 1 to 1000000, got {n}")


def _refuse(rest: list[str]) -> None:
    if rest:
        raise ConfigError(f"unknown option {rest[0]}; --help lists those that there are")
