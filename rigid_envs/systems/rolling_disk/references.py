"""Controllers bound to the tasks of a disk, and what they read in observations."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.scores.policies import Controller, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, entries
from rigid_envs.systems.rolling_disk.controllers import (
    CircleRegulator,
    DiskMotion,
    curvature,
    rolling,
    rolling_state,
)
from rigid_envs.systems.rolling_disk.tasks.disk_roll import DiskRoll
from rigid_envs.tasks.core import Core

# Controllers for the tasks of a coin, a disk and a roller, for the middle of drawn ranges.


def circle_regulator(task: DiskRoll) -> Controller:
    """Linear-quadratic regulator of the lean that the circle needs."""
    return feedback(CircleRegulator(system_of(task), task.torque, task.dt), "goal_curvature")


# What success asks of a motion, for planning.


def _on_circle(core: Core) -> list[Array]:
    task: Any = core.task
    goal = core.auxiliary("goal_curvature")
    wrong = (curvature(rolling(core.y)) - goal) / (task.tolerance * goal)
    return [wrong[:, None]]


def _motion(y: Array) -> Array:
    return np.stack(rolling(y), axis=-1)


ON_CIRCLE = Conditions(("w", "x", "y", "z", "omega1", "omega2", "omega3"), _on_circle, _motion)


# Decoders of the tasks of a coin, a disk and a roller.


def disk_roll(task: DiskRoll) -> Decoder:
    """Lean and rates, all of the state that counts: contact at the origin, heading and phase 0."""
    disk = task.system()
    motion = entries(task, "lean", "theta'", "wn", "w3")
    goal = entries(task, "goal curvature * radius")
    return lambda seen: Decoded(
        disk, rolling_state(DiskMotion(*motion(seen).T)), {"goal_curvature": goal(seen)}
    )
