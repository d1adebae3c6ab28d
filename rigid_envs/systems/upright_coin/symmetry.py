"""Symmetries of an upright coin relative to its goal, at the origin with heading and phase 0.

The attitude Rz(phi) Rx(pi / 2) Rz(psi) has the quaternion (cos a, cos b, sin b, sin a) / sqrt(2)
with a = (phi + psi) / 2 and b = (phi - psi) / 2.
"""

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks.symmetry import Point, Symmetry, everywhere, reversed_in, signs


def _reflect_aside(point: Point, sign: Array) -> Point:
    # phi -> -phi: a becomes -b, and b becomes -a
    y, action, kept = point.y, point.action, sign > 0.0
    y = y._replace(
        w=np.where(kept, y.w, y.x),
        x=np.where(kept, y.x, y.w),
        y=np.where(kept, y.y, -y.z),
        z=np.where(kept, y.z, -y.y),
        Y=sign * y.Y,
        steer_rate=sign * y.steer_rate,
    )
    return point._replace(y=y, action=action._replace(steer_rate=sign * action.steer_rate))


def _reflect_ahead(point: Point, sign: Array) -> Point:
    # phi -> -phi and psi -> -psi: a and b are reversed
    names = ("y", "z", "X", "steer_rate", "roll_rate")
    return everywhere(point, lambda row: reversed_in(row, names, sign))


ALONG = Symmetry("reflection in the plane of the coin at the goal", _reflect_aside, signs)
ACROSS = Symmetry("reflection across the plane of the coin at the goal", _reflect_ahead, signs)
