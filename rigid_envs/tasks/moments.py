"""What the tasks of a free body share: the order of its moments and a bound on its rates."""

import math

import numpy as np

from rigid_envs.errors import ConfigError
from rigid_envs.systems.free_body import fastest_turn
from rigid_envs.tasks.fields import Range, span

__all__ = ["Moments", "check_order", "fastest", "spun_up"]

Moments = tuple[Range, Range, Range]


def check_order(moments: Moments) -> None:
    """See that I1 < I2 < I3 for all values that the three ranges allow.

    Raises:
        ConfigError: two ranges touch or are in the wrong order.
    """
    I1, I2, I3 = moments
    if not span(I1)[1] < span(I2)[0]:
        raise ConfigError(f"config.I1: {I1} is not below I2 = {I2}; expected I1 < I2")
    if not span(I2)[1] < span(I3)[0]:
        raise ConfigError(f"config.I3: {I3} is not above I2 = {I2}; expected I2 < I3")


def spun_up(
    moments: Moments, rate: float, torques: tuple[float, float, float], time: float
) -> float:
    """Largest sqrt(2 T) of a body that starts at a rate and is under torques for a time.

    ``(sqrt(2 T))' = omega . tau / sqrt(2 T) <= sqrt(sum tau_k^2 / I_k)``, by Cauchy and Schwarz.

    Args:
        moments: principal moments [kg m^2].
        rate: largest norm of omega at the start [rad/s].
        torques: largest torque about each body axis [N m].
        time: for how long they act [s].
    """
    gain = sum(tau * tau / span(moment)[0] for tau, moment in zip(torques, moments, strict=True))
    return rate * math.sqrt(max(span(moment)[1] for moment in moments)) + time * math.sqrt(gain)


def fastest(moments: Moments, root: float) -> float:
    """Largest rate of the turns that motion and steps are made of [rad/s], at sqrt(2 T) = root.

    See `rigid_envs.systems.free_body.fastest_turn`; the worst body of the ranges counts.
    """
    low = [span(moment)[0] for moment in moments]
    high = max(span(moment)[1] for moment in moments)
    return root * fastest_turn(np.array([min(low), low[1], high]))
