"""Accuracy of the free body: energy, |L|^2 and angular velocity against the closed form."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.analytic import free_body
from rigid_envs.systems import FreeBody

__all__ = ["OMEGA0", "FreeRun", "errors", "free_run"]

OMEGA0 = (0.01, 1.0, 0.01)
"""Initial angular velocity [rad/s], body axes: beside the unstable axis, so that it flips."""


@dataclass(frozen=True)
class FreeRun:
    """Errors of a torque-free run.

    Attributes:
        dt: step [s].
        duration: simulated time [s].
        energy: largest relative error of the energy.
        L_squared: largest relative error of |L|^2.
        omega_end: error of omega at the end [rad/s].
        omega_largest: largest error of omega [rad/s]; most of it is a shift in time of a flip.
    """

    dt: float
    duration: float
    energy: float
    L_squared: float
    omega_end: float
    omega_largest: float


def free_run(dt: float, duration: float) -> FreeRun:
    """Simulate the default body without torque.

    Args:
        dt: step [s].
        duration: simulated time [s].
    """
    body = FreeBody()
    t = dt * np.arange(round(duration / dt) + 1)
    start = body.state(omega_body=OMEGA0)
    path = body.simulate(start, t, max_step=1.001 * dt)  # one step per interval: times are rounded
    return errors(t, path["omega_body"])


def errors(t: npt.NDArray[Any], omega: npt.NDArray[Any]) -> FreeRun:
    """Errors of a torque-free run of the default body that starts at `OMEGA0`.

    Args:
        t: times [s], shape (M,).
        omega: angular velocity at these times, body axes [rad/s], shape (M, 3).
    """
    body = FreeBody()
    L = body.moments * omega
    energy = 0.5 * np.sum(L * omega, axis=-1)
    square = np.sum(L * L, axis=-1)
    exact = free_body.omega(t, body.moments, OMEGA0)
    error = np.max(np.abs(omega - exact), axis=-1)
    return FreeRun(
        dt=float(t[1] - t[0]),
        duration=float(t[-1]),
        energy=float(np.max(np.abs(energy / energy[0] - 1.0))),
        L_squared=float(np.max(np.abs(square / square[0] - 1.0))),
        omega_end=float(error[-1]),
        omega_largest=float(error.max()),
    )
