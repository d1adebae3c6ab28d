"""Symmetries of a free body: rotations of space, half turns of the body about principal axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks.symmetry import (
    Point,
    Quaternions,
    Symmetry,
    attitudes,
    reversed_in,
    rotations,
    signs,
)


def _rotate(point: Point, q: Array) -> Point:
    # R -> S R, for the body and for its goal: what is seen from the body stays
    S = (q[:, 0], q[:, 1], q[:, 2], q[:, 3])
    return point._replace(y=attitudes(point.y, left=S), aux=attitudes(point.aux, left=S))


def _half_turn(number: int) -> Symmetry:
    """Half turn about the principal axis of a number."""

    def apply(point: Point, sign: Array) -> Point:
        # R -> R D with D = diag(1, -1, -1) or the like: the same axes, pointing elsewhere
        zero, turns = np.zeros_like(sign), np.where(sign < 0.0, 1.0, 0.0)
        axis = [turns if k == number else zero for k in (1, 2, 3)]
        D: Quaternions = (1.0 - turns, axis[0], axis[1], axis[2])
        return point._replace(
            y=_others_reversed(attitudes(point.y, right=D), sign),
            aux=attitudes(point.aux, right=D),
            action=_others_reversed(point.action, sign),
        )

    def _others_reversed(row: Any, sign: Array) -> Any:
        names = [name for name in row._fields if name[-1] in "123" and name[-1] != str(number)]
        return reversed_in(row, names, sign)

    return Symmetry(f"half turn of the body about e{number}", apply, signs)


ROTATION_IN_SPACE = Symmetry("rotation of space", _rotate, rotations)
HALF_TURN_1, HALF_TURN_2 = _half_turn(1), _half_turn(2)
