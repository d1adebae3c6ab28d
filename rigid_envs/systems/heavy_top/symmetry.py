"""Symmetries of a heavy top whose pivot may move on a plane."""

from __future__ import annotations

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks.symmetry import (
    Point,
    Symmetry,
    about_z,
    angles,
    attitudes,
    reversed_in,
    signs,
    turned,
)

_HORIZONTAL = (("X", "Y"), ("VX", "VY"), ("aX", "aY"), ("tau_x", "tau_y"))
_ACROSS = (("omega1", "omega2"), ("tau1", "tau2"))
# the mirror y = 0: of polar vectors it reverses y, of axial ones x and z
_REVERSED = ("x", "z", "Y", "VY", "aY", "tau_x", "omega1", "omega3", "tau1", "tau3")


def _turn(point: Point, angle: Array) -> Point:
    # R -> S R with the turn S of the world
    y = attitudes(turned(point.y, _HORIZONTAL, angle), left=about_z(angle))
    return point._replace(y=y, action=turned(point.action, _HORIZONTAL, angle))


def _change_phase(point: Point, angle: Array) -> Point:
    # R -> R S^-1, as seen in body axes that are turned back
    y = attitudes(turned(point.y, _ACROSS, angle), right=about_z(-angle))
    return point._replace(y=y, action=turned(point.action, _ACROSS, angle))


def _turn_halfway(point: Point, sign: Array) -> Point:
    return _change_phase(point, np.where(sign < 0.0, math.pi, 0.0))


def _reflect(point: Point, sign: Array) -> Point:
    return point._replace(
        y=reversed_in(point.y, _REVERSED, sign), action=reversed_in(point.action, _REVERSED, sign)
    )


TURN = Symmetry("turn about the vertical through the origin", _turn, angles)
PHASE = Symmetry("turn of the axes e1 and e2 about e3 (I1 = I2)", _change_phase, angles)
HALF_TURN = Symmetry("half turn of the body about e3", _turn_halfway, signs)
REFLECTION = Symmetry(
    "reflection of the world in a vertical plane and of the body in the plane of e1 and e3",
    _reflect,
    signs,
)
