"""Symmetries of a free body: rotations of space, half turns of the body about principal axes."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks import symmetry


def _rotate(point: symmetry.Point, q: Array) -> symmetry.Point:
    # R -> S R, for the body and for its goal: what is seen from the body stays
    S = (q[:, 0], q[:, 1], q[:, 2], q[:, 3])
    return point._replace(
        y=symmetry.attitudes(point.y, left=S), aux=symmetry.attitudes(point.aux, left=S)
    )


def _half_turn(number: int) -> symmetry.Symmetry:
    """Half turn about the principal axis of a number."""

    def apply(point: symmetry.Point, sign: Array) -> symmetry.Point:
        # R -> R D with D = diag(1, -1, -1) or the like: the same axes, pointing elsewhere
        zero, turns = np.zeros_like(sign), np.where(sign < 0.0, 1.0, 0.0)
        axis = [turns if k == number else zero for k in (1, 2, 3)]
        D: symmetry.Quaternions = (1.0 - turns, axis[0], axis[1], axis[2])
        return point._replace(
            y=_others_reversed(symmetry.attitudes(point.y, right=D), sign),
            aux=symmetry.attitudes(point.aux, right=D),
            action=_others_reversed(point.action, sign),
        )

    def _others_reversed(row: Any, sign: Array) -> Any:
        names = [name for name in row._fields if name[-1] in "123" and name[-1] != str(number)]
        return symmetry.reversed_in(row, names, sign)

    return symmetry.Symmetry(f"half turn of the body about e{number}", apply, symmetry.signs)


ROTATION_IN_SPACE = symmetry.Symmetry("rotation of space", _rotate, symmetry.rotations)
HALF_TURN_1, HALF_TURN_2 = _half_turn(1), _half_turn(2)
