"""Controllers bound to the tasks of a tippe top, and what they read in observations."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.mechanics import rotations
from rigid_envs.scores.policies import Controller, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, attitude, entries
from rigid_envs.systems.spheroid.controllers import TippeTopSpin
from rigid_envs.systems.spheroid.tasks.tippe_top import TippeTop
from rigid_envs.tasks.core import Core

# Controllers; of drawn parameters they know the middle.


def two_spins(task: TippeTop) -> Controller:
    """A spin that lets the top rise, and one of the other sense in the body, to stand."""
    return feedback(_spin(task, rise=0.8))


def spin_up(task: TippeTop) -> Controller:
    """One spin at the beginning."""
    return feedback(_spin(task, rise=1.08))


def _spin(task: TippeTop, rise: float) -> TippeTopSpin:
    needed, arm = task.needed, 0.5 * task.reach
    return TippeTopSpin(system_of(task), task.torque, task.dt, rise * needed, 1.08 * needed, arm)


def tippe_top(task: TippeTop) -> Decoder:
    """The angular velocity is observed in world axes; the place is not, and does not matter."""
    top, attitude_of = system_of(task), attitude(task)
    rates, velocity = entries(task, "omega_x", "omega_y", "omega_z"), entries(task, "VX", "VY")

    def decode(seen: Array) -> Decoded:
        q = attitude_of(seen)
        omega = rotations.rotate_inverse(q, rates(seen))
        return Decoded(top, top.state(q=q, omega_body=omega, velocity=velocity(seen)))

    return decode


# What success asks of a motion, for planning.


def _inverted(core: Core) -> list[Array]:
    """The angle of -e3 from the vertical in two directions, over the tolerance."""
    task: Any = core.task
    axis = -rotations.rotate(core.y[:, :4], np.array([0.0, 0.0, 1.0]))
    length = np.linalg.norm(axis[:, :2], axis=-1, keepdims=True)
    angle = np.arctan2(length, axis[:, 2:])
    return [angle * axis[:, :2] / np.maximum(length, 1e-300) / task.tolerance]


def _in_space(y: Array) -> Array:
    """Whatever its phase and place: the axis, omega and the velocity in world axes."""
    q = rotations.normalize(y[:, :4])
    axis = rotations.rotate(q, np.array([0.0, 0.0, 1.0]))
    return np.concatenate([axis, rotations.rotate(q, y[:, 4:7]), y[:, 7:]], axis=1)


_TOP = ("w", "x", "y", "z", "omega1", "omega2", "omega3", "VX", "VY")
INVERTED = Conditions(_TOP, _inverted, _in_space)
