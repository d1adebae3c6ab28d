"""Controllers bound to the tasks of a thrown body, and what they read in observations."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.mechanics import rotations
from rigid_envs.scores.policies import Controller, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, attitude_of_columns, entries
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.thrown_body.controllers import CatchShot
from rigid_envs.systems.thrown_body.tasks.racket_catch import RacketCatch
from rigid_envs.tasks.core import Core

# Controllers; of drawn parameters they know the middle.


def shot(task: RacketCatch) -> Controller:
    """The least impulse that leads into the tolerance."""
    return _shot(task, 0.95)


def dead_centre(task: RacketCatch) -> Controller:
    """The least impulse that leads to the middle of the tolerance."""
    return _shot(task, 0.01)


def _shot(task: RacketCatch, share: float) -> Controller:
    body = FreeBody(*system_of(task).moments)
    law = CatchShot(body, task.torque, task.dt, share * task.tolerance)
    return feedback(law, *task.aux_names)


def racket_catch(task: RacketCatch) -> Decoder:
    """The attitude from that of the catch, the angular velocity and the time left."""
    body, left = system_of(task), entries(task, "time left / longest")
    columns = entries(task, *(f"E{i}{j}" for j in "12" for i in "123"))
    rates = entries(task, "omega1", "omega2", "omega3")

    def decode(seen: Array) -> Decoded:
        y = body.state(q=attitude_of_columns(columns(seen)), omega_body=rates(seen))
        catch = (task.longest * left(seen), *rotations.identity((len(y),)).T)
        return Decoded(body, y, dict(zip(task.aux_names, catch, strict=True)))

    return decode


# What success asks of a motion, for planning.


def _caught(core: Core) -> list[Array]:
    """Rotation vector from the attitude of the catch, over the tolerance; 0 after the catch."""
    task: Any = core.task
    left, goal = core.auxiliary("time_left"), core.auxiliary(*task.aux_names[1:])
    off = rotations.log(rotations.multiply(rotations.conjugate(goal), core.y[:, :4]))
    return [np.where((left < -0.5 * task.dt)[:, None], 0.0, off / task.tolerance)]


CAUGHT = Conditions(("w", "x", "y", "z", "omega1", "omega2", "omega3"), _caught)
