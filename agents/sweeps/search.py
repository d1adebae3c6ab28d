"""Search of hyperparameters: Optuna proposes, Ray Tune runs the trials, each in a process."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import optuna
from optuna.distributions import (
    BaseDistribution,
    CategoricalDistribution,
    FloatDistribution,
    IntDistribution,
)
from ray import tune
from ray.tune.search.optuna import OptunaSearch

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import write_atomic
from rigid_envs.sb3.adapter import NonFiniteError

from ..config.entries import config_to_dict
from ..config.reading import dump_yaml
from ..config.search import FIGURES, Range, Search
from ..environments import import_allowed
from ..storage.logs import read_evaluations
from ..storage.runs import WORST, Run, create_run, open_run, read_trial, write_trial
from ..training.recording import is_complete
from ..training.trainer import train_in

__all__ = ["Found", "search_recipe"]

_NAME = "tune"
_PLACES = ("log_dir", "run_name")


class Found(NamedTuple):
    """What a search has found.

    Attributes:
        configs: Files of those that no other beats, best first by the first figure.
        n_trials: Trials that are done.
    """

    configs: list[Path]
    n_trials: int


def search_recipe(
    search: Search, out: Path, imports: tuple[str, ...] = (), resume: bool = False
) -> Found:
    """Try values for the ranges of a recipe, or go on with what was begun before.

    Ray must be connected. Each trial trains with all seeds, one after the other, on one processor;
    one whose process or node dies goes on at its last checkpoint.

    Args:
        search: What to search.
        out: Folder, which all nodes see: `tune/` is Ray Tune's, `trials/` has the runs,
            `trials.csv` all values and figures, `best_<k>.yaml` the best compromises as configs.
        imports: Modules that register environments.
        resume: Whether a search that was begun in the folder goes on. Ray unpickles what it keeps
            there, which can run code: only the caller can know whose it is.

    Raises:
        ConfigError: Another search was begun in the folder, or this one, and `resume` is False.
    """
    out = out.absolute()
    begun = tune.Tuner.can_restore(str(out / _NAME))
    if begun and not resume:
        raise ConfigError(
            f"{out} has a search that was begun; --resume goes on with it, if the folder is your "
            "own: Ray's files in it can run code; --out names another folder"
        )
    _refuse_another(search, out)
    trial = tune.with_resources(
        tune.with_parameters(_trial, search=search, out=out, imports=imports), {"cpu": 1}
    )
    if begun:
        tuner = tune.Tuner.restore(
            str(out / _NAME), trial, resume_unfinished=True, restart_errored=True
        )
    else:
        tuner = _tuner(search, trial, out)
    tuner.fit()
    return _conclude(search, out)


def _refuse_another(search: Search, out: Path) -> None:
    """Note what is searched in a folder; another search there is refused."""
    file, text = out / "search.yaml", dump_yaml(dataclasses.asdict(search))
    if file.is_file() and file.read_text(encoding="utf-8") != text:
        raise ConfigError(f"{file} is of another search; --out names another folder")
    out.mkdir(parents=True, exist_ok=True)
    write_atomic(file, text)


def _tuner(search: Search, trial: Any, out: Path) -> tune.Tuner:
    names = list(search.objective)
    space = {path: _distribution(each) for path, each in search.ranges().items()}
    proposals = OptunaSearch(
        space,
        metric=names,
        mode=[FIGURES[name] for name in names],
        sampler=optuna.samplers.TPESampler(seed=0),
    )
    return tune.Tuner(
        trial,
        tune_config=tune.TuneConfig(search_alg=proposals, num_samples=search.trials),
        run_config=tune.RunConfig(
            name=_NAME,
            storage_path=str(out),
            failure_config=tune.FailureConfig(max_failures=3),  # a node that dies
            verbose=1,
        ),
    )


def _distribution(each: Range) -> BaseDistribution:
    """The range as Optuna has it; of choices, their numbers, for Optuna takes no lists."""
    if each.choices:
        return CategoricalDistribution(range(len(each.choices)))
    if isinstance(each.low, int) and isinstance(each.high, int):
        return IntDistribution(each.low, each.high, each.log, int(each.step or 1))
    return FloatDistribution(each.low, each.high, each.log, each.step)


def _trial(
    proposed: dict[str, Any], search: Search, out: Path, imports: tuple[str, ...]
) -> dict[str, float]:
    """Train with all seeds; the means of the last evaluations."""
    import_allowed(imports)
    values = {
        path: each.choices[proposed[path]] if each.choices else proposed[path]
        for path, each in search.ranges().items()
    }
    folder = out / "trials" / tune.get_context().get_trial_id()
    found = [_train(search, values, folder, seed) for seed in search.seeds]
    means = {name: float(np.mean([each[name] for each in found])) for name in FIGURES}
    write_trial(folder / "trial.json", values, means)
    return means


def _train(search: Search, values: Mapping[str, Any], folder: Path, seed: int) -> dict[str, float]:
    config = search.config(values, seed=seed, log_dir=str(folder), run_name=f"seed_{seed}")
    place = folder / config.algo / f"seed_{seed}"
    run = open_run(place) if (place / "config.yaml").is_file() else create_run(config)
    try:
        if run.new is not None or not is_complete(run):
            train_in(run, quiet=True)
        return _figures(run)
    except NonFiniteError:  # a recipe that diverges is no error of the search
        return WORST
    finally:
        run.close()


def _figures(run: Run) -> dict[str, float]:
    """Figures of the last evaluation."""
    held_out = read_evaluations(run / "evaluations.npz")
    last = {key: float(held_out[key][-1].mean()) for key in ("successes", "results", "costs")}
    return dict(zip(FIGURES, last.values(), strict=True))


def _conclude(search: Search, out: Path) -> Found:
    """Write the table of all trials and the configs of the best."""
    documents = [read_trial(path) for path in sorted(out.glob("trials/*/trial.json"))]
    text = io.StringIO()
    writer = csv.DictWriter(text, [*search.ranges(), *FIGURES], lineterminator="\n")
    writer.writeheader()
    writer.writerows({**each["values"], **each["figures"]} for each in documents)
    write_atomic(out / "trials.csv", text.getvalue())
    for old in out.glob("best_*.yaml"):
        old.unlink()
    paths = []
    for k, document in enumerate(_front(search, documents)):
        config = config_to_dict(search.config(document["values"], seed=search.seeds[0]))
        entries = {key: value for key, value in config.items() if key not in _PLACES}
        figures = ", ".join(f"{name} {document['figures'][name]:.5g}" for name in FIGURES)
        paths.append(out / f"best_{k}.yaml")
        note = f"# validation, seeds {search.seeds}: {figures}\n"
        write_atomic(paths[-1], note + dump_yaml(entries))
    return Found(paths, len(documents))


def _front(search: Search, documents: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The trials that no other beats in all that is searched for, best first."""

    def losses(document: dict[str, Any]) -> list[float]:
        signs = {"min": 1.0, "max": -1.0}
        figures = document["figures"]
        return [signs[FIGURES[name]] * figures[name] for name in search.objective]

    def beaten(ours: list[float], theirs: list[float]) -> bool:
        return theirs != ours and all(b <= a for a, b in zip(ours, theirs, strict=True))

    everyone = [losses(document) for document in documents]
    front = [
        document
        for document, ours in zip(documents, everyone, strict=True)
        if not any(beaten(ours, theirs) for theirs in everyone)
    ]
    return sorted(front, key=losses)
