"""Verbs of training."""

from __future__ import annotations

import argparse
import dataclasses
import re
import signal
from pathlib import Path
from typing import Any

from rigid_envs import load
from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.lookup import full_id
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, row_seeds

from ..config.entries import ALGORITHMS, config_to_dict
from ..config.reading import (
    dump_yaml,
    entry_value,
    env_keywords,
    load_config,
    parse_yaml,
    read_yaml,
)
from ..evaluation.plots import draw_learning_curve
from ..evaluation.reports import report, try_film, write_report
from ..storage.runs import Run, create_run, find_run, open_run
from ..training.trainer import Outcome
from .words import is_run, policy_file, refuse, refuse_episodes, seeds_of, workers_of

# Final evaluation of a complete run.


def conclude(run: Run, outcome: Outcome, n: int, seed: int, quiet: bool = False) -> dict[str, Any]:
    """Evaluate the best policy of a run, and write figures, learning curve and film into it.

    Args:
        run: A complete run.
        outcome: Its steps and seconds.
        n: Number of unseen starts.
        seed: Seed of the starts.
        quiet: Whether no progress is shown.

    Returns:
        The figures of `report`, where `training_timesteps` is the age of that policy, and of all
        the training `run_timesteps` and `training_seconds`.
    """
    path = run / "best_model" / "policy.safetensors"
    figures, episodes = report(path, n, seed, quiet)
    figures["run_timesteps"] = outcome.timesteps
    figures["training_seconds"] = round(outcome.seconds, 3)
    write_report(run.folder, figures, episodes)
    draw_learning_curve(run)
    try_film(load(path), run.folder, seed)
    return figures


# The verbs of the command line: train, leaderboard, enjoy, benchmark.
#
# Importing torch and SB3 takes seconds, so it waits until it is clear that there is work to do.

_DEFAULT = "RigidEnvs/BallPark-v0"


def train(options: argparse.Namespace, rest: list[str]) -> int:
    """Train a new run, or resume one, and evaluate it."""
    known = {f.name for kind in ALGORITHMS.values() for f in dataclasses.fields(kind)}
    entries = {key: value for key, value in vars(options).items() if key in known}
    run = _resumed(options, entries, rest) if options.resume else _started(options, entries, rest)
    if run is None:
        return 0
    from ..training.trainer import train_in

    imports = "".join(f" --allow_import {module}" for module in options.allow_import)
    again = f"python -m agents train --resume {run.folder}{imports}"
    try:
        outcome = train_in(run, options.quiet)
        if outcome.stopped_by is not None:
            print(
                f"stopped by {signal.Signals(outcome.stopped_by).name} after "
                f"{outcome.timesteps:,} steps; all is saved. To go on:\n  {again}"
            )
            return 128 + outcome.stopped_by
        return _finish(run, outcome, imports, options.quiet)
    except KeyboardInterrupt:
        print("interrupted; the training is complete and saved. To evaluate it: ", again)
        raise
    finally:
        run.close()


def _started(options: argparse.Namespace, entries: dict[str, str], rest: list[str]) -> Run | None:
    config = load_config(_recipe(options.config, entries, rest), entries, rest)
    if options.print_config:
        print(dump_yaml(config_to_dict(config)), end="")
        return None
    return create_run(config, options.overwrite)


def _recipe(path: Path | None, entries: dict[str, str], rest: list[str]) -> dict[str, Any]:
    """Entries of the config file that was named, or else of the environment's own."""
    from ..config.reading import frame_of, recipe_for, shipped_config

    if path is not None:
        return read_yaml(path if path.exists() else shipped_config(path))

    chosen = entries.keys() & {"env_id", "algo", "env_kwargs"}
    values = {key: entry_value(key, entries[key]) for key in chosen}
    env_id = str(values.get("env_id", _DEFAULT))
    return recipe_for(env_id, values.get("algo"), frame_of(values, env_keywords(rest)))


def _resumed(options: argparse.Namespace, entries: dict[str, str], rest: list[str]) -> Run | None:
    changes = [*entries, *rest, *(["config"] if options.config else [])]
    if changes or options.overwrite:
        raise ConfigError(
            f"--resume goes on with the run as it was started; leave out {changes or '--overwrite'}"
        )
    if options.print_config:
        print(dump_yaml(config_to_dict(find_run(options.resume).config())), end="")
        return None
    return open_run(options.resume)


