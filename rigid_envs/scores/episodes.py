"""Episodes from many fixed starts, one from each, played together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

__all__ = ["ActionFunction", "Episodes", "Observations", "SupportsPredict"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Observations = npt.NDArray[Any] | dict[str, npt.NDArray[Any]]

ActionFunction = Callable[[Observations], npt.NDArray[Any]]
"""A function from the observations of all rows to their actions."""


class SupportsPredict(Protocol):
    """A policy of observations: a trained one, or a model of Stable-Baselines3."""

    def predict(
        self, observation: Observations, *, deterministic: bool = True
    ) -> tuple[npt.NDArray[Any], Any]:
        """Actions for a batch of observations."""


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
        bounds: Least cost that theory allows from each start, shape (n,); None if none is known.
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
    bounds: Array | None
    limit: int
