"""The adapter of a training: its pay, the episodes that ended, its state."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from rigid_envs.sb3.adapter import GymnasiumVecEnv
from rigid_envs.scores.starts import entries_of

from ..storage.logs import flat, under


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
        self._ends: list[dict[str, Any]] = []

    def pop_episodes(self) -> list[dict[str, Any]]:
        """The episodes that ended since the last call, in order: rows of a monitor file of SB3.

        Returns:
            Of each its sum of rewards r, length l, age t of the training at its end [steps], and
            `is_success`; None if the environment has none.
        """
        ends, self._ends = self._ends, []
        return ends

    def get_state(self) -> dict[str, NDArray[Any]]:
        """Everything that a bitwise continuation needs: the environment's state and ours.

        Returns:
            Arrays by name; `set_state` takes them back.
        """
        own = {"returns": self._returns.copy(), "lengths": self._lengths.copy()}
        return flat({"env": self._find("get_state")(), **own, "steps": self._steps})

    def set_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Return to a state, to the bit.

        Args:
            state: From `get_state`.
        """
        self._find("set_state")(under("env", state))
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

    def step_wait(self) -> VecEnvStepReturn:
        """As of the adapter; also keeps how episodes ended."""
        result = super().step_wait()
        for info in filter(None, result[-1]):  # of rows whose episode has ended
            won, age = info.get("is_success"), self._steps * self.num_envs
            ended = {"t": age, "is_success": None if won is None else int(won)}
            self._ends.append({**info["episode"], **ended})
        return result
