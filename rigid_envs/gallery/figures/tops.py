"""The top of all figures of the heavy top, and its closed forms by name."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.analytic import heavy_top as theory
from rigid_envs.systems import HeavyTop

__all__ = ["PARAMETERS", "TOP", "axis_of", "closed_attitude", "start"]

Array = npt.NDArray[np.float64]

TOP = HeavyTop()  # I1 = I2 = 1, I3 = 0.5, m g ell = 1: sleeps from a spin of 4 rad/s on
PARAMETERS: dict[str, Any] = {"i_perp": TOP.I1, "i3": TOP.I3, "mgl": TOP.m * TOP.g * TOP.ell}


def start(theta: float, precession: float, omega3: float) -> Array:
    """State of the top without nutation at the first moment, phi = psi = 0.

    Args:
        theta: tilt [rad].
        precession: phi' [rad/s].
        omega3: axial angular velocity [rad/s].
    """
    euler = [0.0, theta, 0.0]
    rates = [precession, 0.0, omega3 - precession * np.cos(theta)]
    q = rotations.quaternion_from_euler(euler)
    return TOP.state(q=q, omega_body=rotations.omega_body_from_euler_rates(euler, rates))


def axis_of(q: Array) -> Array:
    """The axis e3 in the world, shape (..., 3), of attitudes, shape (..., 4)."""
    return rotations.rotate(q, np.array([0.0, 0.0, 1.0]))


def closed_attitude(t: Array, y: Array) -> Array:
    """Attitude of the top in closed form, shape (n, 4), from the state y at t = 0."""
    omega, q = y[TOP.components["omega_body"]], y[TOP.components["q"]]
    return theory.attitude(t, omega, q, **PARAMETERS)
