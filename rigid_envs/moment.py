"""One row of an environment at one moment: what is drawn, recorded and replayed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

__all__ = ["Moment"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Moment:
    """State of one row and the results of its last step.

    Attributes:
        y: physical state, shape (n_state,).
        u: physical input of the last step, shape (n_input,); zeros after a reset.
        parameters: parameters of the system by name, of this episode.
        aux: auxiliary state of the task (goal, counters) by name.
        action: last action, shape (n_action,), each in [-1, 1] (or the choice).
        time: time since the reset [s].
        reward: last reward.
        cost: last cost, in ``task.cost_unit``.
        success: whether the last step was a success.
    """

    y: Array
    u: Array
    parameters: Mapping[str, float]
    aux: Mapping[str, float] = field(default_factory=dict)
    action: Array = field(default_factory=lambda: np.zeros(0))
    time: float = 0.0
    reward: float = 0.0
    cost: float = 0.0
    success: bool = False
