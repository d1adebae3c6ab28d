"""Symmetries of a free body: rotations of space, half turns of the body about principal axes."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks import symmetry


def _rotate(point: symmetry.Point, q: Array) -> symmetry.Point:
    # R -> S R, for the body and for its goal: what is seen from the body stays
    return symmetry.everywhere(point, lambda row: symmetry.attitudes(row, left=q.T))


def _half_turn(number: int) -> symmetry.Symmetry:
    """Half turn about the principal axis of a number."""

    def apply(point: symmetry.Point, sign: Array) -> symmetry.Point:
        # R -> R D with D = diag(1, -1, -1) or the like: the same axes, pointing elsewhere
        zero, turns = np.zeros_like(sign), np.where(sign < 0.0, 1.0, 0.0)
        D = [1.0 - turns, *(turns if k == number else zero for k in (1, 2, 3))]

        def change(row: Any) -> Any:
            others = [name for name in row._fields if name[-1] in "123" and name[-1] != f"{number}"]
            return symmetry.reversed_in(symmetry.attitudes(row, right=D), others, sign)

        return symmetry.everywhere(point, change)

    return symmetry.Symmetry(f"half turn of the body about $e{number}$", apply, symmetry.signs)


ROTATION_IN_SPACE = symmetry.Symmetry("rotation of space", _rotate, symmetry.rotations)
HALF_TURN_1, HALF_TURN_2 = _half_turn(1), _half_turn(2)
