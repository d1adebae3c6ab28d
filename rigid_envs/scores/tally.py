"""Figures of episodes while they are played."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.registry import ErrorTerm
from rigid_envs.scores.episodes import Episodes
from rigid_envs.scores.metrics import Metric
from rigid_envs.tasks import Task

__all__ = ["Tally"]

Array = npt.NDArray[np.float64]


class Tally:
    """Sums over the steps of one episode in each row, from which metrics follow at any time.

    Args:
        seeds: Seed of each start.
        error: Reward term whose error is recorded; None for none.
        limit: Number of steps after which an episode is cut off; None for that of the longest one.

    Attributes:
        keys: What `add` reads of an info.
        running: Rows whose episode has not ended, shape (n,).
        lengths: Steps counted, shape (n,).
    """

    def __init__(
        self, seeds: Sequence[int], error: ErrorTerm | None = None, limit: int | None = None
    ) -> None:
        """No step yet."""
        n = len(seeds)
        self._seeds, self._error, self._limit = list(seeds), error, limit
        self.keys = ("cost", "is_success", *([] if error is None else [f"reward/{error.term}"]))
        self.running = np.ones(n, dtype=bool)
        self.lengths = np.zeros(n, dtype=np.int64)
        self._failed = np.zeros(n, dtype=np.int64)
        self._returns, self._costs, self._squares = np.zeros(n), np.zeros(n), np.zeros(n)
        self._terminated = np.zeros(n, dtype=bool)

    def add(
        self,
        rewards: npt.ArrayLike,
        terminated: npt.ArrayLike,
        truncated: npt.ArrayLike,
        info: Mapping[str, Any],
    ) -> None:
        """Count a step of the rows that are running.

        Args:
            rewards: As `step` returns them, shape (n,); of one row also a number, as all others.
            terminated: As `step` returns it.
            truncated: As `step` returns it.
            info: Of the step itself, also where another episode has begun since.
        """
        running = self.running
        self.lengths += running
        self._returns += np.where(running, rewards, 0.0)
        self._costs += np.where(running, info["cost"], 0.0)
        missed = running & ~np.asarray(info["is_success"]).astype(bool)
        self._failed[missed] = self.lengths[missed]
        ended = running & np.logical_or(terminated, truncated)
        self._terminated |= ended & np.asarray(terminated)
        if self._error is not None:
            # rows that are not running may hold anything
            term = np.where(running, info[self.keys[-1]], 1.0)
            self._squares += ((1.0 / term - 1.0) / self._error.sharpness) ** 2
        self.running = running & ~ended

    def episodes(self) -> Episodes:
        """The episodes so far."""
        counted = np.maximum(self.lengths, 1)
        return Episodes(
            seeds=self._seeds,
            returns=self._returns,
            lengths=self.lengths,
            successes=self._failed < self.lengths,
            since=self._failed + 1,
            terminated=self._terminated,
            costs=self._costs,
            errors=None if self._error is None else np.sqrt(self._squares / counted),
            limit=self._limit or int(self.lengths.max()),
        )

    @property
    def success(self) -> bool:
        """Whether the last step of the first row was a success."""
        return bool(self._failed[0] < self.lengths[0])

    def value(self, metric: Metric, task: Task) -> float:
        """A metric of the first row, also where it failed."""
        return float(metric.values(self.episodes(), task)[0])
