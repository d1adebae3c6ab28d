"""Scores: a figure on a scale on which the random policy has 0 and the anchor 1.

The anchors are data, computed over the evaluation set by `rigid-envs anchors`, with their
provenance.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["ANCHORS", "Anchors", "ScoreScale", "anchors", "score_scale"]

ANCHORS = Path(__file__).with_name("anchors.json")
"""The data."""


@dataclass(frozen=True)
class ScoreScale:
    """Linear scale of one metric of an id, from figures to scores.

    Attributes:
        metric: Name of the metric.
        random: Figure of the random policy: score 0.
        anchor: Figure of score 1.
        kind: "exact" (the optimum), "bound" (nothing is better, and it may be out of reach) or
            "reference" (a controller, which can be beaten: then the score is above 1).
        why: The theory, or the name of the controller.
        failed: Figure that episodes that failed count for, where the metric replaces theirs.
    """

    metric: str
    random: float
    anchor: float
    kind: str
    why: str
    failed: float

    def __call__(self, figure: npt.ArrayLike) -> Any:
        """Score (figure - random) / (anchor - random), of figures of any shape."""
        score = (np.asarray(figure) - self.random) / (self.anchor - self.random)
        return score if score.ndim else float(score)


@dataclass(frozen=True)
class Anchors:
    """The data of one id.

    Attributes:
        scales: Scales by metric, the metric that ranks policies first.
        means: Mean of every metric over the evaluation set, by the name of an untrained policy and
            the metric; episodes that failed count for what the metric says.
        n_starts: Number of starts.
    """

    scales: Mapping[str, ScoreScale]
    means: Mapping[str, Mapping[str, float]]
    n_starts: int


@cache
def anchors() -> Mapping[str, Anchors]:
    """The data of every id that has anchors."""
    if not ANCHORS.exists():
        return {}
    data = json.loads(ANCHORS.read_text(encoding="utf-8"))
    return {
        env_id: Anchors(
            {scale["metric"]: ScoreScale(**scale) for scale in entry["scales"]},
            entry["means"],
            data["evaluation_set"]["starts"],
        )
        for env_id, entry in data["ids"].items()
    }


def score_scale(env_id: str, metric: str | None = None) -> ScoreScale:
    """The scale of a metric of an id: call it with a figure.

    Args:
        env_id: Gymnasium's id.
        metric: Name of the metric; None takes the one that ranks policies.

    Raises:
        ValueError: no anchors for the id, or none for the metric; names those that there are.
    """
    if env_id not in anchors():
        raise ValueError(f"env_id = {env_id!r}; expected an id with anchors: {sorted(anchors())}")
    scales = anchors()[env_id].scales
    name = next(iter(scales)) if metric is None else metric
    if name not in scales:
        raise ValueError(f"{env_id}: metric = {name!r}; expected one of {list(scales)}")
    return scales[name]