def _finish(run: Run, outcome: Outcome, imports: str, quiet: bool) -> int:
    from ..evaluation.reports import NAME, table

    figures = conclude(run, outcome, N_STARTS, TEST_SEED, quiet)
    film = f"  {NAME:<39} what it does\n" if (run / NAME).exists() else ""
    print(
        f"\n{table(figures)}\n\ntrained in {outcome.seconds:.0f} s. In {run.folder.absolute()}:\n"
        f"{film}"
        "  learning_curve.png, evaluations.npz     how it learnt\n"
        "  results.json, episodes.csv              the table above, and every start of it\n"
        "  best_model/, last_model/                policies\n"
        "  progress.csv, monitor.csv, tensorboard/ logs\n\n"
        f"Next:\n{_next(run, imports)}"
    )
    return 0


def _next(run: Run, imports: str) -> str:
    """Three commands to go on with, each with what it is for."""
    from ..config.reading import recipe_for
    from ..training.recording import frame_of

    config = run.config()
    recipe = recipe_for(config.env_id, config.algo, frame_of(config))
    whole = recipe.get("total_timesteps", 0)
    again = ["python -m agents train --env_id", config.env_id]
    if config.total_timesteps < whole:
        what = f"train with all {whole:,} steps of its recipe"
    else:
        what, again = "another seed: how much was luck?", [*again, "--seed", str(config.seed + 1)]
    commands = [
        (f"python -m agents enjoy {run.folder}{imports}", "watch an episode, step by step"),
        (f"tensorboard --logdir {run / 'tensorboard'}", "see how it learnt, in a browser"),
        (" ".join(again) + imports, what),
    ]
    return "\n".join(f"  {command}\n      {why}" for command, why in commands)


def leaderboard(options: argparse.Namespace, rest: list[str]) -> int:
    """Write the leaderboard of all results below a folder."""
    refuse(rest)
    from rigid_envs.scores.leaderboard import write_leaderboard

    text = write_leaderboard(options.folder, options.packaged)
    print(f"{text}\nwritten to {options.folder}: leaderboard.md, .png")
    return 0


def enjoy(options: argparse.Namespace, rest: list[str]) -> int:
    """Print one episode of a policy, and show it."""
    refuse(rest)
    from ..evaluation.showing import Show, refuse_early, watch

    video, html = refuse_early(options.video, options.html, options.table, options.against)
    file = policy_file(options.path, options.which)
    policy = load(file)
    seed = row_seeds(TEST_SEED, 1, "test")[0] if options.seed is None else options.seed
    document = policy.document
    chosen = None if options.random else policy
    show = Show(chosen, document, seed, options.against)
    watch(chosen, document["env_id"], document["env_kwargs"], seed)
    if not options.table:
        folder = options.path if is_run(options.path) else file.parent
        show(video, html, folder / "enjoy.mp4")
    return 0


def benchmark(options: argparse.Namespace, rest: list[str]) -> int:
    """Train and evaluate several environments with several seeds."""
    refuse(rest)
    refuse_episodes(options.episodes)
    from ..config.reading import config_for
    from ..sweeps.sweep import Training, train_all
    from ..training.recording import frame_of

    entries = {"log_dir": options.out}
    if options.algo is not None:
        entries["algo"] = options.algo
    if options.steps is not None:
        entries["total_timesteps"] = parse_yaml(options.steps)
    records = options.records or Path(options.out) / "records"
    trainings = []
    for seed in seeds_of(options.seeds):
        for env_id in dict.fromkeys(map(full_id, options.ids)):
            config = config_for(env_id, {**entries, "seed": seed}, options.frame)
            name = f"{re.split('[:/]', env_id)[-1]}_{frame_of(config)}_{seed}"
            config = dataclasses.replace(config, run_name=name)
            trainings.append(Training(config, records, options.episodes))
    status = train_all(
        trainings, workers_of(options), options.overwrite, options.quiet, options.patience
    )
    if status >= 128:
        print(f"stopped by {signal.Signals(status - 128).name}; the same command goes on")
    else:
        print(f"records: {records}")
    return status
