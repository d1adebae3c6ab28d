"""The random policy: actions drawn uniformly from the action space."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from rigid_envs.scores.episodes import Observations

__all__ = ["RandomPolicy"]


class RandomPolicy:
    """Actions drawn uniformly from the action space: the baseline that has score 0."""

    def __init__(self, action_space: spaces.Space[Any], rng: np.random.Generator) -> None:
        """Draw from a space.

        Args:
            action_space: A box or a discrete space, of one row.
            rng: Source of the draws.
        """
        self._space, self._rng = action_space, rng

    def predict(
        self, observation: Observations, *, deterministic: bool = True
    ) -> tuple[npt.NDArray[Any], None]:
        """Draw an action for each observation.

        Args:
            observation: Shape (N, ...), or a dictionary of such.
            deterministic: Ignored.
        """
        part = next(iter(observation.values())) if isinstance(observation, dict) else observation
        n, space = len(part), self._space
        if isinstance(space, spaces.Discrete):
            return self._rng.integers(space.start, space.start + space.n, n), None
        assert isinstance(space, spaces.Box)
        actions = self._rng.uniform(space.low, space.high, (n, *space.shape))
        return actions.astype(space.dtype), None
