"""Symmetry of a roller in a valley."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rigid_envs.symmetries.symmetry import Point, Symmetry, signs

__all__ = ["REFLECTION"]

Array = npt.NDArray[np.float64]


def _reflect(point: Point, sign: Array) -> Point:
    # the action changes the inertia, which has no direction
    y = point.y
    return point._replace(y=y._replace(s=sign * y.s, v=sign * y.v))


REFLECTION = Symmetry("reflection in the vertical through the bottom", _reflect, signs)
