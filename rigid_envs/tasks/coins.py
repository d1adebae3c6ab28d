"""Common functions of the coin's task and of its reduced frame."""

from __future__ import annotations

import math

import numpy as np

from rigid_envs.kernels.compiler import scalar

__all__ = ["FAR", "wrapped"]

FAR = 50.0  # radii; bound of observed and penalised offsets


@scalar
def wrapped(angle: float) -> float:
    """The same angle in [-pi, pi], for one in [-60 pi, 60 pi]."""
    turns: float = np.floor(angle * (0.5 / math.pi) + 0.5)
    return angle - 2.0 * math.pi * turns
