"""Control that serves many systems: linear control, predictive control, planning.

A controller is a frozen dataclass of a system and of the limits of its actuator, in SI units; it
maps states y, shape (..., n), to actions, shape (..., m), inside the action space. It knows nothing
of tasks and environments. What proves that it works is part of it: a Riccati matrix, a Lyapunov
function, an invariant. Controllers of one system are in its folder:
`rigid_envs.systems.heavy_top.controllers`.
"""

from rigid_envs.control.linear import (
    Regulator,
    lqr,
    region_of_attraction,
    scheduled,
    simulate_closed_loop,
    step_jacobian,
    zero_order_hold,
)
from rigid_envs.control.predictive import (
    CrossEntropyChoices,
    PathIntegral,
    Prediction,
    PredictiveControl,
    PredictiveProblem,
    doubling,
)

__all__ = [
    "CrossEntropyChoices",
    "PathIntegral",
    "Prediction",
    "PredictiveControl",
    "PredictiveProblem",
    "Regulator",
    "doubling",
    "lqr",
    "region_of_attraction",
    "scheduled",
    "simulate_closed_loop",
    "step_jacobian",
    "zero_order_hold",
]
