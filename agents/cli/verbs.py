"""Verbs that train: one run, several, searches and benchmarks."""

from __future__ import annotations

import argparse
import dataclasses
import importlib.util
import json
import os
import re
import signal
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from gymnasium.error import DependencyNotInstalled

from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.lookup import full_id
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, row_seeds
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli.words import imports_of, option, verb

from ..config import reading
from ..config.entries import ALGORITHMS, Config, config_to_dict
from ..storage.runs import Run, create_run, find_run, is_run, open_run

if TYPE_CHECKING:
    from ..training.trainer import Session

# Verbs of one run or policy: train, evaluate, enjoy.
#
# Importing torch and SB3 takes seconds, so it waits until it is clear that there is work to do.

_DEFAULT = "RigidEnvs/BallPark-v0"


@verb(
    option("--config", type=Path, metavar="FILE", help="(that of the environment)"),
    option("--resume", type=Path, metavar="RUN", help="go on with a run, to the bit"),
    option("--overwrite", action="store_true", help="delete a run of the same name"),
    option("--print-config", action="store_true", help="print the config and stop"),
    option("--quiet", action="store_true", help="no progress, only the result"),
    option(
        "--logger", choices=("wandb", "mlflow"), help="log to it too, beside TensorBoard's events"
    ),
    reading.add_config_options,
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
        print(reading.dump_yaml(config_to_dict(config)), end="")
        return 0
    if options.logger:
        _require(options.logger, options.logger)
    run = open_run(options.resume) if options.resume else create_run(config, options.overwrite)
    from ..training.trainer import train_in

    imports = imports_of(options)
    again = f"python -m agents train --resume {run.folder}{imports}"
    with closing(run):
        outcome = train_in(run, options.quiet, options.logger)
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
    if options.config and not options.resume:
        recipe = reading.read_yaml(reading.config_file(options.config))
        return reading.load_config(recipe, entries, options.rest)
    if not options.resume:  # the recipe of the environment
        chosen = entries.keys() & {"env_id", "algo", "env_kwargs"}
        values = {key: reading.entry_value(key, entries[key]) for key in chosen}
        frame = reading.frame_of(values, reading.env_keywords(options.rest))
        env_id = str(values.get("env_id", _DEFAULT))
        recipe = reading.recipe_for(env_id, values.get("algo"), frame)
        return reading.load_config(recipe, entries, options.rest)
    changes = [*entries, *options.rest, *(["config"] if options.config else [])]
    if changes or options.overwrite:
        raise ConfigError(
            f"--resume goes on with the run as it was started; leave out {changes or '--overwrite'}"
        )
    return find_run(options.resume).config()


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
    recipe = reading.recipe_for(config.env_id, config.algo, config.frame)
    whole = recipe.get("total_timesteps", 0)
    if config.total_timesteps < whole:
        what, change = f"train with all {whole:,} steps of its recipe", f"--total_timesteps {whole}"
    else:
        what, change = "another seed: how much was luck?", f"--seed {config.seed + 1}"
    name = f" --run_name {config.run_name}_next" if config.run_name else ""
    again = f"python -m agents train --config {run / 'config.yaml'} {change}{name}"
    commands = [
        (f"python -m agents enjoy {run.folder}{imports}", "watch an episode, step by step"),
        (f"tensorboard --logdir {run / 'tensorboard'}", "see how it learnt, in a browser"),
        (again + imports, what),
    ]
    return "\n".join(f"  {command}\n      {why}" for command, why in commands)


# The verb `evaluate`, and which policy it is of.

_POLICY = (
    option("path", type=Path, metavar="RUN_OR_POLICY"),
    option("--which", choices=("best", "last"), default="best", help="of a run (best)"),
)

# Success and efficiency of a policy. Controllers have `rigid-envs evaluate`.


@verb(
    *_POLICY,
    option("--episodes", type=int, default=N_STARTS, metavar="N", help="(500)"),
    option("--seed", type=int, default=TEST_SEED, help=f"of the starts ({TEST_SEED})"),
    option(
        "--save-replays",
        type=int,
        nargs="?",
        const=10,
        default=0,
        metavar="N",
        help="record the first N episodes (10) in replays.npz, for `rigid-envs replay`",
    ),
    option(
        "--out",
        type=Path,
        metavar="FOLDER",
        help="for results.json, episodes.csv (of a run: evaluated/WHICH-EPISODES-SEED in it)",
    ),
    option("--json", action="store_true", help="print JSON instead of the table"),
)
def evaluate(options: argparse.Namespace) -> None:
    """Success and efficiency on unseen starts.

    Play one episode of a policy from each of the fixed starts.
    """
    refuse_count("--episodes", options.episodes)
    if options.save_replays:
        refuse_count("--save-replays", options.save_replays)
    file = _policy_file(options.path, options.which)
    folder = options.out
    if folder is None and is_run(options.path):  # aside from what its training wrote
        name = f"{options.which}-{options.episodes}-{options.seed}"
        folder = options.path / "evaluated" / name
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)  # before anything is played for nothing
    from ..evaluation.reports import report, table, write_report

    figures, found = report(file, options.episodes, options.seed)
    print(json.dumps(figures, indent=1) if options.json else table(figures))
    said = sys.stderr if options.json else sys.stdout
    if folder is not None:
        write_report(folder, figures, found)
        print(f"written to {folder}: results.json, episodes.csv", file=said)
    if options.save_replays:
        n = min(options.save_replays, options.episodes)
        replays = _save_replays(file, (folder or Path()) / "replays.npz", n, options.seed)
        see = f"rigid-envs replay {replays}{imports_of(options)}"
        print(f"written to {replays}: {n} episodes; see {see}", file=said)


