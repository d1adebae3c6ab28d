"""Evaluation of a policy on unseen starts, and its report."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rigid_envs.base.files import write_atomic, write_document
from rigid_envs.scores import evaluation
from rigid_envs.scores.result import Evaluation, rates_of
from rigid_envs.scores.starts import N_STARTS, TEST_SEED
from rigid_envs.scores.trained import load
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli.words import tell
from rigid_envs.tools.pages import tables

from ..environments import make
from ..storage.runs import Run, manifest
from .plots import draw_learning_curve
from .showing import try_film

# Evaluation of a policy: one episode from each of many fixed starts, all at once.


def evaluate(
    policy: Any,
    env_id: str,
    n: int = 500,
    seed: int = TEST_SEED,
    env_kwargs: Mapping[str, Any] | None = None,
    **named: Any,
) -> Evaluation:
    """Evaluate as `rigid_envs.evaluate` does, also in native environments of other packages.

    Args:
        policy: See `rigid_envs.evaluate`; None plays at random.
        env_id: The environment.
        n: Number of starts.
        seed: Seed that the starts are spawned from.
        env_kwargs: Hyperparameters of the task.
        **named: See `rigid_envs.evaluate`: `name`, `progress`.
    """
    venv, own = make(env_id, env_kwargs or {}, n), env_id.rpartition(":")[2]
    try:
        return evaluation.evaluate(
            own if own in ENVIRONMENTS else env_id,
            "random" if policy is None else policy,
            n=n,
            seed=seed,
            env=venv,
            **named,
        )
    finally:
        venv.close()


# Report of an evaluation: the policy beside the random baseline, as table, JSON and CSV.


def report(path: Path, n: int, seed: int, quiet: bool = False) -> tuple[dict[str, Any], Evaluation]:
    """Evaluate a policy file and the random policy on the same starts.

    Args:
        path: The policy file.
        n: Number of starts.
        seed: Seed of the starts.
        quiet: Whether no progress is shown.

    Returns:
        A row of the leaderboard without its starts, and where it comes from, as JSON values; and
        the evaluation.
    """
    policy = load(path)
    document, progress = policy.document, (lambda _: None) if quiet else tell
    where = document["env_id"], n, seed, document["env_kwargs"]
    found = evaluate(policy, *where, name=document["algo"], progress=progress)
    baseline = evaluate(None, *where, progress=progress)
    progress("")
    row = {
        **{key: value for key, value in found.row().items() if key not in ("starts", "sha256")},
        "random_policy": baseline.summary(),
        **manifest(),
        "command": " ".join([Path(sys.executable).name, "-m", "agents", *sys.argv[1:]]),
        "training_seed": document["seed"],
        "training_timesteps": document["timesteps"],
        "policy_sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
    }
    return row, found


def conclude(run: Run, timesteps: int, seconds: float, quiet: bool = False) -> dict[str, Any]:
    """Evaluate the best policy of a run, and write figures, learning curve and film into it.

    Args:
        run: A complete run.
        timesteps: Its steps.
        seconds: Time spent on it.
        quiet: Whether no progress is shown.

    Returns:
        The figures of `report`, where `training_timesteps` is the age of that policy, and of all
        the training `run_timesteps` and `training_seconds`.
    """
    path = run / "best_model" / "policy.safetensors"
    figures, found = report(path, N_STARTS, TEST_SEED, quiet)
    figures["run_timesteps"] = timesteps
    figures["training_seconds"] = round(seconds, 3)
    write_report(run.folder, figures, found)
    draw_learning_curve(run)
    try_film(load(path), run.folder, TEST_SEED)
    return figures


def write_report(folder: Path, row: dict[str, Any], found: Evaluation) -> None:
    """Write `results.json`, and `episodes.csv` with one row per start.

    Args:
        folder: Folder of the files.
        row: From `report`.
        found: From `report`.
    """
    bounds = [""] * found.n if found.bounds is None else found.bounds.tolist()
    columns = zip(
        found.seeds,
        found.successes.astype(int).tolist(),
        found.values["return"].tolist(),
        found.values["length"].astype(int).tolist(),
        found.costs.tolist(),
        bounds,
        strict=True,
    )
    lines = ["seed,is_success,return,length,cost,bound", *(",".join(map(str, c)) for c in columns)]
    write_atomic(folder / "episodes.csv", "\n".join(lines) + "\n")
    write_document(folder / "results.json", found.row() | row)


def table(row: dict[str, Any]) -> str:
    """Figures of `report` as an aligned table."""
    policy, baseline = row["policy"], row["random_policy"]
    cost, unit, _ = row["cost"] or ("cost", "", 0.0)
    header = ("", "success", "95 %", "efficiency", "95 %", f"{cost} [{unit}]" if unit else cost,
              "best", "bound", "return")  # fmt: skip
    rows = [_row(row["algo"], policy), _row("random policy", baseline)]
    title = f"{row['env_id']}: {policy['episodes']} unseen starts, one episode from each"
    figures = tables.table(header, rows, "<" + ">" * (len(header) - 1), indent=0)
    note = f"{cost}, best known and bound: means over the starts that succeeded"
    return f"{title}\n\n{figures}\n\n{note}"


def _row(name: str, figures: dict[str, Any]) -> tuple[str, ...]:
    means = [figures[f"{key}_mean"] for key in ("cost", "best", "bound", "return")]
    return name, *rates_of(figures), *("-" if mean is None else f"{mean:.3f}" for mean in means)
