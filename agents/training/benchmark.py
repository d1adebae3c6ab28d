"""Training and evaluation of several environments, in one table with the random baseline."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rigid_envs.errors import ConfigError
from rigid_envs.files import canonical_json, write_atomic
from rigid_envs.scores.starts import TEST_SEED

from ..config.by_algorithm import Config, config_to_dict
from ..environments.finite import NonFiniteError
from ..storage.manifest import differences
from ..storage.runs import Run, create_run, find_run, open_run
from .conclusion import conclude
from .trainer import train_in

__all__ = ["markdown", "train_all"]

_FORMAT = "rigid-envs benchmark 1"
_HEADER = ("environment", "algorithm", "random: success", "return", "trained: success", "return",
           "steps", "minutes")  # fmt: skip


def train_all(configs: Sequence[Config], folder: Path, n: int, quiet: bool = False) -> int:
    """Train each config, or resume its run, and write the table after each.

    Args:
        configs: Each with a `run_name` of its own.
        folder: Where `benchmark.md` and `benchmark.json` go.
        n: Number of unseen starts, the same for the policy and the random baseline.
        quiet: No progress bar.

    Returns:
        0; 1 if a training failed, which leaves out its row; 128 + k if signal k ended it early.

    Raises:
        ConfigError: A run of the name is there and was started with another config.
        RunInUseError: Another process works in it.
    """
    rows: list[dict[str, Any]] = []
    for config in configs:
        run = _run(config)
        try:
            outcome = train_in(run, quiet)
            if outcome.stopped_by is not None:
                return 128 + outcome.stopped_by
            rows.append(conclude(run, outcome, n, TEST_SEED))
        except NonFiniteError as error:
            print(f"error: {config.env_id}: {error}", file=sys.stderr)
            continue
        finally:
            run.close()
        folder.mkdir(parents=True, exist_ok=True)
        document = canonical_json({"format": _FORMAT, "rows": rows}, indent=2)
        write_atomic(folder / "benchmark.json", document + "\n")
        write_atomic(folder / "benchmark.md", markdown(rows))
    return 0 if len(rows) == len(configs) else 1


def markdown(rows: Sequence[dict[str, Any]]) -> str:
    """The table, and under it where its numbers come from.

    Args:
        rows: Figures from `conclude`.
    """
    lines = [_HEADER, ("---", "---", *["---:"] * (len(_HEADER) - 2)), *map(_cells, rows)]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    notes = "\n".join(dict.fromkeys(_note(row) for row in rows))
    return f"{table}\n\n{notes}\n"


def _run(config: Config) -> Run:
    """The run of a config, new or as it was left."""
    folder = Path(config.log_dir) / config.algo / str(config.run_name)
    if not (folder / "config.yaml").is_file():
        return create_run(config)
    changed = differences(config_to_dict(find_run(folder).config()), config_to_dict(config))
    if changed:
        raise ConfigError(
            f"{folder} was started with another config ({'; '.join(changed)}); "
            "--out gives the benchmark another folder"
        )
    return open_run(folder)


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    pairs = [
        cell
        for each in (row["random_policy"], row["policy"])
        for cell in (f"{100 * each['success_rate']:.1f} %", f"{each['return_mean']:.2f}")
    ]
    name, minutes = row["env_id"].split("/")[-1], row["training_seconds"] / 60
    steps = f"{row['run_timesteps']:,}"
    return (f"`{name}`", row["algo"].upper(), *pairs, steps, f"{minutes:.1f}")


def _note(row: dict[str, Any]) -> str:
    versions = ", ".join(
        f"{name} {row['versions'][name]}" for name in ("rigid-envs", "stable-baselines3", "torch")
    )
    commit = "no commit" if row["git_commit"] is None else f"commit {row['git_commit'][:12]}"
    return (
        f"{row['policy']['episodes']} unseen starts, the same for both (seed {row['test_seed']}); "
        f"return: mean sum of rewards; training seed {row['training_seed']}; {versions}; "
        f"{row['machine']} {row['cpu_capability']}, {row['torch_threads']} torch thread; "
        f"{commit}{' with changes' if row['git_dirty'] else ''}."
    )