def refuse_count(option: str, n: int, most: int = 1_000_000) -> None:
    """Refuse a number of what is counted, as episodes.

    Raises:
        ConfigError: It is below 1 or above `most`.
    """
    if not 1 <= n <= most:
        raise ConfigError(f"{option} = {n}; expected an integer in [1, {most}]")


def _save_replays(file: Path, path: Path, n: int, seed: int) -> Path:
    """Play the first starts once more, and record them."""
    from rigid_envs import load
    from rigid_envs.scores.policies import from_predict
    from rigid_envs.watch.replays.recording import record_starts

    policy = load(file)
    if policy.env_id not in ENVIRONMENTS:
        name = f"--save-replays: env_id = {policy.env_id!r}"
        raise ConfigError(f"{name}; expected an environment of rigid_envs")
    config = policy.document["env_kwargs"]
    return record_starts(from_predict(policy), policy.env_id, n, "policy", seed, config).save(path)


# The verb `enjoy`: one episode, as a table and to look at.


@verb(
    *_POLICY,
    option("--seed", type=int, help="of the start (the first of the evaluation)"),
    option("--random", action="store_true", help="act at random instead"),
    option(
        "--against",
        metavar="CONTROLLER",
        help="show a controller beside it, from the same start: one by its name, `reference` for "
        "the best one, `nmpc` where there is one, `sampling`, `zero` or `random`",
    ),
    option("--video", metavar="FILE", help="write a film: FILE.mp4, .gif or .webp"),
    option("--html", metavar="FILE", help="write a page for a browser"),
    option("--table", action="store_true", help="print every step, and show nothing"),
)
def enjoy(options: argparse.Namespace) -> None:
    """Watch one episode, in a window or as a film.

    Show one episode: in a window where there is a display (Space pauses, R plays it again, Esc
    closes), and else in a film, enjoy.mp4 in the folder of the policy. --video and --html write
    files instead; --table prints it step by step.
    """
    from rigid_envs import load

    from ..evaluation.showing import players_of, refuse_early, show, watch

    video, html = refuse_early(options.video, options.html, options.table, options.against)
    file = _policy_file(options.path, options.which)
    policy = load(file)
    seed = row_seeds(TEST_SEED, 1, "test")[0] if options.seed is None else options.seed
    players = players_of(policy, seed, options.random, options.against)
    watch(players[0][0], policy.document, seed, options.table)
    if not options.table:
        folder = options.path if is_run(options.path) else file.parent
        show(policy.env_id, seed, players, video, html, folder / "enjoy.mp4")


# Which policy: of a run, a folder or a file.


