"""Figures of one episode while it is played."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rigid_envs.registry import ErrorTerm
from rigid_envs.scores.episodes import Episodes
from rigid_envs.scores.metrics import Metric
from rigid_envs.tasks import Task

__all__ = ["Tally"]


class Tally:
    """Sums over the steps of one episode, from which its metrics follow at any time.

    Args:
        seed: Of the start.
        limit: Number of steps after which the episode is cut off.
        error: Reward term whose error is recorded; None for none.
    """

    def __init__(self, seed: int, limit: int, error: ErrorTerm | None = None) -> None:
        """No step yet."""
        self._seed, self._limit, self._error = seed, limit, error
        self._length = self._failed = 0
        self._sum = self._cost = self._square = 0.0
        self._terminated = False

    def add(self, reward: float, terminated: bool, info: Mapping[str, Any]) -> None:
        """Count a step.

        Args:
            reward: As `step` returns it.
            terminated: As `step` returns it.
            info: That of a single environment, or one row of a vector one.
        """
        self._length += 1
        self._sum += float(reward)
        self._cost += float(info["cost"])
        self._terminated = bool(terminated)
        if not info["is_success"]:
            self._failed = self._length
        if self._error is not None:
            term = float(info[f"reward/{self._error.term}"])
            self._square += ((1.0 / term - 1.0) / self._error.sharpness) ** 2

    @property
    def episodes(self) -> Episodes:
        """The episode so far, as `rigid_envs.scores.episodes.play` counts it at its end."""
        rms = None if self._error is None else np.sqrt([self._square / max(self._length, 1)])
        return Episodes(
            seeds=[self._seed],
            returns=np.array([self._sum]),
            lengths=np.array([self._length]),
            successes=np.array([self._failed < self._length]),
            since=np.array([self._failed + 1]),
            terminated=np.array([self._terminated]),
            costs=np.array([self._cost]),
            errors=rms,
            bounds=None,
            limit=self._limit,
        )

    @property
    def success(self) -> bool:
        """Whether the last step was a success."""
        return 0 < self._length and self._failed < self._length

    def value(self, metric: Metric, task: Task) -> float:
        """A metric of the episode, also where it failed; see `Metric.values`."""
        return float(metric.values(self.episodes, task)[0])
