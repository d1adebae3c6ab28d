"""Verbs of many trainings: benchmark, search; and of what came of them: publish, baselines."""

from __future__ import annotations

import argparse
import dataclasses
import importlib.util
import os
import re
import signal
from pathlib import Path
from typing import TYPE_CHECKING

from gymnasium.error import DependencyNotInstalled

from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.lookup import full_id
from rigid_envs.scores.starts import N_STARTS
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli.words import option, verb

from ..config.entries import ALGORITHMS
from ..config.reading import config_for, parse_yaml
from ..storage.runs import find_run
from .training import refuse_count

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
        entries["total_timesteps"] = parse_yaml(options.steps)
    records = options.records or Path(options.out) / "records"
    trainings = []
    for seed in seeds_of(options.seeds):
        for env_id in dict.fromkeys(map(full_id, options.ids)):
            config = config_for(env_id, {**entries, "seed": seed}, options.frame)
            name = f"{re.split('[:/]', env_id)[-1]}_{config.frame}_{seed}"
            config = dataclasses.replace(config, run_name=name)
            trainings.append(Training(config, records, options.episodes))
    status = train_all(
        trainings,
        _workers(options),
        options.overwrite,
        options.quiet,
        options.patience or PATIENCE,
    )
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
        _require_ray()
        from ..sweeps.cluster import RayTasks

        return RayTasks(options.ray, options.allow_import)
    from ..sweeps.sweep import Processes

    refuse_count("--jobs", options.jobs, _MOST_JOBS)
    return Processes(options.jobs, options.allow_import)


def _require_ray() -> None:
    for name in ("ray", "optuna"):
        if importlib.util.find_spec(name) is None:
            raise DependencyNotInstalled(
                f"{name} is not installed; get it with: pip install 'rigid-envs[sweep]'"
            )


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
    _require_ray()
    from ..sweeps.cluster import connect
    from ..sweeps.search import search_recipe

    connect(options.ray, options.jobs)
    out = options.out or Path("logs/search") / options.file.stem
    found = search_recipe(search, out, options.allow_import)
    for path in found.configs:
        note = path.read_text(encoding="utf-8").splitlines()[0]
        print(f"{path}  {note}")
    print(f"all trials: {out / 'trials.csv'}")
    if found.n_trials < search.trials:
        print(f"{found.n_trials} of {search.trials} trials are done; the same command goes on")
        return 1
    return 0


# The verbs `publish` and `baselines`: policies and records for others.


@verb(
    option("paths", nargs="+", type=Path, metavar="RUN"),
)
def publish(options: argparse.Namespace) -> None:
    """Put a policy into the library.

    Copy the best policy of complete runs into rigid_envs/scores/published, where rigid_envs.load
    finds it, and beside it the record of its evaluation from the 500 test starts.
    """
    from ..training.recording import publish

    for path in options.paths:
        print(f"written: {publish(find_run(path))}, and its record", flush=True)


@verb(
    option("folder", type=Path, metavar="FOLDER"),
)
def baselines(options: argparse.Namespace) -> None:
    """Page and figures of all records.

    Write FOLDER.md about all records below a folder, those of `benchmark`, and figures into the
    folder: learning curves, interquartile means, profiles, probabilities of improvement.
    """
    from ..evaluation.baselines import write_baselines

    page = write_baselines(options.folder)
    print(f"written: {page}, and figures in {options.folder}")