def _policy_file(path: Path, which: str) -> Path:
    """The file that the options name.

    Raises:
        FileNotFoundError: There is none, or none yet in the run.
    """
    if not is_run(path):
        file = path / "policy.safetensors" if path.is_dir() else path
        why = f"no policy here ({file} is not there); expected a run, or the folder or file of one"
    else:
        file = path / f"{which}_model" / "policy.safetensors"
        why = (
            f"no {which} policy yet ({file} is not there); a run writes the best at each "
            "evaluation and the last with each checkpoint: go on with it, "
            f"python -m agents train --resume {path}"
        )
    if not file.exists():
        raise FileNotFoundError(f"{path}: {why}")
    return file


# Verbs of many trainings: benchmark, search; and of what came of them: publish, baselines.

if TYPE_CHECKING:
    from ..sweeps.cluster import RayTasks
    from ..sweeps.sweep import Processes

_MOST_JOBS = 1024

# The verb `benchmark`: all environments, with several seeds.


def _add_place(parser: argparse.ArgumentParser) -> None:
    """Where the trainings are, and on what they run."""
    parser.add_argument(
        "--out", default="logs/benchmark", metavar="FOLDER", help="of the runs (%(default)s)"
    )
    parser.add_argument("--records", type=Path, metavar="FOLDER", help="(OUT/records)")
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--jobs", type=int, default=1, metavar="N", help="train so many at the same time (1)"
    )
    where.add_argument(
        "--ray",
        metavar="ADDRESS",
        help="train on a Ray cluster, as many at the same time as it has processors: host:6379, "
        "auto, or local",
    )
    parser.add_argument(
        "--patience",
        type=float,
        metavar="SECONDS",
        help="kill a training that writes nothing for so long; it goes on from its last checkpoint "
        "(3600)",
    )


@verb(
    option("--ids", "--env_id", nargs="+", metavar="ID", default=list(ENVIRONMENTS), help="(all)"),
    option("--algo", choices=tuple(ALGORITHMS), help="(the one that suits each)"),
    option("--frame", choices=("world", "reduced"), help="(as the config says)"),
    option("--steps", metavar="N", help="of each training (as its config says)"),
    option("--episodes", type=int, default=N_STARTS, metavar="N", help="(500)"),
    option(
        "--overwrite", action="store_true", help="begin anew what was trained with another config"
    ),
    option("--seeds", default="0", help="of the trainings, as 0-9 or 0,2,5 (0)"),
    option("--quiet", action="store_true", help="no progress, only the results"),
    _add_place,
)
def benchmark(options: argparse.Namespace) -> int:
    """Train all environments, with several seeds.

    Train every environment with its config (configs/NAME_reduced_ALGO.yaml, else
    configs/NAME_ALGO.yaml, else the defaults of the algorithm that suits it), with several seeds,
    and write a record of each: config, learning curve, times, and success and cost from each test
    start. Each training is a process of its own, which can die without harm: it begins again at
    its last checkpoint. What has a record is left out: the same command goes on where it was
    stopped, and several may share the work.
    """
    refuse_count("--episodes", options.episodes)
    from ..sweeps.sweep import PATIENCE, Training, train_all

    entries = {"log_dir": options.out}
    if options.algo is not None:
        entries["algo"] = options.algo
    if options.steps is not None:
        entries["total_timesteps"] = reading.parse_yaml(options.steps)
    records = options.records or Path(options.out) / "records"
    trainings = []
    for seed in seeds_of(options.seeds):
        for env_id in dict.fromkeys(map(full_id, options.ids)):
            config = reading.config_for(env_id, {**entries, "seed": seed}, options.frame)
            name = f"{re.split('[:/]', env_id)[-1]}_{config.frame}_{seed}"
            config = dataclasses.replace(config, run_name=name)
            trainings.append(Training(config, records, options.episodes))
    patience = options.patience or PATIENCE
    status = train_all(trainings, _workers(options), options.overwrite, options.quiet, patience)
    if status >= 128:
        print(f"stopped by {signal.Signals(status - 128).name}; the same command goes on")
    else:
        print(f"records: {records}")
    return status


def seeds_of(text: str) -> list[int]:
    """Seeds from "0-9" or "0,2,5", each once.

    Raises:
        ConfigError: It is neither, or a range has none in it.
    """
    found: list[int] = []
    for part in text.split(","):
        ends = part.split("-")
        numbers = [int(end) for end in ends if end.strip().isdecimal()]
        if len(numbers) != len(ends) or len(ends) > 2 or numbers[0] > numbers[-1]:
            raise ConfigError(f"--seeds = {text!r}; expected seeds as 0-9 or 0,2,5")
        found += range(numbers[0], numbers[-1] + 1)
    return list(dict.fromkeys(found))


