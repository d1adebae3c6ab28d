"""Pumping a roller out of its valley."""

import numpy as np
import numpy.typing as npt

from rigid_envs.tasks import RollPump

__all__ = ["pump"]

Array = npt.NDArray[np.float64]


def pump(task: RollPump, y: Array, change: Array) -> Array:
    """The bang-bang law: the ratio is large on the way down and small on the way up.

    It gains the height (1 + beta_hi) / (1 + beta_lo) in every pass, as nothing else can: see
    `RollPump`. An action is held for a control period, so place and velocity in the middle of it
    decide.

    Args:
        task: the task, with numbers for its parameters.
        y: states, shape (..., 2).
        change: what is added to the ratio at present, shape (...).

    Returns:
        Actions, shape (..., 1).

    Source: Tea & Falk 1968, "Pumping on a swing", American Journal of Physics 36.
    """
    system, half = task.system(), 0.5 * task.dt
    held = np.stack([0.0 * change, change], axis=-1)
    place = y[..., 0] + half * y[..., 1]
    velocity = y[..., 1] + half * system.rhs(y, held)[..., 1]
    return np.where(place * velocity < 0.0, 1.0, -1.0)[..., None]
