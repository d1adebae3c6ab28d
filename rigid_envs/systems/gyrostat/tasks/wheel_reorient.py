"""Turn a satellite from rest to rest by its reaction wheels: by three, or by two."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, Vector, cross, dot, scaled
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import sqrt
from rigid_envs.engine.episode import Episode, clip_to_box, clip_to_square
from rigid_envs.systems.free_body.saddle import near
from rigid_envs.systems.free_body.symmetry import HALF_TURN_1, HALF_TURN_2, ROTATION_IN_SPACE
from rigid_envs.systems.free_body.tasks import reorient
from rigid_envs.systems.free_body.tasks.shared import HalfTurn, both_poses, turn
from rigid_envs.systems.gyrostat.dynamics import (
    GYROSTAT,
    Input,
    Parameters,
    State,
    momentum,
    spin_momenta,
)
from rigid_envs.systems.gyrostat.tasks.shared import BiasedWheelTask, WheelTask, biased, motor
from rigid_envs.tasks.fields import Entry, Range, physical
from rigid_envs.tasks.parts import limited
from rigid_envs.tasks.reduction import Reduction

# Reduced coordinates: the turn to the goal in axes of the carrier, half turns of carrier and goal,
# the spin momenta of the wheels. The moments are the middles of their ranges.

_FAR = 10.0  # bound of spare angles [rad], and of gyroscopic torques
_ANGLE = 3.142  # pi, and what rounding may add to it [rad]
_FULL = 2.0  # bound of spin momenta over the capacity, which a given start may exceed


@scalar
def stored(y: Any, p: Any, c: Any) -> Vector:
    """Spin momenta of the wheels over their capacity."""
    l1, l2, l3 = spin_momenta(y, p)
    return limited((l1 / c.capacity, l2 / c.capacity, l3 / c.capacity), _FULL)


@scalar
def carried(y: Any, c: Any) -> Vector:
    """I omega of the carrier over the capacity."""
    scale = 1.0 / c.capacity
    L1, L2, L3 = c.middle1 * y.omega1, c.middle2 * y.omega2, c.middle3 * y.omega3
    return limited((scale * L1, scale * L2, scale * L3), _FULL)


@scalar
def spare(theta: Vector, y: Any, c: Any) -> Vector:
    """Angles that are left after braking with full torque about each axis [rad]."""
    left = (
        reorient.spare(theta[0], y.omega1, c.middle1, c),
        reorient.spare(theta[1], y.omega2, c.middle2, c),
        reorient.spare(theta[2], y.omega3, c.middle3, c),
    )
    return limited(left, _FAR)


@scalar
def nearness(theta: Vector, y: Any, c: Any) -> tuple[float, float]:
    """Shares of the angle to the goal and of the rate, with their tolerances as halves."""
    omega = (y.omega1, y.omega2, y.omega3)
    angle, rate = sqrt(dot(theta, theta)), sqrt(dot(omega, omega))
    return near(angle, c.largest_angle), near(rate, c.rate_tolerance)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Both goals; the turn to the goal, momenta of carrier and wheels, what braking takes."""
    achieved, desired = both_poses(y, aux)
    theta = reorient.turn_left(y, aux)
    frame = reorient.sides(theta, y, c)
    gyro = scaled(1.0 / c.torque, cross(momentum(y, p), (y.omega1, y.omega2, y.omega3)))
    return (
        *achieved,
        *desired,
        *turn(theta, frame),
        *turn(carried(y, c), frame),
        *turn(stored(y, p, c), frame),
        *turn(spare(theta, y, c), frame),
        *turn(limited(gyro, _FAR), frame),
        *nearness(theta, y, c),
    )


