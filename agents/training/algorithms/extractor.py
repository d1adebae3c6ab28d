"""Networks of goal environments that are told the turn from the attitude to the desired one."""

from __future__ import annotations

from typing import Any

from gymnasium import spaces
from stable_baselines3.common.torch_layers import CombinedExtractor
from torch import Tensor

from ...policies.relative_rotation import Turn

__all__ = ["AttitudeExtractor", "attitudes"]


class AttitudeExtractor(CombinedExtractor):
    """The parts of an observation side by side, and the turn between two attitudes in them."""

    def __init__(self, observation_space: spaces.Dict, achieved: int, desired: int) -> None:
        """As SB3's, with the places that `Turn` takes."""
        super().__init__(observation_space)
        self._turn = Turn(achieved, desired)
        self._features_dim += Turn.n_more

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Shape (N, n + 18)."""
        turned: Tensor = self._turn(super().forward(observations))
        return turned


def attitudes(task: Any) -> dict[str, int]:
    """Where the rotation matrices of both goals begin in what a network takes; empty without.

    Args:
        task: The task of an environment; None for one that has none.
    """
    symbols = [] if task is None else [entry.symbol for entry in task.features()[: task.n_goal]]
    if "R11" not in symbols:
        return {}
    at = symbols.index("R11")  # SB3 puts the parts in the order of their names: achieved_goal first
    return {"achieved": at, "desired": at + task.n_goal}
