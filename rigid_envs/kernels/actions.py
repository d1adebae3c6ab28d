"""Clipping of actions to the action space."""

import math
from typing import Any

import numpy as np

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar

__all__ = [
    "as_given",
    "clip_to_ball",
    "clip_to_box",
    "clip_to_disk",
    "clip_to_interval",
    "clip_to_square",
    "keep",
    "single",
]

# a float32 vector that was scaled to length 1 may have this squared length at most
_ROUNDED_UNIT = 1.0 + 2.0**-22


@scalar
def clip(a: float) -> float:
    """Clip one component to [-1, 1]."""
    return min(max(a, -1.0), 1.0)


@scalar
def clip_to_interval(action: Row) -> tuple[Row, bool]:
    """Clip a single component to [-1, 1]; also whether it was outside."""
    x = clip(action[0])
    return (x,), x != action[0]


@scalar
def clip_to_square(action: Row) -> tuple[Row, bool]:
    """Clip two components, each to [-1, 1]."""
    x, y = clip(action[0]), clip(action[1])
    return (x, y), (x != action[0]) | (y != action[1])


@scalar
def clip_to_box(action: Row) -> tuple[Row, bool]:
    """Clip three components, each to [-1, 1]."""
    a, b, c = action
    x, y, z = clip(a), clip(b), clip(c)
    return (x, y, z), (x != a) | (y != b) | (z != c)


@scalar
def clip_to_disk(action: Row) -> tuple[Row, bool]:
    """Clip two components to the unit disk; the direction is kept.

    The result is rounded to float32, so that clipping it again changes nothing.
    """
    x, y = action
    scale, outside = shrink(x * x + y * y)
    return (single(x * scale), single(y * scale)), outside


@scalar
def clip_to_ball(action: Row) -> tuple[Row, bool]:
    """Clip three components to the unit ball, as `clip_to_disk`."""
    x, y, z = action
    scale, outside = shrink(x * x + y * y + z * z)
    return (single(x * scale), single(y * scale), single(z * scale)), outside


@scalar
def keep(action: Row) -> tuple[Row, bool]:
    """Discrete action, unchanged: it has been checked already."""
    return action, False


@scalar
def as_given(action: Row, frame: Row) -> Row:
    """The action itself, where it is given in the frame of the task."""
    return action


@scalar
def no_frame(y: Any, aux: Any, p: Any, c: Any) -> tuple[()]:
    """Nothing: actions are given in the frame of the task."""
    return ()


@scalar
def shrink(square: float) -> tuple[float, bool]:
    """Scale factor to norm 1 for a squared norm above 1, else 1; also whether it was above 1."""
    outside = square > _ROUNDED_UNIT
    return (1.0 / math.sqrt(square) if outside else 1.0), outside


@scalar
def single(x: float) -> float:
    """The nearest float32, as a double: what is computed with it must not be rounded to float32."""
    return np.float64(np.float32(x))
