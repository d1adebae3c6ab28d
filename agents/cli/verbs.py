"""The verbs of the command line: train, evaluate, leaderboard, enjoy, benchmark.

Importing torch and SB3 takes seconds, so it waits until it is clear that there is work to do.
"""

from __future__ import annotations

import argparse
import dataclasses
import re
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigid_envs import ENVIRONMENTS
from rigid_envs.catalogue import full_id
from rigid_envs.errors import ConfigError
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, row_seeds

from ..config.by_algorithm import ALGORITHMS, config_to_dict
from ..config.options import entry_value, env_keywords, load_config
from ..config.yaml_data import dump_yaml, parse_yaml, read_yaml
from ..storage.runs import Run, create_run, find_run, open_run

if TYPE_CHECKING:
    from ..training.trainer import Outcome

__all__ = [
    "benchmark",
    "enjoy",
    "evaluate",
    "leaderboard",
    "refuse",
    "seeds_of",
    "train",
]

_DEFAULT = "RigidEnvs/BallPark-v0"
_RESULTS = Path("logs/results")


def train(options: argparse.Namespace, rest: list[str]) -> int:
    """Train a new run, or resume one, and evaluate it."""
    known = {f.name for kind in ALGORITHMS.values() for f in dataclasses.fields(kind)}
    entries = {key: value for key, value in vars(options).items() if key in known}
    run = _resumed(options, entries, rest) if options.resume else _started(options, entries, rest)
    if run is None:
        return 0
    from ..training.trainer import train_in

    again = f"python -m agents train --resume {run.folder}"
    again += "".join(f" --allow_import {module}" for module in options.allow_import)
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
    config = load_config(_recipe(options.config, entries, rest), entries, rest)
    if options.print_config:
        print(dump_yaml(config_to_dict(config)), end="")
        return None
    return create_run(config, options.overwrite)


def _recipe(path: Path | None, entries: dict[str, str], rest: list[str]) -> dict[str, Any]:
    """Entries of the config file that was named, or else of the environment's own."""
    from ..config.recipes import frame_of, recipe_for, shipped_config

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


def _finish(run: Run, outcome: Outcome) -> int:
    from ..evaluation.reports import table
    from ..evaluation.short_film import NAME
    from ..training.conclusion import conclude

    figures = conclude(run, outcome, N_STARTS, TEST_SEED)
    film = run / NAME
    seen = f"See what it does: {film.absolute()}\n" if film.exists() else ""
    print(
        f"\n{table(figures)}\n\ntrained in {outcome.seconds:.0f} s. In {run.folder}:\n"
        "  best_model/, last_model/                policies\n"
        "  results.json, episodes.csv              the table above, and every start of it\n"
        "  learning_curve.png, evaluations.npz     how it learnt\n"
        "  progress.csv, monitor.csv, tensorboard/ logs\n"
        f"{seen}Watch it: python -m agents enjoy {run.folder}"
    )
    return 0


def evaluate(options: argparse.Namespace, rest: list[str]) -> int:
    """Evaluate a policy or controllers on unseen starts."""
    refuse(rest)
    _refuse_episodes(options.episodes)
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
        _policy_file(options.path, options.which), options.episodes, options.seed
    )
    print(table(figures))
    folder = options.out or (options.path if _is_run(options.path) else None)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        write_report(folder, figures, episodes)
        print(f"written to {folder}: results.json, episodes.csv")
    if options.save_replays:
        from rigid_envs.scores.policies import from_predict

        from ..policies.policy_file import load_policy

        policy = load_policy(_policy_file(options.path, options.which))
        config = policy.document["env_kwargs"]
        _save_replays(options, from_predict(policy), figures["env_id"], folder, "policy", config)
    return 0


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
        figures, episodes = report_controller(name, env_id, options.episodes, options.seed)
        folder = (options.out or _RESULTS) / env_id.split("/")[-1] / name
        folder.mkdir(parents=True, exist_ok=True)
        write_report(folder, figures, episodes)
        print(f"{table(figures)}\nwritten to {folder}: results.json, episodes.csv\n", flush=True)
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
    from rigid_envs.replays import record_starts

    n = min(options.save_replays, options.episodes)
    replay = record_starts(policy, env_id, n, label, options.seed, config)
    file = replay.save((folder or Path()) / "replays.npz")
    print(f"written to {file}: {n} episodes; see rigid-envs replay {file}")


