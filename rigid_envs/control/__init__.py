"""Controllers, planners and bounds on what any of them can reach: one subject per module.

A controller is a frozen dataclass of a system and of what its actuator can do, in SI units; it
maps states y, shape (..., n), to actions, shape (..., m), inside the action space. It knows nothing
of tasks and environments. What proves that it works is part of it: a Riccati matrix, a Lyapunov
function, an invariant.
"""
