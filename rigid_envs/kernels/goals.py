"""Rewards of observed goals (float32 values), computed anew exactly as `step` computes them."""

from collections.abc import Callable
from typing import Any

import numpy.typing as npt

from rigid_envs.kernels.algebra import Row, weighted_sum
from rigid_envs.kernels.compiler import phase
from rigid_envs.kernels.layout import Prototypes
from rigid_envs.kernels.rows import load

__all__ = ["reward_rows"]

Array = npt.NDArray[Any]


@phase
def reward_rows(
    judge: Callable[[Row, Row, Row], tuple[Row, bool]],
    goal: Row,
    prototypes: Prototypes,
    achieved: Array,
    desired: Array,
    weights: Array,
    constants: Array,
    out: Array,
) -> None:
    """``out[i]`` = weighted sum of the terms of ``judge(achieved[i], desired[i], constants)``."""
    w = load(weights, 0, prototypes.terms, 1)
    c = load(constants, 0, prototypes.constants, 1)
    for i in range(achieved.shape[0]):
        at = i * len(goal)
        terms, _ = judge(load(achieved, at, goal, 1), load(desired, at, goal, 1), c)
        out[i] = weighted_sum(w, terms)