def leaderboard(options: argparse.Namespace, rest: list[str]) -> int:
    """Write the leaderboard of all results below a folder."""
    refuse(rest)
    from rigid_envs.leaderboard import write_leaderboard

    text = write_leaderboard(options.folder, options.packaged)
    print(f"{text}\nwritten to {options.folder}: leaderboard.md, .png")
    return 0


def enjoy(options: argparse.Namespace, rest: list[str]) -> int:
    """Print one episode of a policy, and show it."""
    refuse(rest)
    from ..evaluation.showing import Show, refuse_early
    from ..evaluation.watching import watch
    from ..policies.policy_file import load_policy

    video, html = refuse_early(options.video, options.html, options.table, options.against)
    file = _policy_file(options.path, options.which)
    policy = load_policy(file)
    seed = row_seeds(TEST_SEED, 1, "test")[0] if options.seed is None else options.seed
    document = policy.document
    chosen = None if options.random else policy
    show = Show(chosen, document, seed, options.against)
    watch(chosen, document["env_id"], document["env_kwargs"], seed)
    if not options.table:
        folder = options.path if _is_run(options.path) else file.parent
        show(video, html, folder / "enjoy.mp4")
    return 0


def benchmark(options: argparse.Namespace, rest: list[str]) -> int:
    """Train and evaluate several environments with several seeds."""
    refuse(rest)
    _refuse_episodes(options.episodes)
    from ..config.recipes import config_for
    from ..training.benchmark import train_all
    from ..training.recording import frame_of

    entries = {"log_dir": options.out}
    if options.algo is not None:
        entries["algo"] = options.algo
    if options.steps is not None:
        entries["total_timesteps"] = parse_yaml(options.steps)
    configs = []
    for seed in seeds_of(options.seeds):
        for env_id in dict.fromkeys(map(full_id, options.ids)):
            config = config_for(env_id, {**entries, "seed": seed}, options.frame)
            name = f"{re.split('[:/]', env_id)[-1]}_{frame_of(config)}_{seed}"
            configs.append(dataclasses.replace(config, run_name=name))
    records = options.records or Path(options.out) / "records"
    status = train_all(configs, records, options.episodes, options.quiet, options.overwrite)
    if status >= 128:
        print(f"stopped by {signal.Signals(status - 128).name}; the same command goes on")
    else:
        print(f"records: {records}")
    return status


def seeds_of(text: str) -> list[int]:
    """Seeds from "0-9" or "0,2,5"."""
    found: list[int] = []
    for part in text.split(","):
        low, _, high = part.partition("-")
        if not (low.strip().isdecimal() and (high or low).strip().isdecimal()):
            raise ConfigError(f"--seeds = {text!r}; expected seeds as 0-9 or 0,2,5")
        found += range(int(low), int(high or low) + 1)
    return list(dict.fromkeys(found))


def _policy_file(path: Path, which: str) -> Path:
    if _is_run(path):
        path = path / f"{which}_model"
    return path / "policy.safetensors" if path.is_dir() else path


def _is_run(path: Path) -> bool:
    return (path / "config.yaml").is_file()


def _refuse_episodes(n: int) -> None:
    if not 1 <= n <= 1_000_000:
        raise ConfigError(f"--episodes = {n}; expected an integer in [1, 1000000]")


def refuse(rest: list[str]) -> None:
    """Refuse options that the verb does not have."""
    if rest:
        raise ConfigError(f"option = {rest[0]}; expected one that --help lists")
