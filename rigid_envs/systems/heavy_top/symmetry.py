"""Symmetries of a heavy top whose pivot may move on a plane."""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks import symmetry

_HORIZONTAL = (("X", "Y"), ("VX", "VY"), ("aX", "aY"), ("tau_x", "tau_y"))
_ACROSS = (("omega1", "omega2"), ("tau1", "tau2"))
# the mirror y = 0: of polar vectors it reverses y, of axial ones x and z
_REVERSED = ("x", "z", "Y", "VY", "aY", "tau_x", "omega1", "omega3", "tau1", "tau3")


def _turn_halfway(point: symmetry.Point, sign: Array) -> symmetry.Point:
    return PHASE.apply(point, np.where(sign < 0.0, math.pi, 0.0))


def _reflect(point: symmetry.Point, sign: Array) -> symmetry.Point:
    return symmetry.everywhere(point, lambda row: symmetry.reversed_in(row, _REVERSED, sign))


TURN = symmetry.Symmetry(
    "turn about the vertical through the origin",
    symmetry.turn_of_space(_HORIZONTAL),
    symmetry.angles,
)
PHASE = symmetry.Symmetry(
    "turn of the axes $e1$ and $e2$ about $e3$ ($I1 = I2$)",
    symmetry.turn_of_body(_ACROSS),
    symmetry.angles,
)
HALF_TURN = symmetry.Symmetry("half turn of the body about $e3$", _turn_halfway, symmetry.signs)
REFLECTION = symmetry.Symmetry(
    "reflection of the world in a vertical plane and of the body in the plane of $e1$ and $e3$",
    _reflect,
    symmetry.signs,
)
