"""Comparison of observed goals (float32 values), so that rewards can be recomputed exactly."""

from collections.abc import Callable
from typing import Any

import numpy.typing as npt

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import phase
from rigid_envs.kernels.rows import load

__all__ = ["reach_rows"]

Array = npt.NDArray[Any]


@phase
def reach_rows(
    reached: Callable[[Row, Row, Row], bool],
    goal: Row,
    prototype: Row,
    achieved: Array,
    desired: Array,
    constants: Array,
    out: Array,
) -> None:
    """``out[i] = reached(achieved[i], desired[i], constants)``, 1 or 0."""
    c = load(constants, 0, prototype, 1)
    for i in range(achieved.shape[0]):
        at = i * len(goal)
        out[i] = reached(load(achieved, at, goal, 1), load(desired, at, goal, 1), c)
