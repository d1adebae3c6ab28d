"""Controllers of all rows of an environment: those of each id."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from rigid_envs.registry import ENVIRONMENTS, load
from rigid_envs.systems import System

__all__ = [
    "Controller",
    "ControllerFactory",
    "States",
    "predictive_controllers",
    "reference_controllers",
]


class States(Protocol):
    """What a controller reads of N rows: native rows have it, and so has a decoded observation."""

    @property
    def y(self) -> npt.NDArray[np.float64]:
        """Physical states, shape (N, n_state)."""

    @property
    def systems(self) -> Sequence[System]:
        """The physical system of every row."""

    def auxiliary(self, *names: str) -> npt.NDArray[np.float64]:
        """Parts of the auxiliary state, by name: shape (N,), or (N, k) of k > 1 names."""


Controller = Callable[[Any], npt.NDArray[Any]]
"""Actions (N, n_action) of all rows, or choices (N,), from their `States`.

One that reads more takes a `RigidVectorEnv`, and acts in native rows only.
"""

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
