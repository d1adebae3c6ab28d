"""The controller bound to the dual-spin turn, what it reads in observations, and a bound."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.best import TheoreticalLimit
from rigid_envs.scores.policies import Controller, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, entries
from rigid_envs.systems.gyrostat.controllers_dual import DualSpinTurn
from rigid_envs.systems.gyrostat.tasks.dual_spin import DualSpin
from rigid_envs.tasks.core import Core

# The controller; of drawn moments it knows the middle.


def ride(task: DualSpin) -> Controller:
    """Ride to the end of the separatrix, then full torque to rest."""
    rest = 0.999 * task.rate_tolerance
    return feedback(DualSpinTurn(system_of(task), task.torque, task.dt, rest, task.n_substeps))


def dual_spin(task: DualSpin) -> Decoder:
    """Angular velocity, and the spin momentum by its part of the angular momentum."""
    satellite = system_of(task)
    rates = entries(task, "omega1", "omega2", "omega3")
    direction = entries(task, *(f"L{k} / |L|" for k in "123"))
    part = entries(task, "l / |L|")

    def decode(seen: Array) -> Decoded:
        omega, n = rates(seen), direction(seen)
        # A omega = |L| (n - part e1), by least squares
        n[:, 0] -= part(seen)
        size = np.sum(satellite.carrier_moments * omega * n, axis=-1) / np.sum(n * n, axis=-1)
        wheels = np.zeros_like(omega)
        wheels[:, 0] = size * part(seen) / satellite.J1 - omega[:, 0]
        return Decoded(satellite, satellite.state(omega_body=omega, wheel_rates=wheels))

    return decode


# Least times of theory.


def _least_time(envs: RigidVectorEnv) -> Array:
    """The larger of the times of the latitude and of the motor, in whole periods [s]."""
    task: Any = envs.task
    systems: Any = envs.systems
    pairs = list(zip(systems, envs.y, strict=True))
    A = np.array([system.carrier_moments for system in systems])
    stored = np.array([np.abs(system.spin_momenta(y)[0]) for system, y in pairs])
    L = np.array([system.L_body(y) for system, y in pairs])
    size, most = np.linalg.norm(L, axis=-1), A[:, 1:].max(axis=1) * task.rate_tolerance
    latitude = np.arctanh(np.abs(L[:, 0]) / size)
    fastest = 0.5 * size * np.abs(1.0 / A[:, 1] - 1.0 / A[:, 2])
    growth = (np.arccosh(np.maximum(size / most, 1.0)) - latitude) / fastest
    missing = np.sqrt(np.maximum(size**2 - most**2, 0.0)) - A[:, 0] * task.rate_tolerance - stored
    time = np.maximum(growth, missing / task.torque)
    return np.asarray(task.dt * np.maximum(np.ceil(time / task.dt - 1e-9), 1.0))


DUAL_SPIN_TIME = TheoreticalLimit(
    "bound",
    "the latitude of $L$ grows at $(|L| / 2) |1 / A2 - 1 / A3|$ at most, $l$ at `torque`",
    _least_time,
)


# What success asks of a motion, for planning.


def _at_rest(core: Core) -> list[Array]:
    """Angular velocity over the tolerance."""
    task: Any = core.task
    return [core.y[:, 4:7] / task.rate_tolerance]


AT_REST = Conditions(("omega1", "omega2", "omega3", "wheel1"), _at_rest)
