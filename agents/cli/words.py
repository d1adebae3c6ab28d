"""Words of the command line that several verbs share."""

from __future__ import annotations

import argparse
import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

from gymnasium.error import DependencyNotInstalled

from rigid_envs.base.checks import ConfigError

from ..sweeps.sweep import PATIENCE

if TYPE_CHECKING:
    from ..sweeps.sweep import Workers


def add_policy_options(parser: argparse.ArgumentParser, number: str | None = None) -> None:
    """Add the options that name a policy.

    Args:
        parser: Parser of the verb.
        number: "?" where the policy may be left out.
    """
    parser.add_argument("path", type=Path, metavar="RUN_OR_POLICY", nargs=number)
    parser.add_argument("--which", choices=("best", "last"), default="best", help="of a run (best)")


def add_sweep_options(parser: argparse.ArgumentParser, out: str, seeds: str) -> None:
    """Add the options of a verb that trains many.

    Args:
        parser: Parser of the verb.
        out: Default folder of the runs.
        seeds: Default seeds.
    """
    parser.add_argument(
        "--seeds", default=seeds, help="of the trainings, as 0-9 or 0,2,5 (%(default)s)"
    )
    parser.add_argument("--out", default=out, metavar="FOLDER", help="of the runs (%(default)s)")
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
        default=PATIENCE,
        help="kill a training that writes nothing for so long; it goes on from its last checkpoint "
        "(%(default)g)",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress, only the results")


def workers_of(options: argparse.Namespace) -> Workers:
    """The processes that the options of `add_sweep_options` ask for.

    Args:
        options: The options.

    Raises:
        ConfigError: --jobs or --patience that cannot be.
        DependencyNotInstalled: No Ray.
    """
    if not options.patience > 0.0:
        raise ConfigError(f"--patience = {options.patience}; expected seconds above 0")
    if options.ray is not None:
        require_ray()
        from ..sweeps.cluster import RayTasks

        return RayTasks(options.ray, options.allow_import)
    from ..sweeps.sweep import Processes

    refuse_jobs(options.jobs)
    return Processes(options.jobs, options.allow_import)


def refuse_jobs(jobs: int) -> None:
    """Refuse a number of processes that cannot be.

    Raises:
        ConfigError: It is below 1 or above 1024.
    """
    if not 1 <= jobs <= 1024:
        raise ConfigError(f"--jobs = {jobs}; expected an integer in [1, 1024]")


def require_ray() -> None:
    """Refuse to go on without Ray.

    Raises:
        DependencyNotInstalled: It is missing; says how to get it.
    """
    for name in ("ray", "optuna"):
        if importlib.util.find_spec(name) is None:
            raise DependencyNotInstalled(
                f"{name} is not installed; get it with: pip install 'rigid-envs[sweep]'"
            )


def policy_file(path: Path, which: str) -> Path:
    """The policy file of a run, a folder or a file.

    Args:
        path: Of `add_policy_options`.
        which: Of `add_policy_options`.

    Raises:
        FileNotFoundError: There is none, or none yet in the run.
    """
    if is_run(path):
        file = path / f"{which}_model" / "policy.safetensors"
        if not file.exists():
            raise FileNotFoundError(
                f"{path}: no {which} policy yet ({file} is not there); a run writes the best at "
                "each evaluation and the last with each checkpoint: go on with it, "
                f"python -m agents train --resume {path}"
            )
        return file
    file = path / "policy.safetensors" if path.is_dir() else path
    if not file.exists():
        raise FileNotFoundError(f"{file}: no policy here")
    return file


def is_run(path: Path) -> bool:
    """Whether a folder is that of a run."""
    return (path / "config.yaml").is_file()


def refuse_episodes(n: int) -> None:
    """Refuse a number of episodes that cannot be played.

    Raises:
        ConfigError: It is below 1 or above a million.
    """
    if not 1 <= n <= 1_000_000:
        raise ConfigError(f"--episodes = {n}; expected an integer in [1, 1000000]")


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


def refuse(rest: list[str]) -> None:
    """Refuse options that the verb does not have.

    Raises:
        ConfigError: There is one.
    """
    if rest:
        raise ConfigError(f"option = {rest[0]}; expected one that --help lists")
