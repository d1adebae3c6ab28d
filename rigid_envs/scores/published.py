"""Published policies evaluated again: every figure must be hit to the last digit."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rigid_envs.catalogue import task_of
from rigid_envs.policies import load
from rigid_envs.policies.loading import FOLDER, file_of
from rigid_envs.scores.efficiency import cost_of
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.intervals import wilson_interval
from rigid_envs.scores.records import Record, read_record
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.standing import best_of, bounds_of, objection
from rigid_envs.scores.starts import TEST_SEED

__all__ = ["Recheck", "published_evaluation", "published_record", "recheck"]


@dataclass(frozen=True, eq=False)
class Recheck:
    """A published policy that was evaluated again.

    Attributes:
        name: Its name.
        record: What is published.
        found: The evaluation of now, from the same starts; from others with another seed.
        differences: Where it differs from what is published; empty if it does not.
    """

    name: str
    record: Record
    found: Evaluation
    differences: tuple[str, ...]


def published_record(name: str, folder: Path = FOLDER) -> Record:
    """The record of a published policy.

    Args:
        name: See `rigid_envs.load`.
        folder: Where the policies are.
    """
    return read_record(file_of(name, folder).with_suffix(".json"))


def published_evaluation(name: str) -> Evaluation:
    """The record of a published policy as an evaluation, beside what is best known now.

    It has success and cost of each start, and neither returns nor other metrics.

    Args:
        name: See `rigid_envs.load`.
    """
    record = published_record(name)
    env_id, settings, n = record.env_id, record.settings, len(record.costs)
    cost = cost_of(env_id, task_of(env_id, settings))
    unranked = objection(env_id, settings, TEST_SEED, n)
    return Evaluation(
        env_id=env_id,
        policy=record.policy,
        config=settings,
        seed=TEST_SEED,
        cost=cost,
        values={"success": record.successes.astype(np.float64), cost.name: record.costs},
        best=None if unranked else best_of(env_id, n),
        bounds=bounds_of(env_id, n, TEST_SEED, settings),
        provenance=record.provenance,
        unranked=unranked,
    )


def recheck(name: str, seed: int | None = None, folder: Path = FOLDER) -> Recheck:
    """Evaluate a published policy again.

    From the published starts, success and cost of each must be the same, to the last digit. From
    other ones, the rate of success must lie within the 95 % interval of the published rate.

    Args:
        name: See `rigid_envs.load`.
        seed: Seed of other starts; None takes the published ones.
        folder: Where the policies are.
    """
    file, record = file_of(name, folder), published_record(name, folder)
    policy, n = load(file), len(record.costs)
    starts = TEST_SEED if seed is None else seed
    found = evaluate(record.env_id, policy, n=n, config=record.settings, seed=starts)
    if seed is None:
        wrong = record.differences(found)
    else:
        low, high = wilson_interval(int(record.successes.sum()), n)
        rate = found.success.mean
        wrong = (
            []
            if low <= rate <= high
            else [f"success {rate:.3f} of other starts; expected {low:.3f} to {high:.3f}"]
        )
    if hashlib.sha256(file.read_bytes()).hexdigest() != record.policy_sha256:
        wrong.append("the record is of another file")
    return Recheck(file.stem, record, found, tuple(wrong))
