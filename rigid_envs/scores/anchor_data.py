"""Anchors of scores: computation, and their form as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from rigid_envs.scores.controllers import reference_controllers
from rigid_envs.scores.evaluation import (
    constant_zero,
    evaluate,
    from_controller,
    make_rows,
    uniform,
)
from rigid_envs.scores.metrics import METRICS, Metric, metrics_of
from rigid_envs.scores.scales import Anchors, ScoreScale
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, VERSION, evaluation_seeds
from rigid_envs.scores.theory import limit_of

__all__ = ["FORMAT", "compute_anchors", "document"]

FORMAT = "rigid-envs anchors 2"


def compute_anchors(env_id: str, n: int = N_STARTS) -> Anchors:
    """The anchors of an id, computed anew; without a controller, those that theory gives.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
    """
    random = evaluate(env_id, uniform(), n)
    plain = random.means()
    policies = {
        **{name: from_controller(make) for name, make in reference_controllers(env_id).items()},
        "zero": constant_zero,
    }
    means = {name: evaluate(env_id, policy, n).means(plain) for name, policy in policies.items()}
    means["random"] = random.means(plain)
    scales = {}
    for metric in metrics_of(env_id):
        found = _anchor(env_id, metric, means, n)
        if found is None:
            continue
        anchor, kind, why = found
        zero = means["random"][metric.name]
        if anchor > zero if metric.higher_is_better else anchor < zero:
            failed = plain[metric.name]
            scales[metric.name] = ScoreScale(metric.name, zero, anchor, kind, why, failed)
    return Anchors(scales, means, n)


def _anchor(
    env_id: str, metric: Metric, means: Mapping[str, Mapping[str, float]], n: int
) -> tuple[float, str, str] | None:
    """Anchor, kind and reason: the theoretical limit, else the best reference controller."""
    best = next(iter(reference_controllers(env_id)), None)
    limit = limit_of(env_id, metric.name)
    if limit is not None and limit.values is not None:
        envs = make_rows(env_id, n)
        envs.reset(seed=evaluation_seeds(n))
        value = float(limit.values(envs).mean())
        envs.close()
    elif best is not None:
        value = means[best][metric.name]
    else:
        return None
    return (value, "reference", str(best)) if limit is None else (value, limit.kind, limit.text)


def document(
    ids: Mapping[str, Anchors], provenance: Mapping[str, Any], n: int = N_STARTS
) -> dict[str, Any]:
    """The data, as JSON values.

    Args:
        ids: Anchors by id.
        provenance: Versions, commit and date of the computation.
        n: Number of starts.
    """
    return {
        "format": FORMAT,
        "evaluation_set": {"version": VERSION, "seed": TEST_SEED, "starts": n},
        "metrics": {name: metric.text for name, metric in METRICS.items()},
        "provenance": dict(provenance),
        "ids": {
            env_id: {
                **{key: provenance[key] for key in ("kernel_hash", "git_commit", "date")},
                "scales": [asdict(scale) for scale in found.scales.values()],
                "means": found.means,
            }
            for env_id, found in ids.items()
        },
    }
