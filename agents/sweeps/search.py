"""Search of hyperparameters: Optuna proposes, each trial is a task of Ray, in a process."""

import csv
import dataclasses
import io
import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import optuna
import ray
from optuna import distributions
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.study import StudyDirection
from optuna.trial import TrialState

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import named_damage, write_atomic
from rigid_envs.sb3.adapter import NonFiniteError

from ..config.entries import PLACES, Config, config_to_dict
from ..config.reading import dump_yaml
from ..config.search import FIGURES, Search
from ..environments import import_allowed
from ..storage.logs import read_evaluations
from ..storage.runs import Run, create_run, is_run, open_run
from ..training.recording import is_complete
from ..training.trainer import train_in

_WORST = {name: np.inf if way == "min" else -np.inf for name, way in FIGURES.items()}
"""Figures of a training that diverged: no error of the search."""

_RUNNING, _COMPLETE = TrialState.RUNNING, TrialState.COMPLETE
_WAYS = {"min": StudyDirection.MINIMIZE, "max": StudyDirection.MAXIMIZE}
_KEYS = ("successes", "results", "costs")  # of the figures, in `evaluations.npz`
_DEATHS = 3  # of the process or the node of a trial, after which it is given up


def search_recipe(search: Search, out: Path, imports: Sequence[str] = ()) -> tuple[list[Path], int]:
    """Try values for the ranges of a recipe, or go on with what was begun before.

    Ray must be connected. Each trial trains with all seeds, one after the other, on one processor;
    one whose process or node dies goes on at its last checkpoint.

    Args:
        search: What to search.
        out: Folder, which all nodes see: `optuna.journal` has all proposals and figures,
            `trials/` the runs, `trials.csv` all values and figures, `best_<k>.yaml` the best
            compromises as configs.
        imports: Modules that register environments.

    Returns:
        Files of the configs that no other beats, best first by the first figure; and the number of
        trials that are done.

    Raises:
        ConfigError: Another search was begun in the folder.
    """
    out = out.absolute()
    file, text = out / "search.yaml", dump_yaml(dataclasses.asdict(search))
    if file.is_file() and file.read_text(encoding="utf-8") != text:
        raise ConfigError(f"{file} is of another search; --out names another folder")
    out.mkdir(parents=True, exist_ok=True)
    write_atomic(file, text)
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    journal = out / "optuna.journal"
    with named_damage(journal):
        study = optuna.create_study(
            study_name="search",
            storage=JournalStorage(JournalFileBackend(str(journal))),
            load_if_exists=True,
            directions=[_WAYS[FIGURES[name]] for name in search.objective],
        )
        # one that goes on must not propose again what it began with
        study.sampler = optuna.samplers.TPESampler(seed=len(study.trials))
    _try_all(study, search, out, tuple(imports))
    return _conclude(study, search, out)


def _try_all(study: optuna.Study, search: Search, out: Path, imports: tuple[str, ...]) -> None:
    """Go on with the trials that were begun, and try new values, as many as processors take."""
    space = {path: _distribution(each) for path, each in search.ranges().items()}
    begun = [(trial.number, trial.params) for trial in study.get_trials(states=(_RUNNING,))
             if trial.params.keys() == space.keys()]  # fmt: skip
    left = search.trials - len(begun) - len(study.get_trials(states=(_COMPLETE,)))
    task = ray.remote(num_cpus=1, max_retries=_DEATHS, max_calls=1)(_trial)
    running: dict[Any, int] = {}
    processors: Any = ray.cluster_resources
    while begun or left > 0 or running:
        while (begun or left > 0) and len(running) < processors()["CPU"]:
            if not begun:
                trial, left = study.ask(space), left - 1
                begun = [(trial.number, trial.params)]
            number, params = begun.pop()
            runs = _runs(search, params, out, number)
            running[task.remote(os.getcwd(), runs, imports)] = number
        ready, _ = ray.wait(list(running))
        number = running.pop(ready[0])
        try:
            figures = ray.get(ready[0])
        except ray.exceptions.RayError as error:  # the same search, begun again, goes on with it
            print(f"agents: trial {number}: {error}", file=sys.stderr, flush=True)
        else:
            study.tell(number, [figures[name] for name in search.objective])


