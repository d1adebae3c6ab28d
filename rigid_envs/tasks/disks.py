"""Common functions of the rolling-disk tasks: rolling variables and bounds on rates."""

from __future__ import annotations

import math
from typing import NamedTuple

from rigid_envs.kernels import rolling_disk
from rigid_envs.kernels.algebra import attitude
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma
from rigid_envs.kernels.rolling_disk import State
from rigid_envs.tasks.fields import Range, span

__all__ = ["TIGHT", "Rolling", "fastest_disk", "rolling", "threshold"]

TIGHT = 10.0  # bound of observed curvature times radius
_STEPS = 200  # number of steps in cos(theta) for the integration of rates


class Rolling(NamedTuple):
    """Lean, its rate, turn rate wn and roll rate w3 [rad/s], path curvature times radius."""

    sin_lean: float
    cos_lean: float
    lean_rate: float
    turn_rate: float
    roll_rate: float
    curvature: float


@scalar
def rolling(y: State) -> Rolling:
    """Rolling variables of a state.

    The path of the contact turns at phi' = wn / cos(lean), and its speed is the radius times psi' =
    w3 + wn tan(lean). (The lean is theta - pi / 2.)
    """
    n1, n2, s, c = rolling_disk.inclination(attitude(y))
    wn, wl = fma(n1, y.omega1, n2 * y.omega2), fma(n1, y.omega2, -n2 * y.omega1)
    psi_rate = y.omega3 - wn * c / s
    curvature = wn / s * psi_rate / max(psi_rate * psi_rate, 1e-9)
    return Rolling(
        sin_lean=-c,
        cos_lean=s,
        lean_rate=-wl,
        turn_rate=wn,
        roll_rate=y.omega3,
        curvature=min(max(curvature, -TIGHT), TIGHT),
    )


def threshold(mgr: float, I1: float, I3: float, rim: float) -> float:
    """Roll rate [rad/s] above which upright rolling is stable.

    ``I3 (I3 + m r^2) w3^2 = I1 m g r``: w3^2 = g / (3 r) for a disk, g / (4 r) for a hoop.

    Args:
        mgr: m g radius [N m].
        I1: moment about a diameter [kg m^2].
        I3: moment about the axis [kg m^2].
        rim: m radius^2 [kg m^2].

    Source: Routh, *Advanced Rigid Dynamics*, section 244.
    """
    return math.sqrt(mgr * I1 / (I3 * (I3 + rim)))


def fastest_disk(
    parameters: tuple[Range, Range, Range, Range, Range],
    speed: float,
    turn: float,
    torque: float,
) -> float:
    """Bound on the rate [rad/s] until the lean is 60 degrees, as in `RollingDisk.rate_and_growth`.

    Under any lean torque, wn and w3 depend on theta alone. With c = cos(theta), ``d(wn
    sin(theta))/dc = -(I3 / I1) w3`` and ``dw3/dc = -m r^2 / (I3 + m r^2) wn / sin(theta)``: both
    are integrated from upright in the sense in which both grow. The remaining energy, plus the work
    of the torque over 120 degrees, bounds the lean rate.

    Args:
        parameters: m, radius, I1, I3 and g, numbers or ranges.
        speed: largest w3 at the start / `threshold`.
        turn: largest wn and wl at the start [rad/s].
        torque: largest lean torque [N m].

    Source: Routh, *Advanced Rigid Dynamics*, section 244.
    """
    low = [span(value)[0] for value in parameters]
    m, radius, I1, I3, g = (span(value)[1] for value in parameters)
    rim, least = m * radius**2, low[0] * low[1] ** 2
    w3 = speed * threshold(m * g * radius, I1, low[3], least)
    across, h = turn, 0.5 * math.sqrt(3.0) / _STEPS
    for k in range(1, _STEPS + 1):
        sine = math.sqrt(1.0 - (h * k) ** 2)
        w3 += h * rim / (low[3] + rim) * across / sine**2
        across += h * I3 / low[2] * w3
    wn = across / sine
    energy = m * g * radius + I1 * wn**2 + (I3 + rim) * w3**2 + 8.0 * math.pi / 6.0 * torque
    wl = math.sqrt(energy / (low[2] + least) + turn**2)
    return w3 + math.sqrt(wn**2 + wl**2) / sine + math.sqrt(g / low[1])
