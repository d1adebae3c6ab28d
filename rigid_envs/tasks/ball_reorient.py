"""Reorient a ball: come back to where it stands, turned, by rolling alone."""

from __future__ import annotations

from dataclasses import dataclass

from rigid_envs.tasks.ball_park import BallPark
from rigid_envs.tasks.fields import Number, setting

__all__ = ["BallReorient"]


@dataclass(frozen=True)
class BallReorient(BallPark):
    """Turn the ball upright and come back to where it stood: pure holonomy.

    `BallPark` from position 0 and an attitude uniform on SO(3). A ball that rolls out and back on
    one line is not turned at all; what turns it is the area of the loop that its centre runs round.
    A small counter-clockwise loop of area A turns it by ``-A / radius^2`` about the vertical,
    second order in the size of the loop; a tilt is third order, from two loops of opposite sense,
    one beside the other. Commanding another attitude than upright would be the same task for other
    body axes: rolling does not know how the ball is marked.

    Why it is hard: what is gained in attitude by rolling away is lost again by rolling straight
    back, so the way home must differ from the way out, and by the right area. The reward, a cost
    that knows the orders of the Lie brackets, is that of `BallPark`, and so is success: within
    `position_tolerance` and `angle_tolerance`, which ends the episode.

    Attributes:
        radius: radius of the ball [m].
        roll_per_step: largest roll in one control period [rad].
        start_half_width: half the side of the square of starting positions [m]; 0 here.
        position_tolerance: parked if the offset is at most this [m],
        angle_tolerance: and the angle of the attitude is at most this [rad].
        weight_position: weight of ``position`` = -|p|.
        weight_twist: weight of ``twist`` = -sqrt(|theta_z|).
        weight_mismatch: weight of ``mismatch`` = -cbrt(|m|).
        weight_angle: weight of ``angle`` = -|theta|.
        weight_parked: weight of ``parked`` = 1 in the step that brings the ball back upright.

    Source: Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79;
    Jurdjevic 1993, doi:10.1007/BF00375605; shortest paths: Arthurs & Walsh 1986.
    """

    start_half_width: float = setting(0.0, Number("half side of the start square", "m", 0.0, 20.0))
