"""Arrays of a policy file: the layers of its network, and what else its head needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["HEADS", "check_others", "weights_of"]

Arrays = Mapping[str, NDArray[Any]]

HEADS = ("gaussian", "squashed gaussian", "categorical", "greedy")
"""Distributions of actions: of PPO, of SAC, of PPO over choices, and the largest value (DQN)."""

_LAYER_LIMIT = 64


def weights_of(arrays: Arrays) -> list[NDArray[np.float32]]:
    """The matrices of the layers, each checked to take what the one before gives.

    Args:
        arrays: `layers.<k>.weight`, shape (outputs, inputs), `layers.<k>.bias`, and others.
    """
    count = sum(name.startswith("layers.") and name.endswith(".weight") for name in arrays)
    if not 1 <= count <= _LAYER_LIMIT:
        raise ValueError(f"expected 1 to {_LAYER_LIMIT} layers, found {count}")
    weights = [arrays[f"layers.{k}.weight"] for k in range(count)]
    for k, weight in enumerate(weights):
        bias = arrays[f"layers.{k}.bias"]
        if {weight.dtype, bias.dtype} != {np.dtype(np.float32)} or weight.ndim != 2:
            raise ValueError(f"layers.{k}: expected a matrix and a vector of float32")
        if bias.shape != weight.shape[:1]:
            raise ValueError(f"layers.{k}.bias: expected {len(weight)} numbers, found {bias.shape}")
        if k and weight.shape[1] != len(weights[k - 1]):
            raise ValueError(
                f"layers.{k}.weight has shape {weight.shape}; expected (..., {len(weights[k - 1])})"
            )
    return weights


def check_others(arrays: Arrays, head: str, last: tuple[int, int], n_normal: int | None) -> None:
    """Refuse an array, other than those of the layers, that is missing, misshapen or unused.

    Args:
        arrays: All arrays of a file.
        head: One of `HEADS`.
        last: Shape of the matrix of the last layer.
        n_normal: Number of inputs that are normalised; None if they are not.
    """
    wanted = {name: ("float32", shape) for name, shape in _needs(head, *last).items()}
    if n_normal is not None:
        for name in ("observation.mean", "observation.var"):
            wanted[name] = ("float64", (n_normal,))
    found = {k: (str(a.dtype), a.shape) for k, a in arrays.items() if not k.startswith("layers.")}
    for name in sorted(wanted.keys() | found.keys()):
        if wanted.get(name) != found.get(name):
            raise ValueError(f"{name}: expected {wanted.get(name)}, found {found.get(name)}")


def _needs(head: str, n_out: int, n_hidden: int) -> dict[str, tuple[int, ...]]:
    """Names and shapes of the arrays of a head, besides the last layer."""
    box: dict[str, tuple[int, ...]] = {"action.low": (n_out,), "action.high": (n_out,)}
    if head == "gaussian":
        return {"log_std": (n_out,), **box}
    if head == "squashed gaussian":
        return {"log_std.weight": (n_out, n_hidden), "log_std.bias": (n_out,), **box}
    return {}
