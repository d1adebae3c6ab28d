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
from rigid_envs.scores.controllers import Controller, States
from rigid_envs.scores.scripts import Rows, Script
from rigid_envs.systems import DynamicBall, RollingBall
from rigid_envs.tasks import (
    BallGrid,
    BallPark,
    BallParkDynamic,
    BallParkGoal,
    BallPlate,
    BallSteer,
    Task,
)

__all__ = [
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


def straight_rolls(task: Task, states: States, rows: Rows) -> Array:
    """Three straight rolls from where rows are to their goals, shape (n, 3, 2) [m]."""
    goals, radii = _goals(task, states)[rows], _radii(states)[rows]
    return np.asarray(three_rolls(states.y[rows, :6], goals, radius=radii))


def rolled(task: BallPark | BallParkGoal) -> Controller:
    """Three straight rolls at the largest speed."""

    def plan(states: States, rows: Rows) -> Array:
        reach = task.roll_per_step * _radii(states)[rows]
        return roll_along(straight_rolls(task, states, rows), reach).actions

    return Script(plan)


def along_shortest_path(task: BallPark | BallParkGoal) -> Controller:
    """The shortest path, an elastica, rolled as a polygon with one side per step."""

    def plan(states: States, rows: Rows) -> Array:
        goals, radii = _goals(task, states)[rows], _radii(states)[rows]
        reach = task.roll_per_step * radii
        each = [
            shortest_path(start, goal, radius=radius).rolls_within(most)
            for start, goal, radius, most in zip(
                states.y[rows, :6], goals, radii, reach, strict=True
            )
        ]
        longest = max(map(len, each))
        rolls = np.stack([np.pad(sides, [(0, longest - len(sides)), (0, 0)]) for sides in each])
        return roll_along(rolls, reach).actions

    return Script(plan)


def pushed(task: BallParkDynamic) -> Controller:
    """Three straight rolls, each from rest to rest, tracked by feedback."""
    ball = _dynamic_ball(task)
    law, parts = PushAlong(ball, task.force, task.dt), ball.components

    def plan(states: States, rows: Rows) -> Array:
        y = states.y[rows]  # a velocity that it has, or seems to have by noise, is fed back later
        start = ball.state(q=y[:, parts["q"]], position=y[:, parts["position"]])
        found = law.plan(start, straight_rolls(task, states, rows))
        return np.concatenate([found.pushes, found.positions[:-1], found.velocities[:-1]], axis=-1)

    return Script(plan, lambda states, due: law(states.y, *np.split(due, 3, axis=-1)))


def damped(task: BallSteer) -> Controller:
    """Gradient descent of the pose error, without looking ahead."""
    law = DampedFollower(_rolling_ball(task), task.roll_per_step / task.dt)

    def policy(states: States) -> Array:
        heading = states.auxiliary(*_HEADING)
        return law(states.y, states.auxiliary(*_REFERENCE), _speed(task) * heading)

    return policy


def far_sighted(task: BallSteer) -> Controller:
    """Linear-quadratic regulator along the elastica that the reference is on."""
    law = FarSightedFollower(_rolling_ball(task), task.roll_per_step / task.dt, task.dt)
    speed = _speed(task)

    def plan(states: States, rows: Rows) -> Array:
        heading = states.auxiliary(*_HEADING)[rows]
        force = states.auxiliary("force_X", "force_Y")[rows]
        path = heading, states.auxiliary("curvature")[rows], force
        return law.regulator(speed * elastica_headings(*path, speed * task.dt, _AHEAD)).gain

    def follow(states: States, gain: Array) -> Array:
        heading = speed * states.auxiliary(*_HEADING)
        return law(states.y, states.auxiliary(*_REFERENCE), heading, gain)

    return Script(plan, follow, _ANEW)


def plate_regulator(task: BallPlate) -> Controller:
    """Linear-quadratic regulator of the ball by the tilt of the table."""
    law = PlateRegulator(_dynamic_ball(task), task.tilt_rate, task.dt)
    return lambda states: law(states.y, states.auxiliary("point_X", "point_Y"))


def quarter_rolls(task: BallGrid) -> Controller:
    """Shortest path home, by breadth-first search."""
    law = QuarterRolls(_rolling_ball(task), task.start_cells + _LONGEST)
    return lambda states: law(states.y)


def _goals(task: Task, states: States) -> Array:
    """Pose that every row is to be parked in, shape (N, 6)."""
    if task.n_goal:
        return states.auxiliary(*task.aux_names)
    return np.tile(_HOME, (len(states.y), 1))


def _radii(states: States) -> Array:
    """Radius of the ball of every row, shape (N,) [m]."""
    systems: Any = states.systems
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
