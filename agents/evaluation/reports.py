"""Report of an evaluation: the policy beside the random baseline, as table, JSON and CSV."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Any

from rigid_envs.cli.progress import tell
from rigid_envs.documents import write_document
from rigid_envs.files import write_atomic
from rigid_envs.pages import tables

from ..policies.mlp import Policy
from ..policies.policy_file import load_policy
from ..storage.manifest import manifest
from .evaluate import Evaluation, evaluate

__all__ = ["report", "report_controller", "table", "write_report"]


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
    policy: Policy = load_policy(path)
    document = policy.document
    row, found = _measured(
        policy, document["env_id"], document["env_kwargs"], n, seed, document["algo"], quiet
    )
    row |= {
        "training_seed": document["seed"],
        "training_timesteps": document["timesteps"],
        "policy_sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
    }
    return row, found


def report_controller(
    name: str, env_id: str, n: int, seed: int
) -> tuple[dict[str, Any], Evaluation]:
    """Evaluate what needs no training, and the random policy, on the same starts.

    Args:
        name: Name of the controller.
        env_id: The environment.
        n: Number of starts.
        seed: Seed of the starts.

    Returns:
        As `report`.
    """
    return _measured(name, env_id, {}, n, seed, None)


def _measured(
    policy: Any,
    env_id: str,
    env_kwargs: dict[str, Any],
    n: int,
    seed: int,
    name: str | None,
    quiet: bool = False,
) -> tuple[dict[str, Any], Evaluation]:
    progress = (lambda _: None) if quiet else tell
    found = evaluate(policy, env_id, n, seed, env_kwargs, name, progress)
    baseline = evaluate(None, env_id, n, seed, env_kwargs, progress=progress)
    progress("")
    row = {key: value for key, value in found.row().items() if key not in ("starts", "sha256")}
    command = " ".join([Path(sys.executable).name, "-m", "agents", *sys.argv[1:]])
    return row | {"random_policy": baseline.summary(), **manifest(), "command": command}, found


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
    low, high = figures["success_rate_95"]
    ends = figures["efficiency_95"]
    return (
        name,
        f"{100 * figures['success_rate']:.1f} %",
        f"{100 * low:.1f} .. {100 * high:.1f}",
        _number(figures["efficiency"]),
        "-" if ends is None else " .. ".join(map(_number, ends)),
        *(_number(figures[key]) for key in ("cost_mean", "best_mean", "bound_mean")),
        _number(figures["return_mean"]),
    )


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
