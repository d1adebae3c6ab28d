"""The verb `train`: a new run or an old one, and its final evaluation."""

from __future__ import annotations

import argparse
import dataclasses
import signal
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigid_envs.base.checks import ConfigError
from rigid_envs.tools.cli.words import option, verb

from ..config.entries import ALGORITHMS, Config, config_to_dict
from ..config.reading import (
    add_config_options,
    dump_yaml,
    entry_value,
    env_keywords,
    frame_of,
    load_config,
    read_yaml,
    recipe_for,
    shipped_config,
)
from ..storage.runs import Run, create_run, find_run, open_run

if TYPE_CHECKING:
    from ..training.trainer import Session

# Importing torch and SB3 takes seconds, so it waits until it is clear that there is work to do.

_DEFAULT = "RigidEnvs/BallPark-v0"


@verb(
    option("--config", type=Path, metavar="FILE", help="(that of the environment)"),
    option("--resume", type=Path, metavar="RUN", help="go on with a run, to the bit"),
    option("--overwrite", action="store_true", help="delete a run of the same name"),
    option("--print-config", action="store_true", help="print the config and stop"),
    option("--quiet", action="store_true", help="no progress, only the result"),
    add_config_options,
    usage="python -m agents train [--config FILE | --resume RUN] [--ENTRY VALUE ...]",
)
def train(options: argparse.Namespace) -> int:
    """Train, then evaluate.

    Train from a config file; every entry of it can be given as an option too, and
    --env_kwargs.NAME VALUE sets a hyperparameter of the task. Ctrl-C and SIGTERM save first, and
    say how to go on.
    """
    config = _config(options)
    if options.print_config:
        print(dump_yaml(config_to_dict(config)), end="")
        return 0
    run = open_run(options.resume) if options.resume else create_run(config, options.overwrite)
    from ..training.trainer import train_in

    imports = "".join(f" --allow-import {module}" for module in options.allow_import)
    again = f"python -m agents train --resume {run.folder}{imports}"
    with closing(run):
        outcome = train_in(run, options.quiet)
        if outcome.stopped_by is not None:
            print(
                f"stopped by {signal.Signals(outcome.stopped_by).name} after "
                f"{outcome.timesteps:,} steps; all is saved. To go on:\n  {again}"
            )
            return 128 + outcome.stopped_by
        try:
            _finish(run, outcome, imports, options.quiet)
        except KeyboardInterrupt:
            print("interrupted; the training is complete and saved. To evaluate it: ", again)
            raise
    return 0


def _config(options: argparse.Namespace) -> Config:
    """The config of the run that is resumed, or what a file and options make of a new one."""
    known = {f.name for kind in ALGORITHMS.values() for f in dataclasses.fields(kind)}
    entries = {key: value for key, value in vars(options).items() if key in known}
    if not options.resume:
        recipe = _recipe(options.config, entries, options.rest)
        return load_config(recipe, entries, options.rest)
    changes = [*entries, *options.rest, *(["config"] if options.config else [])]
    if changes or options.overwrite:
        raise ConfigError(
            f"--resume goes on with the run as it was started; leave out {changes or '--overwrite'}"
        )
    return find_run(options.resume).config()


def _recipe(path: Path | None, entries: dict[str, str], rest: list[str]) -> dict[str, Any]:
    """Entries of the config file that was named, or else of the environment's own."""
    if path is not None:
        return read_yaml(path if path.exists() else shipped_config(path))
    chosen = entries.keys() & {"env_id", "algo", "env_kwargs"}
    values = {key: entry_value(key, entries[key]) for key in chosen}
    env_id = str(values.get("env_id", _DEFAULT))
    return recipe_for(env_id, values.get("algo"), frame_of(values, env_keywords(rest)))


def _finish(run: Run, outcome: Session, imports: str, quiet: bool) -> None:
    """Evaluate the best policy, and say what is where and how to go on."""
    from ..evaluation.reports import conclude, table
    from ..evaluation.showing import NAME

    figures = conclude(run, outcome.timesteps, outcome.seconds, quiet)
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


def _next(run: Run, imports: str) -> str:
    """Three commands to go on with, each with what it is for."""
    config = run.config()
    recipe = recipe_for(config.env_id, config.algo, config.frame)
    whole = recipe.get("total_timesteps", 0)
    again = f"python -m agents train --env_id {config.env_id}"
    if config.total_timesteps < whole:
        what = f"train with all {whole:,} steps of its recipe"
    else:
        what, again = "another seed: how much was luck?", f"{again} --seed {config.seed + 1}"
    commands = [
        (f"python -m agents enjoy {run.folder}{imports}", "watch an episode, step by step"),
        (f"tensorboard --logdir {run / 'tensorboard'}", "see how it learnt, in a browser"),
        (again + imports, what),
    ]
    return "\n".join(f"  {command}\n      {why}" for command, why in commands)
