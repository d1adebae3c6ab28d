"""Average of the weights of a policy over its last updates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["PolicyAverage"]

Arrays = dict[str, NDArray[Any]]


class PolicyAverage:
    """Exponential average of arrays: w <- w + (x - w) / min(n, N) at the n-th update.

    It is the plain mean of the first N, and forgets with that many updates after them. A policy of
    averaged weights lies in the middle of those that a constant learning rate wanders between.
    Source: Polyak, Juditsky (1992), doi:10.1137/0330046; for policies Nikishin et al. (2018),
    "Improving stability in deep reinforcement learning with weight averaging".
    """

    def __init__(self, n_updates: int) -> None:
        """Average nothing yet.

        Args:
            n_updates: N; with 1 the average is the last.
        """
        self._n_updates, self._age = n_updates, 0
        self._arrays: Arrays = {}

    def update(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take in the weights after an update.

        Args:
            arrays: By name, the same at each update.
        """
        self._age += 1
        share = 1.0 / min(self._age, self._n_updates)
        for name, new in arrays.items():
            if share == 1.0:
                self._arrays[name] = np.array(new)
            else:
                old = self._arrays[name]
                self._arrays[name] = (old + share * (new - old)).astype(new.dtype)

    def arrays(self) -> Arrays:
        """The averages."""
        return dict(self._arrays)

    def state(self) -> Arrays:
        """All that `restore` takes."""
        return {**self._arrays, "age": np.array(self._age)}

    def restore(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a state."""
        self._arrays = {name: array for name, array in state.items() if name != "age"}
        self._age = int(state["age"])
