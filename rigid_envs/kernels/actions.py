"""How an action outside its space is brought back into it."""

import math

import numpy as np

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar

__all__ = ["clip_to_box", "clip_to_disc"]

# a float32 vector that was scaled to length 1 may have this squared length at most
_ROUNDED_UNIT = 1.0 + 2.0**-22


@scalar
def clip_to_box(action: Row) -> tuple[Row, bool]:
    """Three components, each into [-1, 1]."""
    a, b, c = action
    x, y, z = min(max(a, -1.0), 1.0), min(max(b, -1.0), 1.0), min(max(c, -1.0), 1.0)
    return (x, y, z), (x != a) | (y != b) | (z != c)


@scalar
def clip_to_disc(action: Row) -> tuple[Row, bool]:
    """Two components, by their norm: the direction is kept.

    The result is rounded to float32, so that clipping it again changes nothing.
    """
    x, y = action
    square = x * x + y * y
    outside = square > _ROUNDED_UNIT
    scale = 1.0 / math.sqrt(square) if outside else 1.0
    x = float(np.float32(x * scale)) if outside else x
    y = float(np.float32(y * scale)) if outside else y
    return (x, y), outside
