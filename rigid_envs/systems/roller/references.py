"""Controllers bound to the tasks of a roller, what they read in observations, and bounds."""

import math
from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.best import TheoreticalLimit
from rigid_envs.scores.policies import Controller, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, entries
from rigid_envs.systems.roller.controllers import Pump
from rigid_envs.systems.roller.tasks.roll_pump import RollPump

# Theoretical limits of metrics: optima and bounds from each start, in closed form.


def _pump(envs: RigidVectorEnv) -> Array:
    task: Any = envs.task
    return np.asarray(task.lower_bound(envs.y))


ROLL_PUMP_TIME = TheoreticalLimit("bound", "$n - 1/2$ half swings, $n$ the least passes", _pump)


# Controllers for the tasks of a coin, a disk and a roller, for the middle of drawn ranges.


def pump(task: RollPump) -> Controller:
    """Bang-bang control of the inertia ratio: large on the way down, small on the way up."""
    return feedback(Pump(system_of(task), task.beta_change, task.dt), "beta_change")


# Decoders of the tasks of a coin, a disk and a roller.


def roll_pump(task: RollPump) -> Decoder:
    """Arc length and velocity in the valley, and the addition to the ratio, which is positive."""
    roller = system_of(task)
    angle, speed = entries(task, "curvature s"), entries(task, "v sqrt(curvature / g)")
    addition = entries(task, "beta_change / largest")
    unit = math.sqrt(roller.g / roller.curvature)
    return lambda seen: Decoded(
        roller,
        roller.state(arc_length=angle(seen) / roller.curvature, velocity=unit * speed(seen)),
        {"beta_change": task.beta_change * np.maximum(addition(seen), 0.0)},
    )
