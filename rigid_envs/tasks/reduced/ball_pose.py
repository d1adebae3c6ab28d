"""Reduced coordinates of the pose of a ball relative to its goal: `BallPark` and its relatives."""

import math
from typing import Any

from rigid_envs.kernels.algebra import Quaternion, Row, Vector, attitude, log_rotation
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.symmetries.balls import REFLECTION, TURN
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduced.planar import Frame, axial_seen, frame_along, polar_seen, turn
from rigid_envs.tasks.reduction import Reduction

__all__ = ["BALL_POSE", "POSE", "POSE_FORMULAS", "pose_frame", "pose_seen"]

_FAR = 50.0  # radii; bound of observed offsets


@scalar
def pose_frame(X: float, Y: float, q: Quaternion) -> Frame:
    """x-axis along the offset, mirrored so that the rotation vector has theta_z >= 0.

    Without offset it is along the direction of rolling that tips the ball further.
    """
    sign = select(q[0] < 0.0, -1.0, 1.0)
    return frame_along(X, Y, sign * q[2], -sign * q[1], sign * q[3] < 0.0)


@scalar
def pose_seen(frame: Frame, X: float, Y: float, q: Quaternion) -> Row:
    """Invariants of an offset [radii] and an attitude; see `POSE`."""
    distance = min(polar_seen(frame, X, Y)[0], _FAR)
    theta: Vector = axial_seen(frame, log_rotation(q))
    w, x, y, z = q
    sine_square = fma(x, x, fma(y, y, z * z))
    s = math.sqrt(sine_square)
    ahead, beside = theta[0], theta[1] - distance
    return (
        distance,
        theta[0],
        theta[1],
        theta[2],
        math.sqrt(abs(theta[2])),
        fma(-2.0, sine_square, 1.0),
        2.0 * abs(w) * s,
        _signed_root(ahead),
        _signed_root(beside),
    )


@scalar
def _signed_root(x: float) -> float:
    root = math.sqrt(abs(x))
    return select(x < 0.0, -root, root)


POSE = (
    Entry("r", "1", "offset, radii", 0.0, _FAR),
    Entry("theta_x", "rad", "reduced", -math.pi, math.pi),
    Entry("theta_y", "rad", "reduced", -math.pi, math.pi),
    Entry("theta_z", "rad", "reduced", 0.0, math.pi),
    Entry("sqrt theta_z", "1", "reduced", 0.0, math.sqrt(math.pi)),
    Entry("cos abs theta", "1", "", -1.0, 1.0),
    Entry("sin abs theta", "1", "", 0.0, 1.0),
    Entry("sqrt m_x", "1", "reduced, signed root", -2.0, 2.0),
    Entry("sqrt m_y", "1", "reduced, signed root", -8.0, 8.0),
)
"""Entries of `pose_seen`: offset r, rotation vector theta, mismatch m = (theta_x, theta_y - r)."""

POSE_FORMULAS = """
    With p the offset and theta the rotation vector of Rewards, the frame has the x-axis ``(c, s) =
    p / |p|``. Where p is 0 it is along ``(theta_y, -theta_x)``, and where that is 0 too along the
    x-axis of the world; lengths below 1e-9 are 0. The side k is -1 where theta_z < 0, else 1. A
    horizontal vector (v_x, v_y) is seen as ``(c v_x + s v_y, k (c v_y - s v_x))``, and theta as
    ``(k (c theta_x + s theta_y), c theta_y - s theta_x, k theta_z)``. An action (a, b) in the frame
    is ``(c a - s k b, s a + c k b)`` in the world, rounded to float32.

    r is ``min(|p|, 50)``, and ``m = (theta_x, theta_y - r)`` in the frame, with signed roots
    ``sign(m_x) sqrt(|m_x|)``, which are not rounded off.
"""
"""The frame of a pose and the entries of `POSE`, in words."""


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The pose relative to the goal at the origin."""
    X, Y, q = y.X * p.inverse_radius, y.Y * p.inverse_radius, attitude(y)
    return pose_seen(pose_frame(X, Y, q), X, Y, q)


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame of the pose relative to the goal at the origin."""
    return pose_frame(y.X, y.Y, attitude(y))


BALL_POSE = Reduction(
    group="O(2)",
    frame="x along the offset from the goal, mirrored so that theta_z >= 0.",
    symmetries=(TURN, REFLECTION),
    features=POSE,
    observe=observe,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas=POSE_FORMULAS,
)
"""Reduction of `BallPark`: O(2), turns about the vertical through the goal and reflections."""
