"""Reduced coordinates of `BallParkGoal`: the pose relative to the goal, and rest at the goal."""

import math
from typing import Any

from rigid_envs.kernels.actions import single
from rigid_envs.kernels.algebra import Quaternion, Row, attitude, compose
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select, sincos
from rigid_envs.symmetries.balls import BODY_AXES, REFLECTION, TRANSLATION, TURN
from rigid_envs.tasks.reduced.ball_pose import POSE, pose_frame, pose_seen
from rigid_envs.tasks.reduced.planar import turned_back
from rigid_envs.tasks.reduction import Reduction

__all__ = ["goal_pose", "pose_from_goal"]

_INSIDE = 1.0 - 1e-6  # of the tolerances: there the rounded goals are reached too

_FORMULAS = """
    Frame, entries and actions are those of `BallPark`, with p the offset from the goal in radii and
    theta the rotation vector from the attitude of the goal to that of the ball, of its exact pose.
    The ball rests where distance and angle are at most 1 - 1e-6 of their tolerances.
"""


@scalar
def _from_goal(y: Any, aux: Any, p: Any) -> tuple[float, float, Quaternion]:
    """Offset [radii] from the goal, and rotation from its attitude in world axes."""
    inverse = (aux.goal_w, -aux.goal_x, -aux.goal_y, -aux.goal_z)
    q = compose(attitude(y), inverse)
    return (y.X - aux.goal_X) * p.inverse_radius, (y.Y - aux.goal_Y) * p.inverse_radius, q


@scalar
def pose_from_goal(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The pose relative to the goal, as `BallPark` shows it."""
    X, Y, q = _from_goal(y, aux, p)
    return pose_seen(pose_frame(X, Y, q), X, Y, q)


@scalar
def turn(a: Any, y: Any, aux: Any, p: Any, c: Any) -> tuple[float, float]:
    """World components of an action in the frame of the pose; none at the goal."""
    X, Y, q = _from_goal(y, aux, p)
    along, left = turned_back(pose_frame(X, Y, q), a[0], a[1])
    _, cosine = sincos(0.5 * _INSIDE * c.largest_angle)
    distance = p.radius * math.sqrt(fma(X, X, Y * Y))
    there = (distance <= _INSIDE * c.position_tolerance) & (abs(q[0]) >= cosine)
    return single(select(there, 0.0, along)), single(select(there, 0.0, left))


def goal_pose(observe: Any) -> Reduction:
    """The reduction, given the observation of both goals and the relative pose."""
    return Reduction(
        group="E(2) x SO(3)",
        frame=(
            "x along the offset from the goal, mirrored so that theta_z of the rotation from the "
            "goal is not negative. At the goal the action has no effect: the ball rests."
        ),
        symmetries=(TRANSLATION, TURN, REFLECTION, BODY_AXES),
        features=POSE,
        observe=observe,
        turn=turn,
        formulas=_FORMULAS,
    )
