"""What plays an environment: a function of all its rows."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.envs import RigidVectorEnv

__all__ = ["Builder", "Policy"]

Policy = Callable[[RigidVectorEnv], npt.NDArray[np.float64]]
"""Actions (N, n_action) of all rows, from their physical states and memos."""

Builder = Callable[[Any], Policy]
"""A policy for the settings of a task."""
