"""NaN and infinity stop a run before they reach the weights."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.optim import Optimizer

__all__ = ["NonFiniteError", "all_finite", "bad_row", "guard_optimizer"]


class NonFiniteError(FloatingPointError):
    """A reward, an observation or a gradient is NaN or infinite."""


def all_finite(arrays: NDArray[Any] | Mapping[str, NDArray[Any]] | tuple[Any, ...]) -> bool:
    """Whether there is no NaN and no infinity.

    One sum is not finite when any of its terms is not, and costs less than looking at each.

    Args:
        arrays: An array or a collection of arrays.
    """
    with np.errstate(invalid="ignore"):
        return all(math.isfinite(array.sum()) for array in _each(arrays))


def bad_row(arrays: NDArray[Any] | Mapping[str, NDArray[Any]] | tuple[Any, ...]) -> int | None:
    """The first row with a NaN or an infinity.

    Args:
        arrays: An array of shape (N, ...) or a collection of such.

    Returns:
        Its index, or None if all is finite.
    """
    for array in _each(arrays):
        bad = ~np.isfinite(array.reshape(len(array), -1)).all(axis=1)
        if bad.any():
            return int(bad.argmax())
    return None


def guard_optimizer(optimizer: Optimizer) -> None:
    """Make an optimiser refuse to step along a gradient that is not finite.

    A loss that is NaN has gradients that are NaN, and so has a loss that is infinite after the
    clipping of the norm; so this is the one place to look, whatever the algorithm.

    Args:
        optimizer: The optimiser to guard.
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


def _each(arrays: Any) -> tuple[Any, ...]:
    if isinstance(arrays, dict):
        return tuple(arrays.values())
    return arrays if isinstance(arrays, tuple) else (arrays,)
