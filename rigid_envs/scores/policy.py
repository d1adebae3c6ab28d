"""What plays an environment: a function of all its rows."""

from collections.abc import Callable
from typing import Any

import numpy.typing as npt

from rigid_envs.envs import RigidVectorEnv

__all__ = ["Builder", "Policy"]

Policy = Callable[[RigidVectorEnv], npt.NDArray[Any]]
"""Actions (N, n_action) of all rows, or choices (N,), from their physical states and memos."""

Builder = Callable[[Any], Policy]
"""A policy for the settings of a task."""
