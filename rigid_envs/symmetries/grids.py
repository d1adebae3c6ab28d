"""Symmetries of a ball that is rolled on a grid of squares: those of the square, D4."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.symmetries import balls
from rigid_envs.symmetries.symmetry import Point, Symmetry, quarter_turns, signs

__all__ = ["QUARTER_TURN", "REFLECTION"]

Array = npt.NDArray[np.float64]

_QUARTER = 0.5 * np.pi


class _Direction(NamedTuple):
    """Direction of a roll as a vector."""

    VX: Array
    VY: Array


def _of_a_square(
    apply: Callable[[Point, Array], Point], unit: float
) -> Callable[[Point, Array], Point]:
    """The same change with side k as the direction at k quarter turns, elements times `unit`."""

    def changed(point: Point, element: Array) -> Point:
        angle = _QUARTER * point.action.side
        direction = _Direction(np.cos(angle), np.sin(angle))
        new = apply(point._replace(action=direction), unit * element)
        side = np.rint(np.arctan2(new.action.VY, new.action.VX) / _QUARTER) % 4.0
        return new._replace(action=point.action._replace(side=side))

    return changed


QUARTER_TURN = Symmetry(
    "quarter turns about the vertical through home",
    _of_a_square(balls.TURN.apply, _QUARTER),
    quarter_turns,
)
REFLECTION = Symmetry(
    "reflection in the plane through home and +x", _of_a_square(balls.REFLECTION.apply, 1.0), signs
)