@scalar
def observe_two_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Both goals; the turn to the goal, momentum of the carrier, what braking takes."""
    achieved, desired = both_poses(y, aux)
    theta = reorient.turn_left(y, aux)
    frame = reorient.sides(theta, y, c)
    return (
        *achieved,
        *desired,
        *turn(theta, frame),
        *turn_pair(carried(y, c), frame),
        *turn_pair(spare(theta, y, c), frame),
        *nearness(theta, y, c),
    )


@scalar
def turn_pair(a: Any, frame: Any) -> tuple[float, float]:
    """The first two components of a vector along the axes of the body."""
    return frame.sign1 * a[0], frame.sign2 * a[1]


_reduced = partial(
    Reduction,
    group="SO(3) x V4",
    frame="half turns such that what is left to turn about $e1$ and $e2$ after braking is above 0.",
    symmetries=(ROTATION_IN_SPACE, HALF_TURN_1, HALF_TURN_2),
    Frame=HalfTurn,
    frame_of=reorient.frame_of,
)
_THETA = tuple(Entry(f"theta{k}", "rad", "reduced", -_ANGLE, _ANGLE) for k in "123")
_CARRIED = tuple(Entry(f"I{k} omega{k} / capacity", "1", "reduced", -_FULL, _FULL) for k in "123")
_SPARE = tuple(Entry(f"spare{k}", "rad", "reduced", -_FAR, _FAR) for k in "123")
_NEAR = tuple(Entry(f"near {k}", "1", "x / (x + tolerance)", 0.0, 1.0) for k in ("angle", "rate"))

TURNING = _reduced(
    features=(
        *_THETA,
        *_CARRIED,
        *(Entry(f"l{k} / capacity", "1", "reduced", -_FULL, _FULL) for k in "123"),
        *_SPARE,
        *(Entry(f"gyro{k} / torque", "1", "reduced", -_FAR, _FAR) for k in "123"),
        *_NEAR,
    ),
    observe=observe_reduced,
    turn=turn,
    formulas="""
    $theta$ is the rotation vector of $q^-1 q_goal$, at most $pi$ long; `spare` is $b_k = theta_k -
    I_k omega_k |omega_k| / (2 torque)$; gyro is $L x omega$. $I omega / capacity$ and $l /
    capacity$ are limited to $+-2$, `spare` and gyro to $+-10$. $S1$ and $S2$ are the signs of $b_1$
    and $b_2$, and $S3 = S1 S2$; with them the vectors are multiplied. The last entries are the
    shares of $|theta|$ and $|omega|$ with the halves $min(angle_tolerance, pi)$ and
    $rate_tolerance$. The action $a$ acts as $(S1 a1, S2 a2, S3 a3)$.
    """,
)
"""Reduction of `WheelReorient`: SO(3), turns in space, times the half turns about the axes."""

TURNING_BY_TWO = _reduced(
    features=(*_THETA, *_CARRIED[:2], *_SPARE[:2], *_NEAR),
    observe=observe_two_reduced,
    turn=turn_pair,
    formulas="""
    $theta$, `spare`, $S1$, $S2$, the shares and the limits are those of `WheelReorient`. Momenta of
    the wheels are those of the carrier with the other sign. The action $a$ acts as $(S1 a1, S2
    a2)$.
    """,
)
"""Reduction of `TwoWheels`: as that of `WheelReorient`."""


# Turn a satellite by its wheels from rest to rest: goal environments.


class WheelTorques(NamedTuple):
    """Torques of the motors on the wheels, as fractions of the maximum."""

    u1: float
    u2: float
    u3: float


class TwoTorques(NamedTuple):
    """Torques of two motors on their wheels, as fractions of the maximum."""

    u1: float
    u2: float


class Constants(NamedTuple):
    """Torque [N m], capacity, largest bias [N m s], period [s], tolerances [rad], [rad/s].

    And the middles of the moments [kg m^2].
    """

    torque: float
    capacity: float
    bias: float
    dt: float
    largest_angle: float
    rate_tolerance: float
    middle1: float
    middle2: float
    middle3: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, reorient.Auxiliary]:
    """At rest; attitudes of carrier and goal uniform on SO(3), spin momenta uniform in a ball."""
    q, goal = randoms.quaternion(stream, 1 << 20), randoms.quaternion(stream, 1 << 21)
    return State(*q, 0.0, 0.0, 0.0, *biased(stream, p, c)), reorient.Auxiliary(*goal)


@scalar
def actuate(
    a: WheelTorques, y: State, aux: reorient.Auxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Torques of three motors."""
    l1, l2, l3 = spin_momenta(y, p)
    return y, Input(motor(a.u1, l1, c), motor(a.u2, l2, c), motor(a.u3, l3, c), 0.0, 0.0, 0.0)


