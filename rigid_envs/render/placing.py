"""Places of parts in the world, for Panda3D and in numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

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
    w, *v = np.asarray(pose.q, dtype=np.float64)
    axis = -np.array(v)
    offset = point - np.asarray(pose.position, dtype=np.float64)
    turned = offset + 2.0 * np.cross(axis, np.cross(axis, offset) + w * offset)
    return np.asarray(turned / np.array(pose.scale))


def from_z(direction: Array) -> tuple[float, float, float, float]:
    """Quaternion of the shortest turn from the z-axis to a direction."""
    x, y, z = map(float, direction)
    if z < -1.0 + 1e-12:
        return (0.0, 1.0, 0.0, 0.0)
    w = math.sqrt(0.5 * (1.0 + z))
    return (w, -y / (2.0 * w), x / (2.0 * w), 0.0)
