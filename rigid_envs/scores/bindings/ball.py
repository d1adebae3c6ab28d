"""Controllers for the tasks of a ball; of drawn mass and inertia they know the middle."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.control.following import DampedFollower, FarSightedFollower, elastica_headings
from rigid_envs.control.grid import QuarterRolls
from rigid_envs.control.plate import PlateRegulator
from rigid_envs.control.polygons import PushAlong, roll_along
from rigid_envs.control.shortest_path import shortest_path
from rigid_envs.control.three_rolls import three_rolls
from rigid_envs.envs import RigidVectorEnv
from rigid_envs.scores.controllers import Controller
from rigid_envs.scores.scripts import Rows, Script
from rigid_envs.systems import DynamicBall, RollingBall
from rigid_envs.tasks import (
    BallGrid,
    BallPark,
    BallParkDynamic,
    BallParkGoal,
    BallPlate,
    BallSteer,
)

__all__ = [
    "_dynamic_ball",
    "_rolling_ball",
    "_speed",
    "along_shortest_path",
    "damped",
    "far_sighted",
    "plate_regulator",
    "pushed",
    "quarter_rolls",
    "rolled",
    "straight_rolls",
]

Array = npt.NDArray[np.float64]
_HOME = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
_REFERENCE = tuple(f"reference_{name}" for name in "wxyzXY")  # pose of the ball to be followed
_HEADING = ("heading_X", "heading_Y")  # of its path
_LONGEST = 30  # moves of an episode on the grid
_AHEAD, _ANEW = 200, 100  # steps that a follower looks ahead, and after which it looks again


def straight_rolls(envs: RigidVectorEnv, rows: Rows) -> Array:
    """Three straight rolls from where rows are to their goals, shape (n, 3, 2) [m]."""
    goals, radii = _goals(envs)[rows], _radii(envs)[rows]
    return np.asarray(three_rolls(envs.y[rows, :6], goals, radius=radii))


def rolled(task: BallPark | BallParkGoal) -> Controller:
    """Three straight rolls at the largest speed."""

    def plan(envs: RigidVectorEnv, rows: Rows) -> Array:
        reach = task.roll_per_step * _radii(envs)[rows]
        return roll_along(straight_rolls(envs, rows), reach).actions

    return Script(plan)


def along_shortest_path(task: BallPark | BallParkGoal) -> Controller:
    """The shortest path, an elastica, rolled as a polygon with one side per step."""

    def plan(envs: RigidVectorEnv, rows: Rows) -> Array:
        starts, goals, radii = envs.y[rows, :6], _goals(envs)[rows], _radii(envs)[rows]
        reach = task.roll_per_step * radii
        each = [
            shortest_path(start, goal, radius=radius).rolls_within(most)
            for start, goal, radius, most in zip(starts, goals, radii, reach, strict=True)
        ]
        longest = max(map(len, each))
        rolls = np.stack([np.pad(sides, [(0, longest - len(sides)), (0, 0)]) for sides in each])
        return roll_along(rolls, reach).actions

    return Script(plan)


def pushed(task: BallParkDynamic) -> Controller:
    """Three straight rolls, each from rest to rest, tracked by feedback."""
    law = PushAlong(_dynamic_ball(task), task.force, task.dt)

    def plan(envs: RigidVectorEnv, rows: Rows) -> Array:
        found = law.plan(envs.y[rows], straight_rolls(envs, rows))
        return np.concatenate([found.pushes, found.positions[:-1], found.velocities[:-1]], axis=-1)

    script = Script(plan)
    return lambda envs: law(envs.y, *np.split(script(envs), 3, axis=-1))


def damped(task: BallSteer) -> Controller:
    """Gradient descent of the pose error, without looking ahead."""
    law = DampedFollower(_rolling_ball(task), task.roll_per_step / task.dt)

    def policy(envs: RigidVectorEnv) -> Array:
        heading = envs.auxiliary(*_HEADING)
        return law(envs.y, envs.auxiliary(*_REFERENCE), _speed(task) * heading)

    return policy


def far_sighted(task: BallSteer) -> Controller:
    """Linear-quadratic regulator along the elastica that the reference is on."""
    law = FarSightedFollower(_rolling_ball(task), task.roll_per_step / task.dt, task.dt)
    speed = _speed(task)

    def plan(envs: RigidVectorEnv, rows: Rows) -> Array:
        heading, force = envs.auxiliary(*_HEADING)[rows], envs.auxiliary("force_X", "force_Y")[rows]
        path = heading, envs.auxiliary("curvature")[rows], force
        return law.regulator(speed * elastica_headings(*path, speed * task.dt, _AHEAD)).gain

    gains = Script(plan, _ANEW)

    def policy(envs: RigidVectorEnv) -> Array:
        heading = speed * envs.auxiliary(*_HEADING)
        return law(envs.y, envs.auxiliary(*_REFERENCE), heading, gains(envs))

    return policy


def plate_regulator(task: BallPlate) -> Controller:
    """Linear-quadratic regulator of the ball by the tilt of the table."""
    law = PlateRegulator(_dynamic_ball(task), task.tilt_rate, task.dt)
    return lambda envs: law(envs.y, envs.auxiliary("point_X", "point_Y"))


def quarter_rolls(task: BallGrid) -> Controller:
    """Shortest path home, by breadth-first search."""
    law = QuarterRolls(_rolling_ball(task), task.start_cells + _LONGEST)
    return lambda envs: law(envs.y)


def _goals(envs: RigidVectorEnv) -> Array:
    """Pose that every row is to be parked in, shape (N, 6)."""
    if envs.task.n_goal:
        return envs.auxiliary(*envs.task.aux_names)
    return np.tile(_HOME, (envs.num_envs, 1))


def _radii(envs: RigidVectorEnv) -> Array:
    """Radius of the ball of every row, shape (N,) [m]."""
    systems: list[Any] = envs.systems
    return np.array([ball.radius for ball in systems])


def _rolling_ball(task: BallSteer | BallGrid) -> RollingBall:
    ball = task.system()
    assert isinstance(ball, RollingBall)
    return ball


def _dynamic_ball(task: BallParkDynamic | BallPlate) -> DynamicBall:
    ball = task.system()
    assert isinstance(ball, DynamicBall)
    return ball


def _speed(task: BallSteer) -> float:
    """Speed of the reference [m/s]."""
    return task.reference_speed * task.roll_per_step / task.dt * _rolling_ball(task).radius