def _distribution(given: Mapping[str, Any]) -> distributions.BaseDistribution:
    """The range as Optuna has it; of choices, their numbers, for Optuna takes no lists."""
    if "choices" in given:
        return distributions.CategoricalDistribution(range(len(given["choices"])))
    low, high, log, step = given["low"], given["high"], given.get("log", False), given.get("step")
    if isinstance(low, int) and isinstance(high, int):
        return distributions.IntDistribution(low, high, log, int(step or 1))
    return distributions.FloatDistribution(low, high, log, step)


def _values(search: Search, params: Mapping[str, Any]) -> dict[str, Any]:
    """What Optuna proposed, by the path of the entry."""
    choices = {path: each.get("choices", []) for path, each in search.ranges().items()}
    return {path: choices[path][each] if choices[path] else each for path, each in params.items()}


def _runs(search: Search, params: Mapping[str, Any], out: Path, number: int) -> list[Config]:
    """Configs of the trainings of a trial, one for each seed."""
    values, folder = _values(search, params), str(out / "trials" / str(number))
    return [search.config(values, seed=seed, log_dir=folder, run_name=f"seed_{seed}")
            for seed in search.seeds]  # fmt: skip


def _trial(folder: str, configs: list[Config], imports: tuple[str, ...]) -> dict[str, float]:
    """Train with all seeds; the means of the last evaluations."""
    os.chdir(folder)
    import_allowed(imports)
    for config in configs:
        run = open_run(config.folder) if is_run(config.folder) else create_run(config)
        with closing(run):
            try:
                if not is_complete(run):
                    train_in(run, quiet=True)
            except NonFiniteError:  # a recipe that diverges is no error of the search
                break
    return _figures(configs)


def _figures(configs: list[Config]) -> dict[str, float]:
    """Means over the last evaluations of some runs; the worst there are if one diverged."""
    runs = [Run(each.folder) for each in configs]
    if not all(is_complete(run) for run in runs):
        return _WORST
    held_out = [read_evaluations(run / "evaluations.npz") for run in runs]
    means = [np.mean([each[key][-1].mean() for each in held_out]) for key in _KEYS]
    return dict(zip(FIGURES, map(float, means), strict=True))


def _conclude(study: optuna.Study, search: Search, out: Path) -> tuple[list[Path], int]:
    """Write the table of all trials and the configs of the best."""
    done = study.get_trials(states=(_COMPLETE,))
    figures = {each.number: _figures(_runs(search, each.params, out, each.number)) for each in done}
    table = io.StringIO()
    writer = csv.DictWriter(table, [*search.ranges(), *FIGURES], lineterminator="\n")
    writer.writeheader()
    writer.writerows({**_values(search, each.params), **figures[each.number]} for each in done)
    write_atomic(out / "trials.csv", table.getvalue())
    for old in out.glob("best_*.yaml"):
        old.unlink()
    signs = [1.0 if FIGURES[name] == "min" else -1.0 for name in search.objective]
    best = sorted(study.best_trials, key=lambda each: list(np.multiply(signs, each.values)))
    paths = [out / f"best_{k}.yaml" for k in range(len(best))]
    for path, each in zip(paths, best, strict=True):
        config = search.config(_values(search, each.params), seed=search.seeds[0])
        told = ", ".join(f"{name} {value:.5g}" for name, value in figures[each.number].items())
        text = dump_yaml(config_to_dict(config, PLACES))
        write_atomic(path, f"# validation, seeds {search.seeds}: {told}\n{text}")
    return paths, len(done)
