"""Decoders of the tasks of a ball: position, attitude, and what they are to become.

Positions in radii are those of a ball of the middle radius: of what a law makes of them, actions
that are fractions of the largest, a radius that is drawn cancels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.control.grid import attitudes
from rigid_envs.references.decoding import Decoded, Decoder, attitude, entries, goal_attitude
from rigid_envs.settings import refusal
from rigid_envs.tasks import (
    BallGrid,
    BallPark,
    BallParkDynamic,
    BallParkGoal,
    BallPlate,
    BallSteer,
)
from rigid_envs.tasks.fields import span

__all__ = [
    "ball_grid",
    "ball_park",
    "ball_park_dynamic",
    "ball_park_goal",
    "ball_plate",
    "ball_steer",
]

Array = npt.NDArray[np.float64]

_PLACE = ("X / radius", "Y / radius")


def ball_park(task: BallPark) -> Decoder:
    """Position and attitude."""
    ball: Any = task.system()
    q, place = attitude(task), entries(task, *_PLACE)
    return lambda seen: Decoded(ball, ball.state(q=q(seen), position=ball.radius * place(seen)))


def ball_park_goal(task: BallParkGoal) -> Decoder:
    """Pose and goal from the goals, which are in metres."""
    low, high = span(task.radius)
    if low < high:
        raise refusal("radius", task.radius, "a number: goals are in metres, and it is not seen")
    ball: Any = task.system()
    here, there = goal_attitude(task, "achieved_goal"), goal_attitude(task, "desired_goal")
    place = entries(task, "X", "Y", part="achieved_goal")
    end = entries(task, "X", "Y", part="desired_goal")

    def decode(seen: Array) -> Decoded:
        goal = np.concatenate([there(seen), end(seen)], axis=-1)
        return Decoded(
            ball,
            ball.state(q=here(seen), position=place(seen)),
            dict(zip(task.aux_names, goal.T, strict=True)),
        )

    return decode


def ball_park_dynamic(task: BallParkDynamic) -> Decoder:
    """Position, attitude and velocity; the ball does not spin about the vertical."""
    ball: Any = task.system()
    q, place = attitude(task), entries(task, *_PLACE)
    velocity = entries(task, "VX / radius", "VY / radius")
    return lambda seen: Decoded(
        ball,
        ball.state(
            q=q(seen), position=ball.radius * place(seen), velocity=ball.radius * velocity(seen)
        ),
    )


def ball_steer(task: BallSteer) -> Decoder:
    """Pose relative to the reference, which is put upright at the origin, and its path ahead."""
    ball: Any = task.system()
    place = entries(task, "dX / radius", "dY / radius")
    turn = entries(task, "theta_x", "theta_y", "theta_z")
    action = entries(task, "VX of the reference", "VY of the reference")
    curvature = entries(task, "curvature * radius")
    force = entries(task, "force_X * radius^2", "force_Y * radius^2")

    def decode(seen: Array) -> Decoded:
        y = ball.state(q=rotations.exp(turn(seen)), position=ball.radius * place(seen))
        home = np.tile(ball.state(), (len(seen), 1))
        speed = np.linalg.norm(action(seen), axis=-1, keepdims=True)
        heading = action(seen) / np.where(speed > 0.0, speed, 1.0)
        path = np.concatenate([home, heading, force(seen) / ball.radius**2], axis=-1)
        known = dict(zip(_PATH, path.T, strict=True))
        return Decoded(ball, y, {**known, "curvature": curvature(seen) / ball.radius})

    return decode


def ball_plate(task: BallPlate) -> Decoder:
    """Ball, table, and the commanded point."""
    ball: Any = task.system()
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


def ball_grid(task: BallGrid) -> Decoder:
    """Cell and attitude, the nearest of those that there are: noise does not lead off the grid."""
    ball: Any = task.system()
    turn, place = attitude(task), entries(task, "X / cell", "Y / cell")
    side = 0.5 * np.pi * ball.radius

    def decode(seen: Array) -> Decoded:
        nearest = np.argmax(np.abs(turn(seen) @ attitudes().T), axis=-1)
        cells = np.rint(place(seen))
        return Decoded(ball, ball.state(q=attitudes()[nearest], position=side * cells))

    return decode


_PATH = (
    *(f"reference_{name}" for name in "wxyzXY"),
    *("heading_X", "heading_Y", "force_X", "force_Y"),
)
"""Parts of the auxiliary state of `BallSteer`."""
