"""Symmetry of a satellite on a circular orbit: half an orbit later all torques are the same."""

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks import symmetry


def _half_orbit(point: symmetry.Point, sign: Array) -> symmetry.Point:
    # u -> u + pi: r -> -r, of which gravity gradient and field are even functions
    later = np.where(sign < 0.0, np.pi, 0.0)
    return point._replace(y=point.y._replace(latitude=point.y.latitude + later))


HALF_ORBIT = symmetry.Symmetry("half an orbit", _half_orbit, symmetry.signs)
