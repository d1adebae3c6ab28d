"""Report of an evaluation: the policy beside the random baseline, as table, JSON and CSV."""

from __future__ import annotations

import hashlib
import sys
import time
from pathlib import Path
from typing import Any

from rigid_envs.files import canonical_json, write_atomic
from rigid_envs.kernels.cache import kernel_hash
from rigid_envs.provenance import commit
from rigid_envs.scores.evaluation import PolicyFactory, from_predict

from ..environments.factory import cost_unit
from ..policies.mlp import Policy
from ..policies.policy_file import load_policy
from ..storage.manifest import manifest
from .evaluate import Episodes, evaluate, evaluate_factory, summary
from .measures import measures

__all__ = ["report", "report_controller", "table", "write_report"]


def report(path: Path, n: int, seed: int) -> tuple[dict[str, Any], Episodes]:
    """Evaluate a policy file and the random policy on the same starts.

    Args:
        path: The policy file.
        n: Number of starts.
        seed: Seed of the starts.

    Returns:
        Figures and where they come from, as JSON values; and the episodes of the policy.
    """
    policy: Policy = load_policy(path)
    document = policy.document
    figures, episodes = _measured(
        from_predict(policy), document["env_id"], document["env_kwargs"], n, seed
    )
    figures |= {
        "algo": document["algo"],
        "training_seed": document["seed"],
        "training_timesteps": document["timesteps"],
        "policy_sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
    }
    return figures, episodes


def report_controller(
    name: str, policy: PolicyFactory, env_id: str, n: int, seed: int
) -> tuple[dict[str, Any], Episodes]:
    """Evaluate what needs no training, and the random policy, on the same starts.

    Args:
        name: Name of the controller.
        policy: The controller; see `rigid_envs.scores.evaluate`.
        env_id: The environment.
        n: Number of starts.
        seed: Seed of the starts.

    Returns:
        As `report`, `algo` the name.
    """
    figures, episodes = _measured(policy, env_id, {}, n, seed)
    return figures | {"algo": name}, episodes


def _measured(
    policy: PolicyFactory, env_id: str, env_kwargs: dict[str, Any], n: int, seed: int
) -> tuple[dict[str, Any], Episodes]:
    begin = time.perf_counter()
    episodes = evaluate_factory(policy, env_id, n, seed, env_kwargs)
    baseline = evaluate(None, env_id, n, seed, env_kwargs)
    figures = {
        "env_id": env_id,
        "env_kwargs": env_kwargs,
        "policy": summary(episodes),
        "random_policy": summary(baseline),
        "cost_unit": cost_unit(env_id, env_kwargs),
        "test_seed": seed,
        "kernel_hash": kernel_hash(),
        "evaluation_seconds": round(time.perf_counter() - begin, 3),
        **measures(env_id, env_kwargs, episodes, baseline),
        **manifest(),
        **commit(),
        "command": " ".join([Path(sys.executable).name, "-m", "agents", *sys.argv[1:]]),
    }
    return figures, episodes


def write_report(folder: Path, figures: dict[str, Any], episodes: Episodes) -> None:
    """Write `results.json`, and `episodes.csv` with one row per start.

    Args:
        folder: Folder of the files.
        figures: From `report`.
        episodes: From `report`.
    """
    bounds = [""] * len(episodes.seeds) if episodes.bounds is None else episodes.bounds.tolist()
    rows = zip(
        episodes.seeds,
        episodes.successes.astype(int).tolist(),
        episodes.returns.tolist(),
        episodes.lengths.tolist(),
        episodes.costs.tolist(),
        bounds,
        strict=True,
    )
    lines = [
        "seed,is_success,return,length,cost,lower_bound",
        *(",".join(map(str, r)) for r in rows),
    ]
    write_atomic(folder / "episodes.csv", "\n".join(lines) + "\n")
    write_atomic(folder / "results.json", canonical_json(figures, indent=2) + "\n")


def table(figures: dict[str, Any]) -> str:
    """Figures of `report` as an aligned table."""
    policy, baseline = figures["policy"], figures["random_policy"]
    header = ("", "success", "95 % interval", "return", "steps", "cost", "cost of successes")
    rows = [header, _row(figures["algo"], policy), _row("random policy", baseline)]
    if "lower_bound_mean" in policy:
        bound = policy["lower_bound_mean"], policy["lower_bound_mean_of_successes"]
        rows.append(("lower bound", "", "", "", "", *map(_number, bound)))
    widths = [max(len(row[k]) for row in rows) for k in range(len(header))]
    lines = [
        "  ".join([row[0].ljust(widths[0])] + [c.rjust(w) for c, w in zip(row[1:], widths[1:])])  # noqa: B905
        for row in rows
    ]
    rule = "-" * len(lines[0])
    title = f"{figures['env_id']}: {policy['episodes']} unseen starts, one episode from each"
    unit = figures["cost_unit"]
    notes = [rule] if unit is None else [rule, f"cost: {unit}"]
    notes += _scores(figures.get("scores", {}))
    return "\n".join([title, rule, lines[0], rule, *lines[1:], *notes])


def _scores(scores: dict[str, dict[str, Any]]) -> list[str]:
    """A line for each; none without scores."""
    rows = []
    for name, score in scores.items():
        low, high = (round(end, 3) + 0.0 for end in score["interval_95"])
        value = f"{round(score['score'], 3) + 0.0:6.3f}   {low:6.3f} .. {high:.3f}"
        rows.append(f"{name:9}{value}   1: {score['anchor']:.4g}, {score['kind']}: {score['why']}")
    return ["", "scores    0 is the random policy", *rows] if rows else []


def _row(name: str, figures: dict[str, Any]) -> tuple[str, ...]:
    low, high = figures["success_rate_95"]
    return (
        name,
        f"{100 * figures['success_rate']:.1f} %",
        f"{100 * low:.1f} .. {100 * high:.1f}",
        _number(figures["return_mean"]),
        f"{figures['length_mean']:.1f}",
        _number(figures["cost_mean"]),
        _number(figures["cost_mean_of_successes"]),
    )


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
