"""Published policies and rows, played again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.base.files import file_digest
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.policies import untrained_policies
from rigid_envs.scores.proof import up_to_date
from rigid_envs.scores.records import Record, read_evaluation, read_record
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.starts import TEST_SEED
from rigid_envs.scores.trained import FOLDER, file_of, load, published

# Published policies evaluated again: every figure must be hit to the last digit.


@dataclass(frozen=True, eq=False)
class Repeat:
    """Episodes that were played again.

    Attributes:
        then: What a file says of them, or what is published.
        now: What came of it now; of `recheck` with a seed, from other starts.
        differences: Which numbers of which starts differ; empty if none does.
    """

    then: Evaluation
    now: Evaluation
    differences: tuple[str, ...]


def published_record(name: str, folder: Path = FOLDER) -> Record:
    """The record of a published policy.

    Args:
        name: See `rigid_envs.load`.
        folder: Where the policies are.
    """
    return read_record(file_of(name, folder).with_suffix(".json"))


def published_evaluation(name: str, folder: Path = FOLDER) -> Evaluation:
    """The record of a published policy as an evaluation, beside what is best known now.

    It has success and cost of each start, and neither returns nor other metrics.

    Args:
        name: See `rigid_envs.load`.
        folder: Where the policies are.
    """
    return up_to_date(published_record(name, folder).evaluation)


def recheck(name: str, seed: int | None = None, folder: Path = FOLDER) -> Repeat:
    """Evaluate a published policy again.

    From the published starts, success and cost of each must be the same, to the last digit. From
    other ones, the rate of success must lie within the 95 % interval of the published rate.

    Args:
        name: See `rigid_envs.load`.
        seed: Seed of other starts; None takes the published ones.
        folder: Where the policies are.
    """
    file, record = file_of(name, folder), published_record(name, folder)
    then = published_evaluation(name, folder)
    starts = TEST_SEED if seed is None else seed
    now = evaluate(then.env_id, load(file), n=then.n, config=then.config, seed=starts)
    if seed is None:
        wrong = _differences(then.values, {key: now.values[key] for key in then.values})
    else:
        (_, low, high), rate = then.success, now.success.mean
        expected = f"expected {low:.3f} to {high:.3f}"
        wrong = [] if low <= rate <= high else [f"success {rate:.3f} of other starts; {expected}"]
    if file_digest(file) != record.policy_sha256:
        wrong.append("the record is of another file")
    return Repeat(then, now, tuple(wrong))


# Results in files, played again: every number must be hit to the last digit.


def repeat(file: str | Path, policy: str | None = None) -> Repeat:
    """Play the episodes of a result again: same task, same starts.

    Args:
        file: From `Evaluation.save` or ``rigid-envs evaluate --out``.
        policy: Which one to play, see `evaluate`; by default the one that the result names, if
            it is a controller or published.

    Raises:
        DamagedFileError: The file is damaged, or its figures do not follow from its starts.
        FileNotFoundError: No such file.
        ValueError: The result does not say which policy it is of.
    """
    then = read_evaluation(file)
    chosen = _policy_of(then) if policy is None else policy
    now = evaluate(then.env_id, chosen, n=then.n, config=dict(then.config), seed=then.seed)
    return Repeat(then, now, tuple(_differences(then.values, now.values)))


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


def _differences(then: Mapping[str, Array], now: Mapping[str, Array]) -> list[str]:
    """One line for every quantity that is not the same from every start."""
    lines = []
    for name in sorted(then.keys() | now.keys()):
        old, new = then.get(name), now.get(name)
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
