"""Layers of policies in torch: activations by name, and the relative rotation of two attitudes."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn

from rigid_envs.engine.provenance import cpu_name
from rigid_envs.scores.trained import N_ROTATIONS


class _Tanh(torch.autograd.Function):
    """tanh(x) = 2 sigmoid(2 x) - 1, in place; the error is at most 2e-7, some roundings of float32.

    Torch takes its tanh from the Math Kernel Library, which is slow on processors of AMD: twice as
    slow as this one. On others it is twice as fast.
    """

    @staticmethod
    def forward(ctx: Any, x: Tensor) -> Tensor:
        y = torch.sigmoid(2.0 * x).mul_(2.0).sub_(1.0)
        ctx.save_for_backward(y)
        return y

    @staticmethod
    def backward(ctx: Any, *gradients: Any) -> Any:
        (y,) = ctx.saved_tensors
        return torch.ops.aten.tanh_backward(gradients[0], y)


class Tanh(nn.Module):
    """Hyperbolic tangent, by torch's sigmoid."""

    def forward(self, x: Tensor) -> Tensor:
        """Shape as x."""
        y: Tensor = _Tanh.apply(x)  # type: ignore[no-untyped-call]
        return y


_MKL: Any = torch.backends.mkl
_MKL_IS_SLOW = _MKL.is_available() and "AMD" in cpu_name()

ACTIVATIONS: dict[str, type[nn.Module]] = {
    "tanh": Tanh if _MKL_IS_SLOW else nn.Tanh,
    "relu": nn.ReLU,
    "elu": nn.ELU,
    "silu": nn.SiLU,
}
"""By the name that a config and a policy file give them."""


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
