"""Verbs beside training: evaluate, enjoy, publish, search."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rigid_envs import load
from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import write_atomic
from rigid_envs.envs.lookup import full_id
from rigid_envs.scores.starts import N_STARTS, TEST_SEED
from rigid_envs.tasks.registry import ENVIRONMENTS

from ..storage.runs import find_run
from .words import (
    add_policy_options,
    is_run,
    policy_file,
    refuse,
    refuse_episodes,
    refuse_jobs,
    require_ray,
)

# The verb `evaluate`: success and efficiency of a policy or of controllers.

_RESULTS = Path("logs/results")


def add_evaluate(parser: argparse.ArgumentParser) -> None:
    """Add the options of the verb.

    Args:
        parser: Parser of the verb.
    """
    parser.set_defaults(run=_evaluate)
    parser.description = (
        "Play one episode from each of the fixed starts: a policy, or with --controller what needs "
        "no training: a reference controller by its name, `reference` for the best one, "
        "`nmpc` where there is one, `sampling`, `zero` or `random`."
    )
    add_policy_options(parser, "?")
    parser.add_argument("--controller", metavar="NAME", help="in place of a policy")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--ids", nargs="+", metavar="ID", default=[], help="for --controller")
    which.add_argument("--all", action="store_true", help="all ids that have such a controller")
    parser.add_argument("--episodes", type=int, default=N_STARTS, metavar="N", help="(500)")
    parser.add_argument("--seed", type=int, default=TEST_SEED, help=f"of the starts ({TEST_SEED})")
    parser.add_argument(
        "--save-replays",
        type=int,
        nargs="?",
        const=10,
        default=0,
        metavar="N",
        help="record the first N episodes (10) in replays.npz, for `rigid-envs replay`",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="for results.json, episodes.csv (of a run: evaluated/WHICH-EPISODES-SEED in it); of "
        "controllers, ID/NAME is added to it (logs/results)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")


def _evaluate(options: argparse.Namespace, rest: list[str]) -> int:
    """Evaluate a policy or controllers on unseen starts."""
    refuse(rest)
    refuse_episodes(options.episodes)
    if options.save_replays < 0:
        raise ConfigError(
            f"--save-replays = {options.save_replays}; expected a number of episodes, from 1"
        )
    if (options.path is None) == (options.controller is None):
        raise ConfigError("expected a run or policy, or --controller NAME")
    if options.controller is not None:
        return _evaluate_controller(options)
    if options.ids or options.all:
        raise ConfigError(
            "--ids, --all: expected none beside a policy, which knows its environment"
        )
    from ..evaluation.reports import report, table, write_report

    figures, episodes = report(
        policy_file(options.path, options.which), options.episodes, options.seed
    )
    print(json.dumps(figures, indent=1) if options.json else table(figures))
    folder = options.out or (_evaluated(options) if is_run(options.path) else None)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        write_report(folder, figures, episodes)
        _note(options, f"written to {folder}: results.json, episodes.csv")
    if options.save_replays:
        from rigid_envs.scores.policies import from_predict

        policy = load(policy_file(options.path, options.which))
        config = policy.document["env_kwargs"]
        _save_replays(options, from_predict(policy), figures["env_id"], folder, "policy", config)
    return 0


def _evaluated(options: argparse.Namespace) -> Path:
    """Folder in a run, aside from what its training wrote, which stays as it is."""
    name = f"{options.which}-{options.episodes}-{options.seed}"
    return Path(options.path) / "evaluated" / name


def _evaluate_controller(options: argparse.Namespace) -> int:
    from rigid_envs.scores.policies import untrained_policy

    from ..evaluation.reports import report_controller, table, write_report

    if not (options.ids or options.all):
        raise ConfigError("--controller: expected --ids ID ... or --all")
    chosen = []
    for env_id in ENVIRONMENTS if options.all else dict.fromkeys(map(full_id, options.ids)):
        try:
            chosen.append((env_id, *untrained_policy(env_id, options.controller)))
        except ValueError as error:
            if not options.all:
                raise ConfigError(f"--controller: {error}") from None
    if not chosen:
        raise ConfigError(
            f"--controller: controller = {options.controller!r}; expected one that some id has"
        )
    for env_id, name, policy in chosen:
        folder = (options.out or _RESULTS) / env_id.split("/")[-1] / name
        folder.mkdir(parents=True, exist_ok=True)  # before anything is played for nothing
        figures, episodes = report_controller(name, env_id, options.episodes, options.seed)
        write_report(folder, figures, episodes)
        print(json.dumps(figures, indent=1) if options.json else table(figures))
        _note(options, f"written to {folder}: results.json, episodes.csv\n")
        if options.save_replays:
            _save_replays(options, policy, env_id, folder, name, {})
    return 0


def _save_replays(
    options: argparse.Namespace,
    policy: Any,
    env_id: str,
    folder: Path | None,
    label: str,
    config: Mapping[str, Any],
) -> None:
    """Play the first starts once more, and record them."""
    if env_id not in ENVIRONMENTS:
        raise ConfigError(
            f"--save-replays: env_id = {env_id!r}; expected an environment of rigid_envs"
        )
    from rigid_envs.watch.replays.recording import record_starts

    n = min(options.save_replays, options.episodes)
    replay = record_starts(policy, env_id, n, label, options.seed, config)
    file = replay.save((folder or Path()) / "replays.npz")
    _note(options, f"written to {file}: {n} episodes; see rigid-envs replay {file}")


def _note(options: argparse.Namespace, line: str) -> None:
    """Say what was written, beside the JSON that a program reads."""
    print(line, file=sys.stderr if options.json else sys.stdout, flush=True)


# The verbs `publish`, `baselines` and `zoo`: policies and records, and configs, for others.


def add_publish(parser: argparse.ArgumentParser) -> None:
    """Add the options of the verb.

    Args:
        parser: Parser of the verb.
    """
    parser.set_defaults(run=_publish)
    parser.description = (
        "Copy the best policy of complete runs into rigid_envs/scores/published, where "
        "rigid_envs.load finds it, and beside it the record of its evaluation from the 500 test "
        "starts."
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


def add_zoo(parser: argparse.ArgumentParser) -> None:
    """Add the options of the verb.

    Args:
        parser: Parser of the verb.
    """
    parser.set_defaults(run=_zoo)
    parser.description = (
        "Write the shipped configs into a folder as hyperparameter files of RL Baselines3 Zoo, one "
        "for each algorithm: ALGO.yml."
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
    from ..evaluation.baselines import write_baselines

    write_baselines(options.folder)
    print(f"written: {options.folder}.md, and figures in {options.folder}")
    return 0


def _zoo(options: argparse.Namespace, rest: list[str]) -> int:
    refuse(rest)
    from ..config.zoo import ALGOS, zoo_file

    options.folder.mkdir(parents=True, exist_ok=True)
    for algo in ALGOS:
        write_atomic(options.folder / f"{algo}.yml", zoo_file(algo))
    print(f"written: {', '.join(f'{algo}.yml' for algo in ALGOS)} in {options.folder}")
    return 0


# The verb `search`: search hyperparameters by Optuna under Ray Tune.


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
