"""Metrics and scores of evaluated episodes, with bootstrap intervals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rigid_envs.scores.bootstrap import mean_interval
from rigid_envs.scores.metrics import metrics_of
from rigid_envs.scores.scales import anchors
from rigid_envs.scores.starts import VERSION
from rigid_envs.tasks import Task

from ..environments.factory import make
from .evaluate import Episodes

__all__ = ["FORMAT", "measures"]

FORMAT = "rigid-envs result 1"


def measures(
    env_id: str, env_kwargs: Mapping[str, Any], episodes: Episodes, baseline: Episodes
) -> dict[str, Any]:
    """The metrics that matter for an environment, each with its score, as JSON values.

    Scores are of the environment as it is registered, so there are none with other hyperparameters;
    then failures count for what the random policy does under these.

    Args:
        env_id: The environment.
        env_kwargs: Hyperparameters of its task.
        episodes: Of the policy.
        baseline: Of the random policy, from the same starts.

    Returns:
        `metrics`: name -> mean, its bootstrap interval and what it is, the one that ranks policies
        first (`primary`); `scores`: name -> score, its interval, and what score 1 stands for.
    """
    venv: Any = make(env_id, env_kwargs, 1)
    task = getattr(venv, "task", None)
    venv.close()
    document: dict[str, Any] = {"format": FORMAT, "evaluation_version": VERSION}
    if not isinstance(task, Task):
        return document | {"primary": None, "metrics": {}, "scores": {}}
    known = None if env_kwargs else anchors().get(env_id)
    scales = {} if known is None else known.scales
    metrics: dict[str, Any] = {}
    scores: dict[str, Any] = {}
    for metric in metrics_of(env_id):
        scale = scales.get(metric.name)
        failed = metric.values(baseline, task).mean() if scale is None else scale.failed
        values = metric.values(episodes, task, float(failed))
        ends = mean_interval(values)
        metrics[metric.name] = {
            "mean": float(values.mean()),
            "interval_95": list(ends),
            "text": metric.text,
        }
        if scale is not None:
            scores[metric.name] = {
                "score": scale(values.mean()),
                "interval_95": sorted(scale(end) for end in ends),
                "random": scale.random,
                "anchor": scale.anchor,
                "kind": scale.kind,
                "why": scale.why,
            }
    return document | {"primary": next(iter(metrics)), "metrics": metrics, "scores": scores}
