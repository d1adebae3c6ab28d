"""Controllers of all rows of an environment: those of each id."""

from collections.abc import Callable
from typing import Any

import numpy.typing as npt

from rigid_envs.envs import RigidVectorEnv
from rigid_envs.registry import ENVIRONMENTS, load

__all__ = ["Controller", "ControllerFactory", "predictive_controllers", "reference_controllers"]

Controller = Callable[[RigidVectorEnv], npt.NDArray[Any]]
"""State feedback: actions (N, n_action) of all rows, or choices (N,), from states and goals."""

ControllerFactory = Callable[[Any], Controller]
"""A function from a task, with its settings, to a controller of its rows."""


def reference_controllers(env_id: str) -> dict[str, ControllerFactory]:
    """The reference controllers of an id by name, the best first; none for an unknown id."""
    record = ENVIRONMENTS.get(env_id)
    return {} if record is None else {key: load(code) for key, code in record.controllers.items()}


def predictive_controllers(env_id: str) -> dict[str, ControllerFactory]:
    """The predictive controller of an id, "nmpc", if it has one; it needs the extra "control"."""
    record = ENVIRONMENTS.get(env_id)
    return {"nmpc": load(record.predictive)} if record is not None and record.predictive else {}
