"""Reorient a ball by a closed path: return to the start position with another attitude."""

from __future__ import annotations

from dataclasses import dataclass

from rigid_envs.tasks.ball_park import BallPark
from rigid_envs.tasks.fields import Number, setting

__all__ = ["BallReorient"]


@dataclass(frozen=True)
class BallReorient(BallPark):
    """Turn the ball upright and return to the start position: pure holonomy.

    `BallPark` from position 0 and an attitude uniform on SO(3). Rolling out and back along one line
    leaves the attitude unchanged; a closed path turns the ball according to the area that it
    encloses. A goal attitude other than upright would be the same task in other body axes.

    Why it is hard: rolling straight back undoes the rotation of rolling out. So the return path
    must differ from the outward path, and must enclose the right area with it.

    Physics:
        Rolling without slipping, ``v = omega x radius e_z``, makes the horizontal angular velocity
        ``omega = (-VY, VX, 0) / radius`` in world axes. A step holds the velocity, and is the
        exact rotation by ``|v| dt / radius`` about the axis ``e_z x v``. An action of length 1
        rolls a ball of any radius by `roll_per_step`.

        A small counter-clockwise loop of area A turns the ball by ``-A / radius^2`` about the
        vertical (a circle of radius rho by ``-A / radius^2 (1 - 3 (rho / radius)^2 / 4)`` to the
        next order), second order in the size of the loop. A tilt is third order, from two loops of
        opposite sense, one beside the other.

    Starting State:
        Position 0 (uniform in a square where `start_half_width` is not 0), attitude uniform on
        SO(3).

    Reference:
        The controllers of `BallPark`.

        Bound: no path is shorter than ``radius angle``, less the tolerance. Over all attitudes the
        mean angle is ``pi / 2 + 2 / pi``.

    Source:
        Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79; Jurdjevic 1993, "The
        geometry of the plate-ball problem", doi:10.1007/BF00375605; shortest paths: Arthurs & Walsh
        1986.
    """

    start_half_width: float = setting(0.0, Number("half side of the start square", "m", 0.0, 20.0))
