"""Controllers bound to the tasks of a ball with inertia, what they observe, and bounds."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.control.predictive import PredictiveControl, doubling
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.best import TheoreticalLimit, _rows, least_time
from rigid_envs.scores.policies import (
    PREDICTION_PERIOD,
    Controller,
    Rows,
    Script,
    States,
    feedback,
    predicting,
    system_of,
)
from rigid_envs.scores.references import Decoded, Decoder, attitude, entries
from rigid_envs.systems.dynamic_ball.controllers import HeldBall, PlateRegulator, PushAlong
from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import BallParkDynamic
from rigid_envs.systems.dynamic_ball.tasks.ball_plate import BallPlate
from rigid_envs.systems.rolling_ball.references import _PLACE, _POSE, _pose, _roll, straight_rolls
from rigid_envs.tasks.core import Core

# Theoretical limits of metrics: optima and bounds from each start, in closed form.


def _push(envs: RigidVectorEnv) -> Array:
    """Least time [s] to push a ball along the length of `_roll`, with its inertia."""
    task: Any = envs.task
    inertia = _rows(envs, "m") * (1.0 + _rows(envs, "beta"))
    return least_time(_roll(envs), task.force / inertia, task.speed_tolerance)


PUSHED_BALL_TIME = TheoreticalLimit(
    "bound", "$2 sqrt(length (1 + beta) m / F)$, less the tolerances", _push
)


# Controllers for the tasks of a ball; of drawn mass and inertia they know the middle.


def pushed(task: BallParkDynamic) -> Controller:
    """Three straight rolls, each from rest to rest, tracked by feedback."""
    ball = system_of(task)
    controller, parts = PushAlong(ball, task.force, task.dt), ball.components

    def plan(states: States, rows: Rows) -> Array:
        y = states.y[rows]  # a velocity that it has, or seems to have by noise, is fed back later
        start = ball.state(q=y[:, parts["q"]], position=y[:, parts["position"]])
        found = controller.plan(start, straight_rolls(task, states, rows))
        return np.concatenate([found.pushes, found.positions[:-1], found.velocities[:-1]], axis=-1)

    return Script(plan, lambda states, due: controller(states.y, *np.split(due, 3, axis=-1)))


def plate_regulator(task: BallPlate) -> Controller:
    """Linear-quadratic regulator of the ball by the tilt of the table."""
    return feedback(PlateRegulator(system_of(task), task.tilt_rate, task.dt), "point_X", "point_Y")


# Predictive controllers; of drawn parameters they know the middle. They need CasADi.


def held_ball(task: BallPlate) -> Controller:
    """Least distance over a horizon of 32 control periods."""
    problem = HeldBall(system_of(task), task.tilt_rate, task.tilt_limit, task.dt)
    controller = PredictiveControl(problem, doubling(task.dt, 4, 8, 3))
    return predicting(
        controller, task.dt, PREDICTION_PERIOD, lambda envs: envs.auxiliary("point_X", "point_Y")
    )


# Decoders of the tasks of a ball: position, attitude, and what they are to become.
#
# Positions in radii are those of a ball of the middle radius: of what a controller makes of them,
# actions that are fractions of the largest, a radius that is drawn cancels.


def ball_park_dynamic(task: BallParkDynamic) -> Decoder:
    """Position, attitude and velocity; the ball does not spin about the vertical."""
    ball = system_of(task)
    q, place = attitude(task), entries(task, *_PLACE)
    velocity = entries(task, "VX / radius", "VY / radius")
    return lambda seen: Decoded(
        ball,
        ball.state(
            q=q(seen), position=ball.radius * place(seen), velocity=ball.radius * velocity(seen)
        ),
    )


def ball_plate(task: BallPlate) -> Decoder:
    """Ball, table, and the commanded point."""
    ball = system_of(task)
    q, place = attitude(task, needed=False), entries(task, "X", "Y")
    offset, velocity = entries(task, "X - X*", "Y - Y*"), entries(task, "VX", "VY")
    spin, tilt = entries(task, "spin"), entries(task, "alpha_x / limit", "alpha_y / limit")
    rate = entries(task, "alpha_x' / limit", "alpha_y' / limit")

    def decode(seen: Array) -> Decoded:
        y = ball.state(
            q=q(seen),
            position=place(seen),
            velocity=velocity(seen),
            spin=spin(seen),
            tilt=task.tilt_limit * tilt(seen),
            tilt_rate=task.tilt_rate * rate(seen),
        )
        point = place(seen) - offset(seen)
        return Decoded(ball, y, {"point_X": point[:, 0], "point_Y": point[:, 1]})

    return decode


# What success asks of a motion, for planning.


def _stopped(core: Core) -> list[Array]:
    task: Any = core.task
    y = core.y
    return [*_pose(y, None, task), y[:, 6:8] / task.speed_tolerance]


def _held(core: Core) -> list[Array]:
    task: Any = core.task
    return [(core.y[:, 4:6] - core.auxiliary("point_X", "point_Y")) / task.tolerance]


STOPPED = Conditions((*_POSE, "VX", "VY"), _stopped)
_TABLE = ("spin", "alpha_x", "alpha_y", "rate_x", "rate_y")
HELD = Conditions(("X", "Y", "VX", "VY", *_TABLE), _held, n_parts=6)
