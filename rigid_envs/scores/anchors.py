"""From a figure to a score: 0 is the random policy, 1 what theory or a reference controller says.

The anchors are data, computed over the evaluation set by `rigid-envs anchors`, and say of
themselves where they come from.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.scores.evaluation import at_random, controller, evaluate, make_rows
from rigid_envs.scores.metrics import METRICS, metrics_of
from rigid_envs.scores.references import REFERENCES
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, VERSION, evaluation_seeds
from rigid_envs.scores.theory import theory_of

__all__ = ["ANCHORS", "FORMAT", "Scale", "anchors", "compute", "document", "score"]

FORMAT = "rigid-envs anchors 1"
ANCHORS = Path(__file__).with_name("anchors.json")
"""The data."""


@dataclass(frozen=True)
class Scale:
    """What figures of one metric of an id are worth.

    Attributes:
        metric: Its name.
        random: Figure of the random policy: score 0.
        anchor: Figure of score 1.
        kind: "exact" (the best that there is), "bound" (nothing is better, and it may be out of
            reach) or "reference" (a controller, which can be beaten: then the score is above 1).
        why: The theory, or the name of the controller.
        failed: What episodes that failed count for, where the metric says so.
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


def score(env_id: str, metric: str | None = None) -> Scale:
    """The scale of a metric of an id: call it with a figure.

    Args:
        env_id: The id.
        metric: Name of the metric; None takes the one that ranks policies.

    Raises:
        ValueError: no anchors for the id, or none for the metric; names those that there are.
    """
    scales = anchors().get(env_id)
    if scales is None:
        raise ValueError(f"{env_id}: no anchors; expected one of {sorted(anchors())}")
    name = next(iter(scales)) if metric is None else metric
    if name not in scales:
        raise ValueError(f"{env_id}: no anchors of {name!r}; expected one of {list(scales)}")
    return scales[name]


@cache
def anchors() -> Mapping[str, Mapping[str, Scale]]:
    """All scales by id and metric, the metric that ranks policies first."""
    if not ANCHORS.exists():
        return {}
    data = json.loads(ANCHORS.read_text())
    return {
        env_id: {scale["metric"]: Scale(**scale) for scale in entry["scales"]}
        for env_id, entry in data["ids"].items()
    }


def compute(env_id: str, n: int = N_STARTS) -> list[Scale]:
    """The scales of an id, measured anew; an id without a reference has those that theory gives.

    Args:
        env_id: The id.
        n: Number of starts.
    """
    chance = evaluate(env_id, at_random(), n)
    plain = {name: float(values.mean()) for name, values in chance.values().items()}
    random = chance.values(plain)
    builders = REFERENCES.get(env_id, {})
    best = next(iter(builders), None)
    reference = None if best is None else evaluate(env_id, controller(builders[best]), n)
    measured = {} if reference is None else reference.values(plain)
    envs = make_rows(env_id, n)
    envs.reset(seed=evaluation_seeds(n))
    scales = []
    for metric in metrics_of(chance.task):
        known = theory_of(type(chance.task).__name__, metric.name)
        if known is not None and known.values is not None:
            figures, why = known.values(envs), known.text
            kind: str = known.kind
        elif metric.name in measured:
            figures = measured[metric.name]
            kind = "reference" if known is None else known.kind
            why = str(best) if known is None else known.text
        else:
            continue
        zero, one = float(random[metric.name].mean()), float(figures.mean())
        if (one - zero) * (1.0 if metric.more else -1.0) > 0.0:
            scales.append(Scale(metric.name, zero, one, kind, why, plain[metric.name]))
    envs.close()
    return scales


def document(
    ids: Mapping[str, list[Scale]], provenance: Mapping[str, Any], n: int = N_STARTS
) -> dict[str, Any]:
    """The data, as JSON values.

    Args:
        ids: Scales of every id.
        provenance: Where they come from.
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
                "scales": [asdict(scale) for scale in scales],
            }
            for env_id, scales in ids.items()
        },
    }
