"""Turn a body from rest to rest at a goal attitude."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, Vector, attitude, compose, dot, log_rotation
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import atan2, fma, select, sincos
from rigid_envs.engine.episode import Episode, clip_to_box
from rigid_envs.systems.free_body.dynamics import FREE_BODY, Input, Parameters, State
from rigid_envs.systems.free_body.saddle import near, within
from rigid_envs.systems.free_body.symmetry import HALF_TURN_1, HALF_TURN_2, ROTATION_IN_SPACE
from rigid_envs.systems.free_body.tasks.shared import (
    FASTEST,
    BodyTorque,
    HalfTurn,
    TorqueTask,
    actuate,
    both_poses,
    observed_rates,
    turn,
)
from rigid_envs.tasks.fields import Entry
from rigid_envs.tasks.reduction import Reduction
from rigid_envs.tasks.task import UNIT, AuxiliaryRanges

# Reduced coordinates of a body that turns to a goal at rest: `Reorient`.
#
# What is seen is the rotation from the body to its goal, about axes of the body. Half turns of body
# and goal about two axes make it positive there, less what braking takes. The moments are the
# middles of their ranges.

_FAR = 10.0  # bound of spare angles [rad], and of gyroscopic torques
_ANGLE = 3.142  # pi, and what rounding may add to it [rad]


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
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Both goals; the turn to the goal, the rates and what braking takes."""
    achieved, desired = both_poses(y, aux)
    theta = turn_left(y, aux)
    frame = sides(theta, y, c)
    s1, s2, s3 = frame
    w1, w2, w3 = observed_rates(y, 1.0)
    angle = math.sqrt(dot(theta, theta))
    rate = math.sqrt(fma(w1, w1, fma(w2, w2, w3 * w3)))
    half = 0.5 / c.torque
    return (
        *achieved,
        *desired,
        *turn(theta, frame),
        *turn((w1, w2, w3), frame),
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


TURNING = Reduction(
    group="SO(3) x V4",
    frame="half turns such that what is left to turn about $e1$ and $e2$ after braking is above 0.",
    symmetries=(ROTATION_IN_SPACE, HALF_TURN_1, HALF_TURN_2),
    features=(
        *(Entry(f"theta{k}", "rad", "reduced", -_ANGLE, _ANGLE) for k in (1, 2, 3)),
        *(Entry(f"omega{k}", "rad/s", "reduced", -FASTEST, FASTEST) for k in (1, 2, 3)),
        *(Entry(f"spare{k}", "rad", "reduced", -_FAR, _FAR) for k in (1, 2, 3)),
        *(Entry(f"gyro{k} / 2 torque", "1", "reduced", -_FAR, _FAR) for k in (1, 2, 3)),
        Entry("angle", "rad", "norm", 0.0, _ANGLE),
        Entry("near angle", "1", "x / (x + tolerance)", 0.0, 1.0),
        Entry("near rate", "1", "x / (x + tolerance)", 0.0, 1.0),
    ),
    observe=observe_reduced,
    Frame=HalfTurn,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    $theta$ is the rotation vector of $q^-1 q_goal$, at most $pi$ long; `spare` is $b_k = theta_k -
    I_k omega_k |omega_k| / (2 torque)$; gyro is $(I omega) x omega$; in the entries $omega$ is
    limited to $+-20$. $S1$ and $S2$ are the signs of $b_1$ and $b_2$, and $S3 = S1 S2$; with them
    the vectors are multiplied. The last entries are $|theta|$ and the shares of $|theta|$ and
    $|omega|$ with the halves $min(angle_tolerance, pi)$ and $rate_tolerance$. The action $a$ acts
    as $(S1 a1, S2 a2, S3 a3)$.
    """,
)
"""Reduction of `Reorient`: SO(3), turns in space, times the half turns about the three axes."""


# Turn a body from rest to rest at a random attitude: a goal environment.


class Terms(NamedTuple):
    """Reward terms of `Reorient`."""

    reached: float
    angle: float
    rate: float


class Constants(NamedTuple):
    """Torque [N m], tolerances of angle [rad] and rate [rad/s].

    And the middles of the moments [kg m^2].
    """

    torque: float
    largest_angle: float
    rate_tolerance: float
    middle1: float
    middle2: float
    middle3: float


class Auxiliary(NamedTuple):
    """Attitude of the goal."""

    goal_w: float = 1.0
    goal_x: float = 0.0
    goal_y: float = 0.0
    goal_z: float = 0.0


class Goal(NamedTuple):
    """Observed rotation matrix, row by row, and angular velocity [rad/s]."""

    R11: float
    R12: float
    R13: float
    R21: float
    R22: float
    R23: float
    R31: float
    R32: float
    R33: float
    omega1: float
    omega2: float
    omega3: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """At rest; attitudes of body and goal uniform on SO(3)."""
    q, goal = randoms.quaternion(stream, 1 << 20), randoms.quaternion(stream, 1 << 21)
    return State(*q, 0.0, 0.0, 0.0), Auxiliary(*goal)


@scalar
def judge(achieved: Goal, desired: Goal, c: Any) -> tuple[Terms, bool]:
    """Off the goal, angle and rate; reached within both tolerances.

    The angle within tolerance is that of tr(R^T R') = 1 + 2 cos, the term that of |R - R'| =
    sqrt(8) sin(angle / 2), which is exact where the angle is small.
    """
    trace, chord, square = 0.0, 0.0, 0.0
    for k in range(9):
        trace += achieved[k] * desired[k]
        chord += (achieved[k] - desired[k]) * (achieved[k] - desired[k])
    for k in range(9, 12):
        square += (achieved[k] - desired[k]) * (achieved[k] - desired[k])
    _, cosine = sincos(c.largest_angle)
    near: bool = trace >= 1.0 + 2.0 * cosine
    reached = near & (square <= c.rate_tolerance * c.rate_tolerance)
    half = atan2(math.sqrt(chord), math.sqrt(max(8.0 - chord, 0.0)))
    terms = Terms(reached=select(reached, 0.0, -1.0), angle=-2.0 * half, rate=-math.sqrt(square))
    return terms, reached


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """What the goals are worth, and the torque impulse as cost."""
    achieved, desired = both_poses(y, aux)
    terms, success = judge(Goal(*achieved), Goal(*desired), c)
    torque = math.sqrt(u.tau1 * u.tau1 + u.tau2 * u.tau2 + u.tau3 * u.tau3)
    return aux, terms, dt * torque, success, False


@scalar
def observe(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> Row:
    """Achieved and desired goal, and omega."""
    achieved, desired = both_poses(y, aux)
    return (*achieved, *desired, *achieved[9:])


class RestToRest:
    """What tasks of turning a body from rest to rest share: the goal, an attitude without rate."""

    angle_tolerance: float

    @property
    def largest_angle(self) -> float:
        """Largest angle to the goal when reached [rad]: `angle_tolerance`, at most pi."""
        return min(self.angle_tolerance, math.pi)

    def features(self) -> tuple[Entry, ...]:
        """Achieved and desired pose, angular velocity."""
        rates = tuple(Entry(f"omega{k}", "rad/s", "body", -FASTEST, FASTEST) for k in (1, 2, 3))
        turn = (Entry(f"R{i}{j}", "1", "body to world", -1.0, 1.0) for i in "123" for j in "123")
        goal = (*turn, *rates)
        return (*goal, *goal, *rates)

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """Goals are unit quaternions."""
        return {("goal_w", "goal_x", "goal_y", "goal_z"): UNIT}


@dataclass(frozen=True)
class Reorient(RestToRest, TorqueTask):
    """Turn a body from rest to rest at an attitude drawn in every episode.

    A goal environment with sparse reward. Goals are the rotation matrix $R$ (body to world, row by
    row) and the angular velocity (body axes, [rad/s]), which is zero for all drawn goals, but not
    for goals achieved during a turn.

    The body must be accelerated and then braked in time. At the rates of a fast turn the gyroscopic
    term is as large as the torque and turns the axis of rotation in the body. The episode continues
    at the goal, where staying has the largest reward.

    Physics:
        The gyroscopic term is at most $(I_max - I_min) |omega|^2 / 2$, 1 N m at 1 rad/s for the
        default body; the torque is 0.5 N m about each axis. From rest, the rate is at most $a t$,
        $a = torque sqrt((1 / I1 + 1 / I2 + 1 / I3) / I_min)$, as the power is $omega . tau$; the
        same bound holds backwards in time from the goal. So a turn from rest to rest by an angle
        takes at least $2 sqrt(angle / a)$
        (`rigid_envs.systems.free_body.controllers.least_slew_time`).

    Rewards:
        `reached` = 0 where angle and rate are within tolerance, else -1: the return is minus the
        number of steps away from the goal. Two dense terms have the default weight 0: `angle` =
        minus the angle to the goal [rad], and `rate` = minus the difference of the angular
        velocities [rad/s]. `compute_reward` gives the same for any pair of goals. All are computed
        from the goals as they are observed, in float32: the angle is $2 arcsin(c / sqrt(8))$ with
        the norm $c$ of the difference of the matrices, at most $sqrt(8)$.

    Starting State:
        At rest; the attitudes of body and goal are uniform on $SO(3)$ and independent.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): the angle to the
        goal is at most `angle_tolerance`, as $tr(R^T R_goal) >= 1 + 2 cos(angle_tolerance)$, and
        the difference of the angular velocities at most `rate_tolerance`.

    Reference:
        `quaternion_pd` is quaternion feedback, $tau = -I (2 k vec(e) + 2 sqrt(k) omega)$ with $k =
        6 torque / I_max$ and $e$ the rotation from goal to body with the sign $w >= 0$, so that the
        body takes the shorter rotation (no unwinding).

        A half turn about $e1$ with bang-bang torque about $e1$ takes $sqrt(a I1 / torque)$ times
        the bound.

    Source:
        Wie & Barba 1985, doi:10.2514/3.19988; unwinding: Bhat & Bernstein 2000,
        doi:10.1016/S0167-6911(99)00090-0; hindsight experience replay: Andrychowicz et al. 2017,
        arXiv:1707.01495.
    """

    n_substeps: int = 2
    torque: float = setting(0.5, Number("largest torque about each axis", "N m", 1e-6, 1e6))
    angle_tolerance: float = setting(
        0.1, Number("largest angle to the goal when reached", "rad", 1e-3, 3.2)
    )
    rate_tolerance: float = setting(
        0.05, Number("largest rate off the goal when reached", "rad/s", 1e-6, 1e3)
    )
    weight_reached: float = setting(1.0, Number("weight of -1 off the goal", "1", -1e3, 1e3))
    weight_angle: float = setting(0.0, Number("weight of minus the angle", "1", -1e3, 1e3))
    weight_rate: float = setting(0.0, Number("weight of minus the rate off it", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=FREE_BODY,
        Action=BodyTorque,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        start=start,
        clip=clip_to_box,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
        Goal=Goal,
        judge=judge,
    )
    reduction: ClassVar = TURNING

    def torques(self) -> tuple[float, float, float]:
        """The same about each axis."""
        return (self.torque,) * 3

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates after full torque from rest."""
        return self.spun_up_from(0.0, duration)
