"""Reduced coordinates of `BallParkDynamic`: velocity, and the pose in which the ball can stop."""

import math
from typing import Any

from rigid_envs.kernels.algebra import Quaternion, Row, attitude, compose
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select, sincos
from rigid_envs.symmetries.balls import REFLECTION, TURN
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduced.ball_pose import POSE, pose_frame, pose_seen
from rigid_envs.tasks.reduced.planar import Frame, polar_seen, turn
from rigid_envs.tasks.reduction import Reduction

__all__ = ["DYNAMIC_POSE"]

_FAR, _FAST = 50.0, 50.0  # radii, radii per second; bounds of the observation


@scalar
def _stopped(y: Any, p: Any, c: Any) -> tuple[float, float, Quaternion]:
    """Offset [radii] and attitude of the ball after it has braked along a straight line.

    From the speed v it rolls on by v^2 / 2 a, with the deceleration a of the largest force.
    """
    VX, VY = y.VX * p.inverse_radius, y.VY * p.inverse_radius
    speed = math.sqrt(fma(VX, VX, VY * VY))
    far = 0.5 * speed * p.radius / c.deceleration  # of the velocity: the time of braking, halved
    half_sine, cosine = sincos(0.5 * far * speed)
    s = half_sine / max(speed, 1e-12)
    rolled = (cosine, -s * VY, s * VX, 0.0)
    X, Y = fma(far, VX, y.X * p.inverse_radius), fma(far, VY, y.Y * p.inverse_radius)
    return X, Y, compose(rolled, attitude(y))


@scalar
def _frame(X: float, Y: float, q: Quaternion, p: Any) -> Frame:
    """That of the pose in which the ball stops; not mirrored on a turntable, which has a sense."""
    frame = pose_frame(X, Y, q)
    return Frame(frame.cosine, frame.sine, select(p.turntable_rate == 0.0, frame.side, 1.0))


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The pose after braking, as `BallPark` shows a pose; present offset and velocity."""
    X, Y, q = _stopped(y, p, c)
    frame = _frame(X, Y, q, p)
    ahead, left = polar_seen(frame, y.X * p.inverse_radius, y.Y * p.inverse_radius)
    fast, across = polar_seen(frame, y.VX * p.inverse_radius, y.VY * p.inverse_radius)
    return (
        *pose_seen(frame, X, Y, q),
        min(max(ahead, -_FAR), _FAR),
        min(max(left, -_FAR), _FAR),
        min(max(fast, -_FAST), _FAST),
        min(max(across, -_FAST), _FAST),
        min(math.sqrt(fma(fast, fast, across * across)), _FAST),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame of the pose after braking."""
    X, Y, q = _stopped(y, p, c)
    return _frame(X, Y, q, p)


DYNAMIC_POSE = Reduction(
    group="O(2)",
    frame=(
        "that of `BallPark` for the pose in which the ball stops if it brakes at once; on a "
        "turntable it is not mirrored."
    ),
    symmetries=(TURN, REFLECTION),
    features=(
        *POSE,
        Entry("X / radius", "1", "reduced", -_FAR, _FAR),
        Entry("Y / radius", "1", "reduced", -_FAR, _FAR),
        Entry("VX / radius", "1/s", "reduced", -_FAST, _FAST),
        Entry("VY / radius", "1/s", "reduced", -_FAST, _FAST),
        Entry("abs V / radius", "1/s", "", 0.0, _FAST),
    ),
    observe=observe,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        The ball would roll on by ``d = |V| V / (2 a)``, a = F / (m (1 + beta)) with the largest
        force F. Frame, the entries 0 to 8 and the action are those of `BallPark` for the offset
        ``(X, Y) + d`` and the attitude after the rotation by ``|d| / radius`` about ``e_z x d``,
        also on a turntable; there the side k is 1, and theta_z from -pi. The other entries are the
        present offset and velocity, seen as horizontal vectors, and the speed, each within its
        bounds.
    """,
)
"""Reduction of `BallParkDynamic`; the first entries are those of the pose after braking."""
