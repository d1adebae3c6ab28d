"""Park a ball: reach a position and an attitude by rolling without slipping."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rigid_envs import rotations
from rigid_envs.kernels import randoms
from rigid_envs.kernels.actions import clip_to_disk
from rigid_envs.kernels.algebra import attitude, log_rotation
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import cbrt, select
from rigid_envs.kernels.episode import Episode, NoAuxiliary
from rigid_envs.kernels.rolling_ball import ROLLING_BALL, Input, Parameters, State
from rigid_envs.systems import RollingBall
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.fields import Number, Range, physical, setting, span
from rigid_envs.tasks.reduced.ball_pose import BALL_POSE

__all__ = ["FAR", "BallPark", "BallParkRandom", "misplacement"]

FAR = 50.0  # radii; bound of observed and penalised offsets
_SMOOTH = 1e-3  # smooths the roots at the origin


class Action(NamedTuple):
    """Velocity of the centre, as a fraction of the maximum speed."""

    VX: float
    VY: float


class Terms(NamedTuple):
    """Reward terms of `BallPark`."""

    position: float
    twist: float
    mismatch: float
    angle: float
    parked: float


class Constants(NamedTuple):
    """Largest rolling rate [rad/s], tolerances [m, rad], half side of the start square [m]."""

    largest_roll_rate: float
    position_tolerance: float
    angle_tolerance: float
    start_half_width: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """Position uniform in a square, attitude uniform on SO(3)."""
    half = c.start_half_width
    X = half * (2.0 * randoms.uniform(stream, 0) - 1.0)
    Y = half * (2.0 * randoms.uniform(stream, 1) - 1.0)
    return State(*randoms.quaternion(stream, 2), X + 0.0, Y + 0.0), ()  # -0.0 is 0.0


@scalar
def actuate(
    a: Action, y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Velocity of the centre; the ball does not spin about the vertical."""
    return y, Input(
        c.largest_roll_rate * p.radius * a.VX, c.largest_roll_rate * p.radius * a.VY, 0.0
    )


@scalar
def misplacement(y: Any, scale: float) -> tuple[float, float, float, float]:
    """Distance [radii], sqrt|theta_z|, |m| and |theta| of `BallPark`; `scale` is 1 / radius."""
    X, Y = y.X * scale, y.Y * scale
    theta = log_rotation(attitude(y))
    distance = math.sqrt(X * X + Y * Y)
    angle = math.sqrt(theta[0] * theta[0] + theta[1] * theta[1] + theta[2] * theta[2])
    a, b = theta[0] + Y, theta[1] - X
    mismatch = math.sqrt(a * a + b * b + _SMOOTH * _SMOOTH)
    twist = math.sqrt(math.sqrt(theta[2] * theta[2] + _SMOOTH * _SMOOTH))
    return distance, twist, mismatch, angle


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """The terms of `BallPark`, and whether the ball is parked."""
    distance, twist, mismatch, angle = misplacement(y, p.inverse_radius)
    parked = (distance * p.radius <= c.position_tolerance) & (angle <= c.angle_tolerance)
    rolled = dt * math.sqrt(u.VX * u.VX + u.VY * u.VY)
    terms = Terms(
        position=-min(distance, FAR),
        twist=-twist,
        mismatch=-cbrt(min(mismatch, FAR)),
        angle=-angle,
        parked=select(parked, 1.0, 0.0),
    )
    return aux, terms, rolled, parked, parked


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Constants) -> tuple[float, float]:
    """Position in radii."""
    X, Y = y.X * p.inverse_radius, y.Y * p.inverse_radius
    return min(max(X, -FAR), FAR), min(max(Y, -FAR), FAR)


