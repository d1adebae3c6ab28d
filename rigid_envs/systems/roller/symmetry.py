"""Symmetry of a roller in a valley."""

from rigid_envs.base.checks import Array
from rigid_envs.tasks.symmetry import Point, Symmetry, signs


def _reflect(point: Point, sign: Array) -> Point:
    # the action changes the inertia, which has no direction
    y = point.y
    return point._replace(y=y._replace(s=sign * y.s, v=sign * y.v))


REFLECTION = Symmetry("reflection in the vertical through the bottom", _reflect, signs)
