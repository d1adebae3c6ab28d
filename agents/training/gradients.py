"""Check of gradients for NaN and infinity, before a weight follows them."""

from __future__ import annotations

import math
from typing import Any

import torch
from torch.optim import Optimizer

from rigid_envs.sb3.finite import NonFiniteError

__all__ = ["guard_optimizer"]


def guard_optimizer(optimizer: Optimizer) -> None:
    """Make an optimiser refuse gradients that are not finite.

    A loss that is NaN has gradients that are NaN, and so has a loss that is infinite after the
    clipping of the norm; so this is the one place to look, whatever the algorithm.
    """
    optimizer.register_step_pre_hook(_refuse_bad_gradients)


def _refuse_bad_gradients(optimizer: Optimizer, *_: Any) -> None:
    gradients = [p.grad for group in optimizer.param_groups for p in group["params"]]
    present = [gradient for gradient in gradients if gradient is not None]
    if not math.isfinite(torch.nn.utils.get_total_norm(present).item()):
        raise NonFiniteError(
            "the gradient of the loss is not finite; no weight has followed it. "
            "Try a lower learning_rate, or max_grad_norm"
        )
