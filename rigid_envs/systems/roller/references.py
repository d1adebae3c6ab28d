"""Controllers bound to the tasks of a roller, what they read in observations, and bounds."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from rigid_envs.base.checks import Array, Singles
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.best import TheoreticalLimit
from rigid_envs.scores.policies import Controller, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, entries
from rigid_envs.systems.roller.controllers import LeastTime, Pump
from rigid_envs.systems.roller.tasks.roll_pump import RollPump

# Theoretical limits of metrics: optima and bounds from each start, in closed form.


def least_time(task: RollPump) -> LeastTime:
    """Least times to the rim, for the middle of drawn ranges."""
    return LeastTime(Pump(system_of(task), task.beta_change, task.dt), task.rim, task.n_substeps)


def _pump(envs: RigidVectorEnv) -> Array:
    """The better of both bounds; where parameters are drawn, that in closed form."""
    task: Any = envs.task
    swings = np.asarray(task.lower_bound(envs.y))
    if any(system != system_of(task) for system in envs.systems):
        return swings
    s = system_of(task).arc_length(envs.y)
    periods = least_time(task).periods(s, task.registered_steps())
    return np.asarray(np.maximum(swings, task.dt * periods))


ROLL_PUMP_TIME = TheoreticalLimit(
    "bound", "the least number of periods, by regions that cannot be left in fewer", _pump
)


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


# Plans of least time.


def pumped_out(task: RollPump, state: Mapping[str, Array]) -> Singles:
    """Plans from rows at their starts, shape (T, n, 1)."""
    s = system_of(task).arc_length(state["y"])
    return least_time(task).actions(s, task.registered_steps())
