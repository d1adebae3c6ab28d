"""Episodes from many fixed starts, one from each, played together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

__all__ = ["ActionFunction", "Episodes", "Observations", "SupportsPredict", "joined"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Observations = npt.NDArray[Any] | dict[str, npt.NDArray[Any]]

ActionFunction = Callable[[Observations], npt.NDArray[Any]]
"""A function from the observations of all rows to their actions."""


class SupportsPredict(Protocol):
    """A policy of observations: a trained one, or a model of Stable-Baselines3.

    One that has a memory also takes ``state`` and ``episode_start``, as Stable-Baselines3 has it.
    """

    def predict(
        self, observation: Observations, *, deterministic: bool = True
    ) -> tuple[npt.NDArray[Any], Any]:
        """Actions for a batch of observations, and the state of the memory."""


@dataclass(frozen=True)
class Episodes:
    """One episode from each start.

    Attributes:
        seeds: Seed of each start; `reset(seed=[...])` gives it again.
        returns: Sums of rewards, shape (n,).
        lengths: Numbers of steps, shape (n,).
        successes: `info["is_success"]` at the end, shape (n,).
        since: Step from which `info["is_success"]` was true to the end, shape (n,); where it is not
            true at the end, one step after it.
        terminated: Whether the task ended the episode, and not its time limit, shape (n,).
        costs: Sums of `info["cost"]`, in the unit that the task says, shape (n,).
        errors: Root mean squares of the error over the steps, shape (n,); None if none was asked
            for.
        limit: Number of steps after which an episode is cut off.
    """

    seeds: list[int]
    returns: Array
    lengths: npt.NDArray[np.int64]
    successes: Bools
    since: npt.NDArray[np.int64]
    terminated: Bools
    costs: Array
    errors: Array | None
    limit: int


def joined(parts: Sequence[Episodes], n: int, limit: int) -> Episodes:
    """The first n episodes of several.

    Args:
        parts: Each with at least one episode.
        n: Number of episodes.
        limit: Number of steps after which an episode is cut off.
    """
    errors = [part.errors for part in parts if part.errors is not None]
    return Episodes(
        seeds=[seed for part in parts for seed in part.seeds][:n],
        returns=np.concatenate([part.returns for part in parts])[:n],
        lengths=np.concatenate([part.lengths for part in parts])[:n],
        successes=np.concatenate([part.successes for part in parts])[:n],
        since=np.concatenate([part.since for part in parts])[:n],
        terminated=np.concatenate([part.terminated for part in parts])[:n],
        costs=np.concatenate([part.costs for part in parts])[:n],
        errors=np.concatenate(errors)[:n] if errors else None,
        limit=limit,
    )
