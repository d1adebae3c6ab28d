"""Symmetries of a heavy top whose pivot may move on a plane."""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks import symmetry

_HORIZONTAL = (("X", "Y"), ("VX", "VY"), ("aX", "aY"), ("tau_x", "tau_y"))
_ACROSS = (("omega1", "omega2"), ("tau1", "tau2"))
# the mirror y = 0: of polar vectors it reverses y, of axial ones x and z
_REVERSED = ("x", "z", "Y", "VY", "aY", "tau_x", "omega1", "omega3", "tau1", "tau3")


def _turn(point: symmetry.Point, angle: Array) -> symmetry.Point:
    # R -> S R with the turn S of the world
    y = symmetry.attitudes(
        symmetry.turned(point.y, _HORIZONTAL, angle), left=symmetry.about_z(angle)
    )
    return point._replace(y=y, action=symmetry.turned(point.action, _HORIZONTAL, angle))


def _change_phase(point: symmetry.Point, angle: Array) -> symmetry.Point:
    # R -> R S^-1, as seen in body axes that are turned back
    y = symmetry.attitudes(symmetry.turned(point.y, _ACROSS, angle), right=symmetry.about_z(-angle))
    return point._replace(y=y, action=symmetry.turned(point.action, _ACROSS, angle))


def _turn_halfway(point: symmetry.Point, sign: Array) -> symmetry.Point:
    return _change_phase(point, np.where(sign < 0.0, math.pi, 0.0))


def _reflect(point: symmetry.Point, sign: Array) -> symmetry.Point:
    return point._replace(
        y=symmetry.reversed_in(point.y, _REVERSED, sign),
        action=symmetry.reversed_in(point.action, _REVERSED, sign),
    )


TURN = symmetry.Symmetry("turn about the vertical through the origin", _turn, symmetry.angles)
PHASE = symmetry.Symmetry(
    "turn of the axes e1 and e2 about e3 (I1 = I2)", _change_phase, symmetry.angles
)
HALF_TURN = symmetry.Symmetry("half turn of the body about e3", _turn_halfway, symmetry.signs)
REFLECTION = symmetry.Symmetry(
    "reflection of the world in a vertical plane and of the body in the plane of e1 and e3",
    _reflect,
    symmetry.signs,
)