def _workers(options: argparse.Namespace) -> Processes | RayTasks:
    """The processes that the options ask for."""
    if not (options.patience is None or options.patience > 0.0):
        raise ConfigError(f"--patience = {options.patience}; expected seconds above 0")
    if options.ray is not None:
        _require("rigid-envs[sweep]", "ray", "optuna")
        from ..sweeps.cluster import RayTasks

        return RayTasks(options.ray, options.allow_import)
    from ..sweeps.sweep import Processes

    refuse_count("--jobs", options.jobs, _MOST_JOBS)
    return Processes(options.jobs, options.allow_import)


def _require(package: str, *names: str) -> None:
    """Refuse what needs modules that are not installed, and come with a package."""
    for name in names:
        if importlib.util.find_spec(name) is None:
            mend = f"get it with: pip install '{package}'"
            raise DependencyNotInstalled(f"{name} is not installed; {mend}")


# The verb `search`: hyperparameters, by Optuna on Ray.


@verb(
    option("file", type=Path, metavar="FILE", help="such as configs/searches/*.yaml"),
    option("--out", type=Path, metavar="FOLDER", help="(logs/search/NAME)"),
    option("--ray", metavar="ADDRESS", default="local", help="of a cluster (%(default)s)"),
    option(
        "--jobs",
        type=int,
        metavar="N",
        default=os.cpu_count() or 1,
        help="trials at the same time, without a cluster (%(default)s)",
    ),
)
def search(options: argparse.Namespace) -> int:
    """Search hyperparameters.

    Search hyperparameters, as a YAML file says: a recipe in which any value may be a range. Optuna
    proposes, Ray trains, and what counts are evaluations on validation starts. Writes a table of
    all trials and the best as configs for `train --config`. The same command goes on where it was
    stopped.
    """
    refuse_count("--jobs", options.jobs, _MOST_JOBS)
    from ..config.search import read_search

    search = read_search(options.file)
    _require("rigid-envs[sweep]", "ray", "optuna")
    from ..sweeps.cluster import connect
    from ..sweeps.search import search_recipe

    connect(options.ray, options.jobs)
    out = options.out or Path("logs/search") / options.file.stem
    configs, n_trials = search_recipe(search, out, options.allow_import)
    for path in configs:
        note = path.read_text(encoding="utf-8").splitlines()[0]
        print(f"{path}  {note}")
    print(f"all trials: {out / 'trials.csv'}")
    if n_trials < search.trials:
        print(f"{n_trials} of {search.trials} trials are done; the same command goes on")
        return 1
    return 0


# The verbs `publish` and `baselines`: policies and records for others.


@verb(option("paths", nargs="+", type=Path, metavar="RUN"))
def publish(options: argparse.Namespace) -> None:
    """Put a policy into the library.

    Copy the best policy of complete runs into rigid_envs/scores/published, where rigid_envs.load
    finds it, and beside it the record of its evaluation from the 500 test starts.
    """
    from ..training.recording import publish

    for path in options.paths:
        print(f"written: {publish(find_run(path))}, and its record", flush=True)


@verb(option("folder", type=Path, metavar="FOLDER"))
def baselines(options: argparse.Namespace) -> None:
    """Page and figures of all records.

    Write FOLDER.md about all records below a folder, those of `benchmark`, and figures into the
    folder: learning curves, interquartile means, profiles, probabilities of improvement.
    """
    from ..evaluation.baselines import write_baselines

    page = write_baselines(options.folder)
    print(f"written: {page}, and figures in {options.folder}")


@verb(
    option("runs", nargs="+", type=Path, metavar="RUN"),
    option("--out", type=Path, default="curves.png", metavar="FILE", help="(%(default)s)"),
)
def curves(options: argparse.Namespace) -> None:
    """Learning curves of several runs in one figure.

    Draw the rates of success on held-out starts against steps (.pdf, .svg, .png). Runs that differ
    in their seed alone are one curve, the mean of all with its bootstrap interval.
    """
    from ..evaluation.reports import draw_runs

    print(f"written: {draw_runs([find_run(path) for path in options.runs], options.out)}")
