"""Results in files, played again: every number must be hit to the last digit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs.catalogue import full_id
from rigid_envs.policies import load, published
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.policies import untrained_policies
from rigid_envs.scores.published import published_record
from rigid_envs.scores.reading import read_evaluation
from rigid_envs.scores.result import Evaluation

__all__ = ["Repeat", "policy_named", "repeat"]


@dataclass(frozen=True, eq=False)
class Repeat:
    """A result that was played again.

    Attributes:
        then: What the file says.
        now: What came of it now.
        differences: Which numbers of which starts differ; empty if none does.
    """

    then: Evaluation
    now: Evaluation
    differences: tuple[str, ...]


def repeat(file: str | Path, policy: str | None = None) -> Repeat:
    """Play the episodes of a result again: same task, same starts.

    Args:
        file: From `Evaluation.save` or ``rigid-envs evaluate --out``.
        policy: Which one to play, see `policy_named`; by default the one that the result names, if
            it is a controller or published.

    Raises:
        DamagedFileError: The file is damaged, or its figures do not follow from its starts.
        FileNotFoundError: No such file.
        ValueError: The result does not say which policy it is of.
    """
    then = read_evaluation(file)
    chosen = policy_named(policy) if policy is not None else _policy_of(then)
    now = evaluate(then.env_id, chosen, n=then.n, config=dict(then.config), seed=then.seed)
    return Repeat(then, now, tuple(_differences(then, now)))


def policy_named(name: str) -> Any:
    """The trained policy of a file (.safetensors) or of an id; else the name, of a controller."""
    trained = name.endswith(".safetensors") or full_id(name) in ENVIRONMENTS
    return load(name) if trained else name


def _policy_of(found: Evaluation) -> Any:
    """The policy that a result names."""
    if found.policy in untrained_policies(found.env_id):
        return found.policy
    for name in published():
        record = published_record(name)
        if (record.env_id, record.policy) == (found.env_id, found.policy):
            return load(name)
    raise ValueError(
        f"algo = {found.policy!r}; expected a controller of {found.env_id} or a published policy: "
        "name the policy, or its file"
    )


def _differences(then: Evaluation, now: Evaluation) -> list[str]:
    """One line for every quantity that is not the same from every start."""
    lines = []
    for name in sorted(then.values.keys() | now.values.keys()):
        old, new = then.values.get(name), now.values.get(name)
        if old is None or new is None:
            lines.append(f"{name}: only {'now' if old is None else 'then'}")
        elif not np.array_equal(old, new, equal_nan=True):
            other = np.flatnonzero((old != new) & ~(np.isnan(old) & np.isnan(new)))
            first = other[0]
            lines.append(
                f"{name}: {len(other)} of {len(old)} starts differ, start {first} first: "
                f"{old[first]!r} then, {new[first]!r} now"
            )
    return lines
