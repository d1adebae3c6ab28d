"""Words of the command line that several verbs share."""

from __future__ import annotations

import argparse
from pathlib import Path

from rigid_envs.errors import ConfigError

__all__ = [
    "add_policy_options",
    "is_run",
    "policy_file",
    "refuse",
    "refuse_episodes",
    "seeds_of",
]


def add_policy_options(parser: argparse.ArgumentParser, number: str | None = None) -> None:
    """Add the options that name a policy.

    Args:
        parser: Parser of the verb.
        number: "?" where the policy may be left out.
    """
    parser.add_argument("path", type=Path, metavar="RUN_OR_POLICY", nargs=number)
    parser.add_argument("--which", choices=("best", "last"), default="best", help="of a run (best)")


def policy_file(path: Path, which: str) -> Path:
    """The policy file of a run, a folder or a file.

    Args:
        path: Of `add_policy_options`.
        which: Of `add_policy_options`.
    """
    if is_run(path):
        path = path / f"{which}_model"
    return path / "policy.safetensors" if path.is_dir() else path


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
    """Seeds from "0-9" or "0,2,5"."""
    found: list[int] = []
    for part in text.split(","):
        low, _, high = part.partition("-")
        if not (low.strip().isdecimal() and (high or low).strip().isdecimal()):
            raise ConfigError(f"--seeds = {text!r}; expected seeds as 0-9 or 0,2,5")
        found += range(int(low), int(high or low) + 1)
    return list(dict.fromkeys(found))


def refuse(rest: list[str]) -> None:
    """Refuse options that the verb does not have.

    Raises:
        ConfigError: There is one.
    """
    if rest:
        raise ConfigError(f"option = {rest[0]}; expected one that --help lists")
