"""Computation of the anchors of scores: `rigid-envs anchors` and `rigid-envs verify --scores`."""

import json
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rigid_envs.catalogue import one_of_each
from rigid_envs.cli.progress import tell
from rigid_envs.files import write_atomic
from rigid_envs.pages.tables import table
from rigid_envs.provenance import heading, provenance
from rigid_envs.scores.anchor_data import compute_anchors, document
from rigid_envs.scores.scales import Anchors, ScoreScale, anchors

__all__ = ["make_anchors", "verify_scores"]

_TOLERANCE = 1e-3
"""Difference in score. The kernels give the same bits anywhere, but controllers use LAPACK, whose
roundings differ by machine: an episode in 500 may end some steps earlier or later."""


def make_anchors(ids: Sequence[str], n: int, file: Path) -> None:
    """Compute the anchors of some ids, and write them id by id; those of other ids stay.

    Args:
        ids: Gymnasium's ids.
        n: Number of starts.
        file: JSON file of the anchors.
    """
    where = {**provenance(), "command": " ".join(["rigid-envs", *sys.argv[1:]])}
    known = dict(json.loads(file.read_text())["ids"]) if file.exists() else {}
    for env_id in ids:
        tell(env_id)
        begin = time.perf_counter()
        found = compute_anchors(env_id, n)
        tell("")
        print(f"{env_id}   {time.perf_counter() - begin:.1f} s\n{_table(found)}\n")
        data = document({env_id: found}, where, n)
        known |= data["ids"]
        write_atomic(file, json.dumps({**data, "ids": known}, indent=1, allow_nan=False) + "\n")
    print(f"written to {file}")


def verify_scores(ids: Sequence[str]) -> bool:
    """Compute the anchors of some ids again, and print their difference from the data.

    Args:
        ids: Gymnasium's ids; if there are none, one of each kind of environment.

    Returns:
        Whether all agree.
    """
    print(heading(provenance()), end="\n\n")
    rows, holds = [], True
    for env_id in ids or one_of_each():
        tell(env_id)
        now = compute_anchors(env_id).scales
        known = anchors().get(env_id)
        for name, scale in known.scales.items() if known else ():
            off = _difference(scale, now.get(name))
            holds &= off <= _TOLERANCE
            verdict = "holds" if off <= _TOLERANCE else "FAILS"
            rows.append((env_id, name, f"{scale.anchor:.6g}", scale.kind, f"{off:.1e}", verdict))
        if known is None:
            rows.append((env_id, "", "", "", "", "no data"))
            holds = False
    tell("")
    print(table(("id", "metric", "anchor", "kind", "off by", ""), rows, "<<><>"))
    print(f"\noff by: the larger difference of score, of random policy and anchor; {_TOLERANCE:g}")
    return holds


def _difference(then: ScoreScale, now: ScoreScale | None) -> float:
    """Largest difference of random policy and anchor, as a score on the scale of the data."""
    if now is None or (now.kind, now.why) != (then.kind, then.why):
        return math.inf
    return float(max(abs(then(now.random)), abs(then(now.anchor) - 1.0)))


def _table(found: Anchors) -> str:
    rows = [
        (s.metric, f"{s.random:.5g}", f"{s.anchor:.5g}", s.kind, s.why)
        for s in found.scales.values()
    ]
    return table(("metric", "random", "anchor", "kind", "why"), rows, "<>>")
