"""Reduced coordinates of a body that turns to a goal at rest: `Reorient`.

What is seen is the rotation from the body to its goal, about axes of the body. Half turns of body
and goal about two axes make it positive there, less what braking takes. The moments are the middles
of their ranges.
"""

import math
from typing import Any, NamedTuple

from rigid_envs.kernels.algebra import Row, Vector, attitude, compose, dot, log_rotation
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.symmetries.bodies import HALF_TURN_1, HALF_TURN_2, ROTATION
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.free_bodies import FASTEST, both_poses, observed_rates
from rigid_envs.tasks.reduced.saddle import near, within
from rigid_envs.tasks.reduction import Reduction

__all__ = ["TURNING"]

_FAR = 10.0  # bound of spare angles [rad], and of gyroscopic torques
_ANGLE = 3.142  # pi, and what rounding may add to it [rad]


class HalfTurn(NamedTuple):
    """A half turn of the body about one of its axes, or none: the signs of its coordinates."""

    sign1: float
    sign2: float
    sign3: float


@scalar
def turn_left(y: Any, aux: Any) -> Vector:
    """Rotation vector from the body to its goal, in body axes [rad]."""
    w, x, y_, z = attitude(y)
    return log_rotation(compose((w, -x, -y_, -z), (aux.goal_w, aux.goal_x, aux.goal_y, aux.goal_z)))


@scalar
def spare(angle: float, rate: float, moment: float, c: Any) -> float:
    """Angle that is left after braking with full torque about one axis [rad]."""
    left: float = angle - 0.5 / c.torque * rate * abs(rate) * moment
    return left


@scalar
def sides(theta: Vector, y: Any, c: Any) -> HalfTurn:
    """Half turn that makes the spare angles about e1 and e2 positive."""
    s1 = select(spare(theta[0], y.omega1, c.middle1, c) < 0.0, -1.0, 1.0)
    s2 = select(spare(theta[1], y.omega2, c.middle2, c) < 0.0, -1.0, 1.0)
    return HalfTurn(s1, s2, s1 * s2)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Both goals; the turn to the goal, the rates and what braking takes."""
    achieved, desired = both_poses(y, aux)
    theta = turn_left(y, aux)
    s1, s2, s3 = sides(theta, y, c)
    w1, w2, w3 = observed_rates(y, 1.0)
    angle = math.sqrt(dot(theta, theta))
    rate = math.sqrt(fma(w1, w1, fma(w2, w2, w3 * w3)))
    half = 0.5 / c.torque
    return (
        *achieved,
        *desired,
        s1 * theta[0],
        s2 * theta[1],
        s3 * theta[2],
        s1 * w1,
        s2 * w2,
        s3 * w3,
        within(s1 * spare(theta[0], w1, c.middle1, c), _FAR),
        within(s2 * spare(theta[1], w2, c.middle2, c), _FAR),
        within(s3 * spare(theta[2], w3, c.middle3, c), _FAR),
        within(half * s1 * (c.middle2 - c.middle3) * w2 * w3, _FAR),
        within(half * s2 * (c.middle3 - c.middle1) * w3 * w1, _FAR),
        within(half * s3 * (c.middle1 - c.middle2) * w1 * w2, _FAR),
        angle,
        near(angle, c.largest_angle),
        near(rate, c.rate_tolerance),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> HalfTurn:
    """Half turn after which the body is seen."""
    return sides(turn_left(y, aux), y, c)


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float, float]:
    """Torque about the axes of the body."""
    return frame.sign1 * a[0], frame.sign2 * a[1], frame.sign3 * a[2]


TURNING = Reduction(
    group="SO(3) x V4",
    frame="half turns such that what is left to turn about e1 and e2 after braking is positive.",
    symmetries=(ROTATION, HALF_TURN_1, HALF_TURN_2),
    features=(
        *(Entry(f"theta{k}", "rad", "reduced", -_ANGLE, _ANGLE) for k in (1, 2, 3)),
        *(Entry(f"omega{k}", "rad/s", "reduced", -FASTEST, FASTEST) for k in (1, 2, 3)),
        *(Entry(f"spare{k}", "rad", "reduced", -_FAR, _FAR) for k in (1, 2, 3)),
        *(Entry(f"gyro{k} / 2 torque", "1", "reduced", -_FAR, _FAR) for k in (1, 2, 3)),
        Entry("angle", "rad", "norm", 0.0, _ANGLE),
        Entry("near angle", "1", "x / (x + tolerance)", 0.0, 1.0),
        Entry("near rate", "1", "x / (x + tolerance)", 0.0, 1.0),
    ),
    observe=observe,
    Frame=HalfTurn,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    theta is the rotation vector of `q^-1 q_goal`, at most pi long; `spare_k = theta_k - Ik omega_k
    |omega_k| / (2 torque)`; gyro is `(I omega) x omega`; in the entries omega is limited to +-20.
    The signs S1, S2 are -1 where spare1, spare2 < 0, else 1, and S3 = S1 S2; with them the vectors
    are multiplied. The last entries are |theta|, `|theta| / (|theta| + min(angle_tolerance, pi))`
    and `|omega| / (|omega| + rate_tolerance)`. The action a acts as (S1 a1, S2 a2, S3 a3).
    """,
)
"""Reduction of `Reorient`: SO(3), turns in space, times the half turns about the three axes."""
