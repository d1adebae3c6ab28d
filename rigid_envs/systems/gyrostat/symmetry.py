"""Symmetries of a satellite whose camera looks along e3: mirror images of body and orbit."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks import symmetry


def _half_turn(point: symmetry.Point, sign: Array) -> symmetry.Point:
    # R -> R diag(-1, -1, 1): the camera looks where it did
    zero, turns = np.zeros_like(sign), np.where(sign < 0.0, 1.0, 0.0)
    D = [1.0 - turns, zero, zero, turns]

    def change(row: Any) -> Any:
        names = [name for name in row._fields if name[-1] in "12"]
        return symmetry.reversed_in(symmetry.attitudes(row, right=D), names, sign)

    return point._replace(y=change(point.y), action=change(point.action))


def _mirror(point: symmetry.Point, sign: Array) -> symmetry.Point:
    # R -> S R diag(-1, 1, 1), S the reflection in the plane of the orbit; both are half turns about
    # the axis that they reverse, times -1
    zero, turns = np.zeros_like(sign), np.where(sign < 0.0, 1.0, 0.0)
    D = [1.0 - turns, turns, zero, zero]
    w, x, y, z = frame = symmetry.attitude(point.aux, "pass_")
    S = symmetry.product(symmetry.product(frame, D), (w, -x, -y, -z))

    def change(row: Any) -> Any:
        names = [name for name in row._fields if name[-1] in "23"]
        return symmetry.reversed_in(symmetry.attitudes(row, left=S, right=D), names, sign)

    aux = symmetry.reversed_in(point.aux, ("target_sine",), sign)
    return point._replace(y=change(point.y), aux=aux, action=change(point.action))


HALF_TURN = symmetry.Symmetry("half turn about the line of sight", _half_turn, symmetry.signs)
MIRROR = symmetry.Symmetry("reflection in the plane of the orbit", _mirror, symmetry.signs)