@dataclass(frozen=True)
class BallPark(Task):
    """Park the ball: position at the origin and attitude upright, by rolling alone.

    A ball rolls on a plane without slipping. The action is the velocity of its centre. The ball
    cannot be turned about the vertical, nor about any axis without moving. It starts at a random
    pose and is to reach the origin with the attitude R = 1.

    The pose has five dimensions, and there are two controls. Rolling out and back along one line
    leaves the attitude unchanged; a closed path turns the ball according to the area that it
    encloses. So the straight path to the origin arrives with the wrong attitude, and parking takes
    a manoeuvre.

    Physics:
        Rolling without slipping, ``v = omega x radius e_z``, makes the horizontal angular velocity
        ``omega = (-VY, VX, 0) / radius`` in world axes. A step holds the velocity, and is the
        exact rotation by ``|v| dt / radius`` about the axis ``e_z x v``. An action of length 1
        rolls a ball of any radius by `roll_per_step`.

        The two control vector fields and their Lie brackets span 2, 3 and 5 dimensions (growth
        vector (2, 3, 5)). A small counter-clockwise loop of area A turns the ball by ``-A /
        radius^2`` about the vertical: second order in the size of the loop. A tilt without
        displacement, or a displacement without rotation, takes two such loops: third order. There
        is no drift: nothing moves while the action is 0.

    Rewards:
        The cost is a homogeneous distance: each direction has the root of the order, 1, 2 or 3, of
        the Lie bracket that generates it. With p the offset in radii, theta = log R the rotation
        vector in world axes and ``m = (theta_x + p_y, theta_y - p_x)`` the mismatch between
        rotation and rolled offset, ``position`` = ``-min(|p|, 50)``, ``twist`` = ``-sqrt(t)`` and
        ``mismatch`` = ``-cbrt(min(s, 50))``, where ``t = sqrt(theta_z^2 + 0.001^2)`` and ``s =
        sqrt(|m|^2 + 0.001^2)`` round the roots off at 0. ``parked`` = 1 in the step that parks the
        ball.

        The obvious alternative, negative distance, uses `weight_position` and `weight_angle` (of
        ``angle`` = ``-|theta|``) in place of `weight_twist` and `weight_mismatch`, as in
        configs/ball_park_naive_ppo.yaml.

    Starting State:
        Position uniform in the square ``|X|, |Y| <= start_half_width``, attitude uniform on SO(3).

    Episode End:
        The episode terminates when the ball is parked: its offset is at most `position_tolerance`
        and the angle of its attitude at most `angle_tolerance`. That step is the success
        (`info["is_success"]`).

    Reference:
        `shortest_path` follows the shortest path, an elastica found by shooting, rolled as a
        polygon with one side per step. `three_rolls` takes three straight rolls; two are not enough
        for every pose.

        Bound: no path is shorter than ``max(distance, radius angle)``, less the tolerance. Paths
        that end at the edge of the tolerance may be shorter than those that end exactly at the
        goal.

    Version History:
        v0: first version.

    Source:
        Jurdjevic 1993, "The geometry of the plate-ball problem", doi:10.1007/BF00375605; shortest
        paths: Arthurs & Walsh 1986; three rolls: Hammersley 1983, "Oxford commemoration ball", LMS
        Lecture Notes 79.
    """

    radius: Range = physical(1.0, "radius of the ball", "m")
    roll_per_step: float = setting(
        math.pi / 8, Number("largest roll per control period", "rad", 1e-3, math.pi / 2)
    )
    start_half_width: float = setting(2.0, Number("half side of the start square", "m", 0.0, 20.0))
    position_tolerance: float = setting(0.1, Number("largest offset when parked", "m", 1e-6, 10.0))
    angle_tolerance: float = setting(0.15, Number("largest angle when parked", "rad", 1e-6, 3.2))
    weight_position: float = setting(0.01, Number("weight of -|p|", "1", -1e3, 1e3))
    weight_twist: float = setting(0.02, Number("weight of -sqrt|theta_z|", "1", -1e3, 1e3))
    weight_mismatch: float = setting(0.02, Number("weight of -cbrt|m|", "1", -1e3, 1e3))
    weight_angle: float = setting(0.0, Number("weight of -|theta|", "1", -1e3, 1e3))
    weight_parked: float = setting(10.0, Number("weight of the step that parks", "1", -1e3, 1e3))

    system_type: ClassVar = RollingBall
    episode: ClassVar = Episode(
        dynamics=ROLLING_BALL,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=clip_to_disk,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = BALL_POSE
    cost_unit: ClassVar = "distance rolled [m]"

    @property
    def largest_roll_rate(self) -> float:
        """Rolling rate at full action [rad/s]."""
        return self.roll_per_step / self.dt

    def actions(self) -> tuple[Entry, ...]:
        """Velocity of the centre, in a disk."""
        speed = self.largest_roll_rate * span(self.radius)[1]
        return (
            Entry("VX", "m/s", "world, disk", -speed, speed),
            Entry("VY", "m/s", "world, disk", -speed, speed),
        )

    def features(self) -> tuple[Entry, ...]:
        """Offset in radii."""
        return (
            Entry("X / radius", "1", "world", -FAR, FAR),
            Entry("Y / radius", "1", "world", -FAR, FAR),
        )

    def largest_rate(self, duration: float) -> float:
        """Rolling rate at full speed."""
        return self.largest_roll_rate

    def lower_bound(self, y: Array) -> Array:
        """Lower bound on the path length [m]: max(distance, radius * angle) to the origin."""
        ball = self.system()
        distance = np.hypot(*np.moveaxis(ball.accessors["position"](y), -1, 0))
        angle = rotations.angle(ball.accessors["q"](y))
        return np.asarray(np.maximum(distance, span(self.radius)[0] * angle))


@dataclass(frozen=True)
class BallParkRandom(BallPark):
    """Park balls of different sizes: `BallPark` with a radius drawn in every episode.

    The radius is the only length in the kinematics. Positions are observed in radii and actions are
    rolling rates, so the same manoeuvre parks balls of all sizes. The start square and the
    tolerance do not scale; they stay in metres. A ball of 0.5 m starts up to 5.7 radii away and
    must park within 0.2 radii; a ball of 2 m starts at most 1.4 radii away and must park within
    0.05. The bounds of the action in m/s are those of the largest ball. With `observe_params` the
    radius is observed.

    Reference:
        The controllers of `BallPark`, which plan with the drawn radius.

        Bound: no path is shorter than ``max(distance, radius angle)``, less the tolerance.
    """

    radius: Range = physical((0.5, 2.0), "radius of the ball", "m")
