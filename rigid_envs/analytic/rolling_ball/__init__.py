"""Attitude of a ball that rolls without slip on the plane z = 0, in closed form.

v = omega x radius e_z in world axes, so that omega = (-v_y / radius, v_x / radius, spin). Straight
rolls are rotations about horizontal axes; along a circle omega is constant in a frame that turns
with the centre, and two rotations are enough. What is left when the centre is back is the holonomy:
a small counter-clockwise loop of area A turns the ball by -A / radius^2 about the vertical.

A *turn* is the rotation that the roll added, a unit quaternion (w, x, y, z) in world axes:
attitude after = turn * attitude before.

Sources: Hammersley (1983), Oxford commemoration ball, in Probability, Statistics and Analysis, LMS
Lecture Notes 79; Jurdjevic (1993), Arch. Rational Mech. Anal. 124:305, doi:10.1007/BF00375605.
"""

from rigid_envs.analytic.rolling_ball._arrangements import ARRANGEMENTS, Arrangement
from rigid_envs.analytic.rolling_ball._circle import (
    circle_holonomy,
    circle_rotation_vector,
    roll_circle,
)
from rigid_envs.analytic.rolling_ball._clothoid import clothoid_path, complete_clothoid_angle
from rigid_envs.analytic.rolling_ball._straight import roll_polygon, roll_segments, roll_straight

__all__ = [
    "ARRANGEMENTS",
    "Arrangement",
    "circle_holonomy",
    "circle_rotation_vector",
    "clothoid_path",
    "complete_clothoid_angle",
    "roll_circle",
    "roll_polygon",
    "roll_segments",
    "roll_straight",
]
