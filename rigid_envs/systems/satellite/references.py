"""Controllers bound to the tasks of a satellite, and what they read in observations."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import TheoreticalLimit
from rigid_envs.scores.policies import Controller, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, attitude_of_columns, entries
from rigid_envs.systems.satellite.controllers import FieldBrake
from rigid_envs.systems.satellite.tasks.magnetic_detumble import MagneticDetumble
from rigid_envs.tasks.core import Core


def _least_time(envs: RigidVectorEnv) -> Array:
    """Time of the largest torques for the momentum that is too much, in whole periods [s]."""
    task: Any = envs.task
    satellites: Any = envs.systems
    strongest = [each.b * np.sqrt(1.0 + 3.0 * np.sin(each.inclination) ** 2) for each in satellites]
    pairs = zip(satellites, envs.y, strict=True)
    L = np.array([np.linalg.norm(each.L_body(y)) for each, y in pairs])
    rest = np.array([each.moments.max() for each in satellites]) * task.rate_tolerance
    gravity = np.array([1.5 * each.n**2 * np.ptp(each.moments) for each in satellites])
    time = (L - rest) / (task.dipole * np.array(strongest) + gravity)
    periods = np.ceil(time / task.dt - 1e-9)
    return np.asarray(task.dt * np.maximum(periods, 1.0))


DETUMBLE_TIME = TheoreticalLimit(
    "bound",
    "$|L|$ falls at `dipole` times $b sqrt(1 + 3 sin(i)^2)$ at most, and by gravity",
    _least_time,
)


def b_dot(task: MagneticDetumble) -> Controller:
    """Brake across the field, at a gain matched to its turning."""
    return feedback(FieldBrake(system_of(task), task.dipole))


def magnetic_detumble(task: MagneticDetumble) -> Decoder:
    """Attitude by the field and by what it turns by, both known in space; angular velocity."""
    satellite = system_of(task)
    rates = entries(task, *(f"omega{k} / start_rate" for k in "123"))
    field = entries(task, *(f"B{k} / b" for k in "123"))
    turn, place = entries(task, "h1", "h2", "h3"), entries(task, "cos 2u", "sin 2u")

    def decode(seen: Array) -> Decoded:
        cosine, sine = place(seen).T
        u = 0.5 * np.arctan2(sine, cosine)
        there = satellite.state(q=(1.0, 0.0, 0.0, 0.0), latitude=u)
        h = np.stack([cosine, sine, np.zeros_like(u)], axis=-1)
        world = attitude_of_columns(np.concatenate([h, satellite.field_body(there)], axis=-1))
        body = attitude_of_columns(np.concatenate([turn(seen), field(seen)], axis=-1))
        q = rotations.multiply(world, rotations.conjugate(body))
        omega = task.largest_start_rate * rates(seen)
        return Decoded(satellite, satellite.state(q=q, omega_body=omega, latitude=u))

    return decode


def _at_rest(core: Core) -> list[Array]:
    """Angular velocity over the tolerance."""
    task: Any = core.task
    return [core.y[:, 4:7] / task.rate_tolerance]


AT_REST = Conditions(("w", "x", "y", "z", "omega1", "omega2", "omega3", "latitude"), _at_rest)
