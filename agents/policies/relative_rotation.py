"""What comes before the layers of a network that is given two attitudes."""

from __future__ import annotations

import torch
from torch import Tensor, nn

__all__ = ["Turn"]


class Turn(nn.Module):
    """``R^T R'`` and ``R' R^T`` beside inputs that hold the matrices R and R'.

    That is the turn from one attitude to the other, in body and in world axes. A policy acts on
    nothing else, and layers, which add, learn products of their inputs slowly.
    """

    n_more = 18

    def __init__(self, achieved: int, desired: int) -> None:
        """Remember where the matrices are.

        Args:
            achieved: Where R begins, row by row.
            desired: Where R' begins.
        """
        super().__init__()
        self._places = achieved, desired

    def forward(self, inputs: Tensor) -> Tensor:
        """From shape (N, n) to (N, n + 18)."""
        here, there = (inputs[:, at : at + 9].reshape(-1, 3, 3) for at in self._places)
        back = here.transpose(1, 2)
        return torch.cat([inputs, (back @ there).flatten(1), (there @ back).flatten(1)], dim=1)
