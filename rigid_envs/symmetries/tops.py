"""Symmetries of a heavy top whose pivot may move on a plane."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.symmetries.symmetry import Point, Symmetry, angles, signs

__all__ = ["HALF_TURN", "PHASE", "REFLECTION", "TURN"]

Array = npt.NDArray[np.float64]

_HORIZONTAL = (("X", "Y"), ("VX", "VY"), ("aX", "aY"), ("tau_x", "tau_y"))
_ACROSS = (("omega1", "omega2"), ("tau1", "tau2"))
# the mirror y = 0: of polar vectors it reverses y, of axial ones x and z
_REVERSED = ("x", "z", "Y", "VY", "aY", "tau_x", "omega1", "omega3", "tau1", "tau3")


def _turned(row: Any, pairs: tuple[tuple[str, str], ...], angle: Array) -> Any:
    """A row with those of its vectors turned that pairs of names give."""
    c, s = np.cos(angle), np.sin(angle)
    new: dict[str, Array] = {}
    for a, b in pairs:
        if a in row._fields:
            x, y = getattr(row, a), getattr(row, b)
            new |= {a: c * x - s * y, b: s * x + c * y}
    return row._replace(**new)


def _turn(point: Point, angle: Array) -> Point:
    # R -> S R with the turn S of the world: q is multiplied from the left
    y = _turned(point.y, _HORIZONTAL, angle)
    c, s = np.cos(0.5 * angle), np.sin(0.5 * angle)
    w, a, b, d = y.w, y.x, y.y, y.z
    y = y._replace(w=c * w - s * d, x=c * a - s * b, y=c * b + s * a, z=c * d + s * w)
    return point._replace(y=y, action=_turned(point.action, _HORIZONTAL, angle))


def _change_phase(point: Point, angle: Array) -> Point:
    # R -> R S^-1, as seen in body axes that are turned back: q is multiplied from the right
    y = _turned(point.y, _ACROSS, angle)
    c, s = np.cos(0.5 * angle), np.sin(0.5 * angle)
    w, a, b, d = y.w, y.x, y.y, y.z
    y = y._replace(w=c * w + s * d, x=c * a - s * b, y=c * b + s * a, z=c * d - s * w)
    return point._replace(y=y, action=_turned(point.action, _ACROSS, angle))


def _turn_halfway(point: Point, sign: Array) -> Point:
    return _change_phase(point, np.where(sign < 0.0, math.pi, 0.0))


def _reflect(point: Point, sign: Array) -> Point:
    def mirrored(row: Any) -> Any:
        names = [name for name in row._fields if name in _REVERSED]
        return row._replace(**{name: sign * getattr(row, name) for name in names})

    return point._replace(y=mirrored(point.y), action=mirrored(point.action))


TURN = Symmetry("turn about the vertical through the origin", _turn, angles)
PHASE = Symmetry("turn of the axes e1 and e2 about e3 (I1 = I2)", _change_phase, angles)
HALF_TURN = Symmetry("half turn of the body about e3", _turn_halfway, signs)
REFLECTION = Symmetry(
    "reflection of the world in a vertical plane and of the body in the plane of e1 and e3",
    _reflect,
    signs,
)