@scalar
def actuate_two(
    a: TwoTorques, y: State, aux: reorient.Auxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Torques of two motors."""
    l1, l2, _ = spin_momenta(y, p)
    return y, Input(motor(a.u1, l1, c), motor(a.u2, l2, c), 0.0, 0.0, 0.0, 0.0)


@scalar
def outcome(
    y: State, u: Input, aux: reorient.Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[reorient.Auxiliary, reorient.Terms, float, bool, bool]:
    """What the goals are worth, and the torque impulse as cost."""
    achieved, desired = both_poses(y, aux)
    terms, success = reorient.judge(reorient.Goal(*achieved), reorient.Goal(*desired), c)
    return aux, terms, dt * sqrt(u.u1 * u.u1 + u.u2 * u.u2 + u.u3 * u.u3), success, False


@scalar
def observe(y: State, aux: reorient.Auxiliary, p: Parameters, c: Constants) -> Row:
    """Achieved and desired goal, omega, and spin momenta over the capacity."""
    achieved, desired = both_poses(y, aux)
    return (*achieved, *desired, *achieved[9:], *stored(y, p, c))


@scalar
def observe_two(y: State, aux: reorient.Auxiliary, p: Parameters, c: Constants) -> Row:
    """Achieved and desired goal, omega, and two spin momenta over the capacity."""
    achieved, desired = both_poses(y, aux)
    l1, l2, _ = stored(y, p, c)
    return (*achieved, *desired, *achieved[9:], l1, l2)


@dataclass(frozen=True)
class Slew(reorient.RestToRest, WheelTask):
    """A task of turning a satellite by its wheels from rest to rest."""

    J1: Range = physical(0.001, "moment of the wheel along e1", "kg m^2")
    J2: Range = physical(0.001, "moment of the wheel along e2", "kg m^2")
    angle_tolerance: float = setting(
        0.1, Number("largest angle to the goal when reached", "rad", 1e-3, 3.2)
    )
    rate_tolerance: float = setting(
        0.01, Number("largest rate off the goal when reached", "rad/s", 1e-6, 1e3)
    )
    weight_reached: float = setting(1.0, Number("weight of -1 off the goal", "1", -1e3, 1e3))
    weight_angle: float = setting(0.0, Number("weight of minus the angle", "1", -1e3, 1e3))
    weight_rate: float = setting(0.0, Number("weight of minus the rate off it", "1", -1e3, 1e3))

    def features(self) -> tuple[Entry, ...]:
        """Achieved and desired pose, angular velocity, spin momenta."""
        wheels = range(1, len(self.episode.Action._fields) + 1)
        stored = (Entry(f"l{k} / capacity", "1", "body", -_FULL, _FULL) for k in wheels)
        return (*super().features(), *stored)


_slew = partial(
    Episode,
    dynamics=GYROSTAT,
    Terms=reorient.Terms,
    Constants=Constants,
    Auxiliary=reorient.Auxiliary,
    start=start,
    outcome=outcome,
    Goal=reorient.Goal,
    judge=reorient.judge,
)


@dataclass(frozen=True)
class WheelReorient(Slew, BiasedWheelTask):
    """Turn a satellite by three reaction wheels from rest to rest at an attitude that is drawn.

    A goal environment with sparse reward. Goals are those of `Reorient`: the rotation matrix $R$
    (body to world, row by row) and the angular velocity (body axes, [rad/s]), which is zero for all
    drawn goals.

    Wheels cannot change the angular momentum of the satellite: what the carrier turns one way, they
    turn the other way. They are not at rest at the start. Their momentum stays as it is in space,
    so that it comes to lie along other wheels when the carrier turns, and bends its path meanwhile.
    A wheel at its capacity has no torque left in one sense, and the carrier turns no faster.

    Physics:
        $L = A omega + l$ is constant in space, $l' = u$ (`Gyrostat`). The motors have the torque
        `torque`, the wheels the capacity `capacity`: the torque in a period is the commanded one,
        or what takes the wheel just to its capacity. About one axis, with wheels that begin at
        rest, a turn from rest to rest by the angle $a$ takes $2 sqrt(A a / torque)$, or, where the
        wheel is full before the middle, $A a / capacity + capacity / torque$.

    Rewards:
        `reached` = 0 where angle and rate are within tolerance, else -1: the return is minus the
        number of steps away from the goal. Two dense terms have the default weight 0: `angle` =
        minus the angle to the goal [rad], and `rate` = minus the difference of the angular
        velocities [rad/s]. `compute_reward` gives the same for any pair of goals. All are computed
        from the goals as they are observed, in float32, as in `Reorient`.

    Starting State:
        At rest; the attitudes of satellite and goal are uniform on $SO(3)$ and independent, the
        spin momenta of the wheels uniform in a ball of radius `bias`.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): the angle to the
        goal is at most `angle_tolerance`, as $tr(R^T R_goal) >= 1 + 2 cos(angle_tolerance)$, and
        the difference of the angular velocities at most `rate_tolerance`.

    Reference:
        `eigenaxis` turns the satellite about the axis of the rotation to the goal, as fast as the
        weakest wheel allows, with the torque that $omega x L$ needs added: see
        `rigid_envs.systems.gyrostat.controllers.EigenaxisSlew`.

    Source:
        Wie, *Space Vehicle Dynamics and Control*, chapter 7; Wie & Barba 1985, doi:10.2514/3.19988.
    """

    J3: Range = physical(0.001, "moment of the wheel along e3", "kg m^2")

    episode: ClassVar = _slew(
        Action=WheelTorques, clip=clip_to_box, actuate=actuate, observe=observe
    )
    reduction: ClassVar = TURNING


@dataclass(frozen=True)
class TwoWheels(Slew):
    """Turn a satellite by two reaction wheels, along e1 and e2, to an attitude that is drawn.

    As `WheelReorient`, with the third wheel broken and without momentum: carrier and wheels are at
    rest at the start. So $omega3$ stays 0, whatever the motors do, and yet every attitude can be
    reached: turns about $e1$ and $e2$ do not commute, and what is left of a loop of them is a turn
    about $e3$. No smooth feedback of the state leads there (Brockett).

    Physics:
        With $L = 0$ the carrier turns at $omega = -(l1 / A1, l2 / A2, 0)$, and $l' = u$. Turns by
        the angle $a$ about $e1$, by $b$ about $e2$ and by $c$ about $e1$ again lead from any
        attitude to any other (Euler angles). A small loop that encloses the area $S$ in the plane
        of the angles about $e1$ and $e2$ turns the carrier by $S$ about $e3$.

    Rewards:
        `reached`, and the two terms `angle` and `rate` of the default weight 0, are those of
        `WheelReorient`.

    Starting State:
        At rest, with wheels at rest; the attitudes of satellite and goal are uniform on $SO(3)$ and
        independent.

    Episode End:
        As in `WheelReorient`.

    Reference:
        `three_turns` makes the three turns, each from rest to rest in the least time: see
        `rigid_envs.systems.gyrostat.controllers.ThreeTurns`.

    Source:
        Krishnan, McClamroch & Reyhanoglu 1995, Journal of Guidance, Control, and Dynamics 18(2).
    """

    bias: ClassVar = 0.0
    episode: ClassVar = _slew(
        Action=TwoTorques, clip=clip_to_square, actuate=actuate_two, observe=observe_two
    )
    reduction: ClassVar = TURNING_BY_TWO

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates at full wheels, without angular momentum."""
        return self.turned_at_most(0.0, math.sqrt(3.0) * self.capacity)
