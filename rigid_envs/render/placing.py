"""Places of parts in the world, for Panda3D and in numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.render.panda import library
from rigid_envs.render.scene import Pose

__all__ = ["from_z", "into", "transform"]

Array = npt.NDArray[np.float64]


def transform(pose: Pose) -> Any:
    """Panda3D's transform of a pose."""
    core = library()
    return core.TransformState.makePosQuatScale(
        core.Point3(*map(float, np.asarray(pose.position))),
        core.LQuaternion(*map(float, np.asarray(pose.q))),
        core.Vec3(*pose.scale),
    )


def into(pose: Pose, point: Array) -> Array:
    """A point of the world in the axes of a part."""
    offset = point - np.asarray(pose.position, dtype=np.float64)
    return np.asarray(rotations.rotate_inverse(pose.q, offset) / np.array(pose.scale))


def from_z(direction: npt.ArrayLike) -> Array:
    """Quaternion of the shortest turn from the z-axis to a unit vector."""
    x, y, z = np.asarray(direction, dtype=np.float64)
    if z < -1.0 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1.0 + z, -y, x, 0.0])
    return np.asarray(turn / np.linalg.norm(turn))
