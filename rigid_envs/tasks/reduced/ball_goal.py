"""Reduced coordinates of `BallParkGoal`: the pose relative to the goal, and rest at the goal."""

import math
from typing import Any, NamedTuple

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


class _Frame(NamedTuple):
    """Frame of the pose; `away` is 0 at the goal, else 1."""

    cosine: float
    sine: float
    side: float
    away: float


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
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> _Frame:
    """Frame of the pose, and whether the ball is at the goal."""
    X, Y, q = _from_goal(y, aux, p)
    frame = pose_frame(X, Y, q)
    _, cosine = sincos(0.5 * _INSIDE * c.largest_angle)
    distance = p.radius * math.sqrt(fma(X, X, Y * Y))
    there = (distance <= _INSIDE * c.position_tolerance) & (abs(q[0]) >= cosine)
    return _Frame(frame.cosine, frame.sine, frame.side, away=select(there, 0.0, 1.0))


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float]:
    """World components of an action in the frame of the pose; none at the goal."""
    along, left = turned_back(frame, a[0], a[1])
    return single(frame.away * along), single(frame.away * left)


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
        Frame=_Frame,
        frame_of=frame_of,
        turn=turn,
        formulas=_FORMULAS,
    )
