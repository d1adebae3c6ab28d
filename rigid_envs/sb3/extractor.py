"""Feature extractor that adds the rotation from the achieved to the desired attitude."""

from __future__ import annotations

from typing import Any

from gymnasium import spaces
from stable_baselines3.common.torch_layers import CombinedExtractor
from torch import Tensor

from rigid_envs.policies.layers import RelativeRotation

__all__ = ["AttitudeExtractor", "attitudes"]


class AttitudeExtractor(CombinedExtractor):
    """Concatenated parts of an observation, and the relative rotation of two attitudes in them."""

    def __init__(self, observation_space: spaces.Dict, achieved: int, desired: int) -> None:
        """As SB3's, with the indices that `RelativeRotation` takes."""
        super().__init__(observation_space)
        self._rotation = RelativeRotation(achieved, desired)
        self._features_dim += RelativeRotation.n_more

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Shape (N, n + 18)."""
        turned: Tensor = self._rotation(super().forward(observations))
        return turned


def attitudes(task: Any) -> dict[str, int]:
    """Indices in the input at which the rotation matrices of both goals begin; empty without.

    Args:
        task: The task of an environment; None for one that has none.
    """
    symbols = [] if task is None else [entry.symbol for entry in task.features()[: task.n_goal]]
    if "R11" not in symbols:
        return {}
    at = symbols.index("R11")  # SB3 puts the parts in the order of their names: achieved_goal first
    return {"achieved": at, "desired": at + task.n_goal}
