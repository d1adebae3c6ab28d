"""Input layer that adds the relative rotation of two attitudes."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from rigid_envs.policies.stored import N_ROTATIONS

__all__ = ["RelativeRotation"]


class RelativeRotation(nn.Module):
    """Append ``R^T R'`` and ``R' R^T`` to inputs that hold the matrices R and R'.

    The rotation from one attitude to the other, in body and in world axes. The action depends on
    nothing else, and linear layers learn products of their inputs slowly.
    """

    n_more = N_ROTATIONS

    def __init__(self, achieved: int, desired: int) -> None:
        """Set the indices of the matrices.

        Args:
            achieved: Index of the first of the 9 entries of R, row by row.
            desired: The same for R'.
        """
        super().__init__()
        self._places = achieved, desired

    def forward(self, inputs: Tensor) -> Tensor:
        """From shape (N, n) to (N, n + 18)."""
        here, there = (inputs[:, at : at + 9].reshape(-1, 3, 3) for at in self._places)
        back = here.transpose(1, 2)
        return torch.cat([inputs, (back @ there).flatten(1), (there @ back).flatten(1)], dim=1)
