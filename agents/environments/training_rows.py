"""The Stable-Baselines3 adapter of a training: pay of its own, lists of episodes, and its state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from rigid_envs.sb3 import GymnasiumVecEnv
from rigid_envs.scores.playing import entries_of

__all__ = ["EpisodeEnds", "TrainingRows"]


class EpisodeEnds(NamedTuple):
    """The episodes that ended in one step of the adapter.

    Attributes:
        step: Steps of the adapter so far, this one included.
        rows: Rows whose episode ended, shape (k,), ascending.
        returns: Sum of rewards of each episode, shape (k,).
        lengths: Number of steps of each episode, shape (k,).
        successes: `info["is_success"]` at the end, shape (k,); None if the environment has none.
    """

    step: int
    rows: NDArray[np.intp]
    returns: NDArray[np.float64]
    lengths: NDArray[np.int64]
    successes: NDArray[np.bool_] | None


class TrainingRows(GymnasiumVecEnv):
    """The adapter, with what a training adds to it.

    Attributes:
        price: What is taken from the reward for a unit of `info["cost"]`.
        bonus: What is added to it where `info["is_success"]`.
    """

    def __init__(self, venv: VectorEnv[Any, Any, Any]) -> None:
        """As the adapter, without price and bonus."""
        super().__init__(venv)
        self.price, self.bonus = 0.0, 0.0
        self._ends: list[EpisodeEnds] = []

    def pop_episodes(self) -> list[EpisodeEnds]:
        """The episodes that ended since the last call, in order."""
        ends, self._ends = self._ends, []
        return ends

    def get_state(self) -> dict[str, NDArray[Any]]:
        """Everything that a bitwise continuation needs: the environment's state and ours.

        Returns:
            Arrays by name; `set_state` takes them back.
        """
        state = {f"env/{key}": value for key, value in self._find("get_state")().items()}
        state["returns"] = self._returns.copy()
        state["lengths"] = self._lengths.copy()
        state["steps"] = np.array(self._steps)
        return state

    def set_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Return to a state, to the bit.

        Args:
            state: From `get_state`.
        """
        inner = {key[4:]: value for key, value in state.items() if key.startswith("env/")}
        self._find("set_state")(inner)
        self._returns[:] = state["returns"]
        self._lengths[:] = state["lengths"]
        self._steps = int(state["steps"])
        self._ends = []

    def _paid(self, rewards: NDArray[Any], dones: NDArray[np.bool_]) -> NDArray[Any]:
        told = entries_of(self.vector_infos, ("cost", "is_success"), dones)
        if self.price:
            rewards = rewards - self.price * told["cost"]
        if self.bonus:
            rewards = rewards + self.bonus * told["is_success"]
        return rewards

    def _end_episodes(
        self,
        rows: NDArray[np.intp],
        truncated: NDArray[np.bool_],
        infos: dict[str, Any],
        row_infos: list[dict[str, Any]],
    ) -> None:
        returns, lengths = self._returns[rows], self._lengths[rows]
        super()._end_episodes(rows, truncated, infos, row_infos)
        successes = None
        if "is_success" in row_infos[rows[0]]:
            successes = np.array([row_infos[row]["is_success"] for row in rows], dtype=bool)
        self._ends.append(EpisodeEnds(self._steps, rows, returns, lengths, successes))
