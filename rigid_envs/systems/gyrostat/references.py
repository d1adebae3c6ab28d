"""Controllers bound to the tasks of a gyrostat, and what they read in observations."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.mechanics import rotations
from rigid_envs.scores.policies import Controller, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, entries, goal_attitude
from rigid_envs.systems.gyrostat import controllers
from rigid_envs.systems.gyrostat.references_dual import AT_REST as AT_REST
from rigid_envs.systems.gyrostat.references_dual import DUAL_SPIN_TIME as DUAL_SPIN_TIME
from rigid_envs.systems.gyrostat.references_dual import dual_spin as dual_spin
from rigid_envs.systems.gyrostat.references_dual import ride as ride
from rigid_envs.systems.gyrostat.tasks.wheel_reorient import TwoWheels, WheelReorient
from rigid_envs.tasks.core import Core

# Controllers; of drawn moments they know the middle.


def eigenaxis(task: WheelReorient) -> Controller:
    """Turn about the axis of the rotation to the goal."""
    law = controllers.EigenaxisSlew(system_of(task), task.torque, task.capacity, task.dt)
    return feedback(law, *task.aux_names)


def three_turns(task: TwoWheels) -> Controller:
    """Turns about e1, e2 and e1, or about e2, e1 and e2."""
    law = controllers.ThreeTurns(system_of(task), task.torque, task.capacity, task.dt)
    return feedback(law, *task.aux_names)


def _slew(task: WheelReorient | TwoWheels, n_wheels: int) -> Decoder:
    satellite = system_of(task)
    rates = entries(task, "omega1", "omega2", "omega3", part="achieved_goal")
    here, there = goal_attitude(task, "achieved_goal"), goal_attitude(task, "desired_goal")
    stored = entries(task, *(f"l{k} / capacity" for k in range(1, n_wheels + 1)))

    def decode(seen: Array) -> Decoded:
        omega, l = rates(seen), np.zeros((len(seen), 3))  # noqa: E741
        l[:, :n_wheels] = task.capacity * stored(seen)
        J = np.where(satellite.wheel_moments > 0.0, satellite.wheel_moments, 1.0)
        wheels = np.where(satellite.wheel_moments > 0.0, l / J - omega, 0.0)
        y = satellite.state(q=here(seen), omega_body=omega, wheel_rates=wheels)
        return Decoded(satellite, y, dict(zip(task.aux_names, there(seen).T, strict=True)))

    return decode


def wheel_reorient(task: WheelReorient) -> Decoder:
    """Pose and goal from the goals, which noise does not touch; the spin momenta."""
    return _slew(task, 3)


def two_wheels(task: TwoWheels) -> Decoder:
    """As `wheel_reorient`, with two wheels."""
    return _slew(task, 2)


# What success asks of a motion, for planning.


def _turned(core: Core) -> list[Array]:
    """Rotation vector to the goal and angular velocity, each over its tolerance."""
    task: Any = core.task
    y, goal = core.y, core.auxiliary(*task.aux_names)
    off = rotations.log(rotations.multiply(rotations.conjugate(goal), y[:, :4]))
    return [off / task.largest_angle, y[:, 4:7] / task.rate_tolerance]


_STATE = ("w", "x", "y", "z", "omega1", "omega2", "omega3", "wheel1", "wheel2", "wheel3")
TURNED = Conditions(_STATE, _turned)
