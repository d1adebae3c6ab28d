"""Activations of the hidden layers, by name."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn

from rigid_envs.provenance import cpu_name

__all__ = ["ACTIVATIONS", "Tanh"]


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
