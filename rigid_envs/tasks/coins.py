"""Common functions of the coin's task and of its reduced frame: the pose relative to the goal."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import atan2
from rigid_envs.kernels.upright_coin import Parameters, State

__all__ = ["FAR", "Pose", "pose"]

FAR = 50.0  # radii; bound of observed and penalised offsets


class Pose(NamedTuple):
    """Offset [radii], heading phi, phase psi and mismatch ``X + psi`` [rad], within half a turn."""

    X: float
    Y: float
    heading: float
    phase: float
    mismatch: float


@scalar
def wrapped(angle: float) -> float:
    """The same angle in [-pi, pi], for one in [-60 pi, 60 pi]."""
    turns: float = np.floor(angle * (0.5 / math.pi) + 0.5)
    return angle - 2.0 * math.pi * turns


@scalar
def pose(y: State, p: Parameters) -> Pose:
    """Pose relative to the goal at the origin, heading and phase 0."""
    X, Y = y.X / p.radius, y.Y / p.radius
    total, difference = atan2(y.z, y.w), atan2(y.y, y.x)
    heading, phase = wrapped(total + difference), wrapped(total - difference)
    return Pose(X, Y, heading, phase, wrapped(max(min(X, FAR), -FAR) + phase))
