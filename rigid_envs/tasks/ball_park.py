"""Park a ball: reach position and orientation by rolling alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rigid_envs import rotations
from rigid_envs.kernels import episode, randoms, rolling_ball
from rigid_envs.kernels.actions import clip_to_disc
from rigid_envs.kernels.algebra import Row, log_rotation
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import cbrt, select
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import RollingBall
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.fields import Number, Range, physical, setting, span

__all__ = ["FAR", "BallPark", "BallParkRandom", "misplacement"]

FAR = 50.0  # radii; offsets are observed and punished no further than this
_SMOOTH = 1e-3  # rounds the roots off at the origin
_RATE, _POSITION, _ANGLE, _SQUARE = range(5, 9)  # constants after the five weights


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """Position uniform in a square, attitude uniform on SO(3)."""
    half = c[_SQUARE]
    x = half * (2.0 * randoms.uniform(stream, 0) - 1.0)
    y = half * (2.0 * randoms.uniform(stream, 1) - 1.0)
    return (*randoms.quaternion(stream, 2), x + 0.0, y + 0.0), ()  # -0.0 is 0.0


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Velocity of the centre; the ball does not spin about the vertical."""
    return y, (c[_RATE] * p[0] * a[0], c[_RATE] * p[0] * a[1], 0.0)


@scalar
def misplacement(y: Row, scale: float) -> tuple[float, float, float, float]:
    """Distance [radii], sqrt|theta_z|, |m| and |theta| of `BallPark`; `scale` is 1 / radius."""
    x, y_ = y[4] * scale, y[5] * scale
    theta = log_rotation((y[0], y[1], y[2], y[3]))
    distance = math.sqrt(x * x + y_ * y_)
    angle = math.sqrt(theta[0] * theta[0] + theta[1] * theta[1] + theta[2] * theta[2])
    a, b = theta[0] + y_, theta[1] - x
    mismatch = math.sqrt(a * a + b * b + _SMOOTH * _SMOOTH)
    twist = math.sqrt(math.sqrt(theta[2] * theta[2] + _SMOOTH * _SMOOTH))
    return distance, twist, mismatch, angle


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """The terms of `BallPark`, and whether the ball is parked."""
    distance, twist, mismatch, angle = misplacement(y, p[1])
    parked = (distance * p[0] <= c[_POSITION]) & (angle <= c[_ANGLE])
    rolled = dt * math.sqrt(u[0] * u[0] + u[1] * u[1])
    terms = (
        -min(distance, FAR),
        -twist,
        -cbrt(min(mismatch, FAR)),
        -angle,
        select(parked, 1.0, 0.0),
    )
    return memo, terms, rolled, parked, parked


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Position in radii."""
    x, y_ = y[4] * p[1], y[5] * p[1]
    return (min(max(x, -FAR), FAR), min(max(y_, -FAR), FAR))


SHAPES = Shapes(*rolling_ball.SHAPES, (1.0,), (), (0.0,) * 2, (0.0,) * 9)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        rolling_ball.step,
        rolling_ball.restore,
        rolling_ball.WEIGHTS,
        clip_to_disc,
        actuate,
        judge,
        observe,
        SHAPES,
        memory,
        first_block,
        last_block,
    )


@kernel
def reset(memory: Memory, rows: Array, mode: int) -> None:
    """`episode.reset` of this task."""
    episode.reset(rolling_ball.derive, start, observe, SHAPES, memory, rows, mode)


@dataclass(frozen=True)
class BallPark(Task):
    """Park the ball: position at the origin and orientation upright, by rolling alone.

    A ball rolls on a plane without slipping. Its centre is driven with a velocity; it cannot be
    turned about the vertical, nor about any axis without moving on. It starts anywhere, turned in
    any way, and is to be brought to the origin with the attitude R = 1.

    There are five dimensions and two controls. A ball that rolls somewhere and back on one line is
    not turned at all; what turns it is the area of the loop that its centre runs round. So the
    straight way home arrives with the wrong side up, and the way that does not is a manoeuvre.

    Physics:
        Rolling without slipping, ``v = omega x radius e_z``, makes the horizontal angular velocity
        ``omega = (-VY, VX, 0) / radius`` in world axes. A step holds the velocity, and is the
        exact rotation by ``|v| dt / radius`` about the axis ``e_z x v``.

        The two fields of controls and their Lie brackets span 2, 3 and 5 dimensions (growth vector
        (2, 3, 5)). A small counter-clockwise loop of area A turns the ball by ``-A / radius^2``
        about the vertical: second order in the size of the loop. To tilt it where it stands, or to
        shift it without turning it, takes two such loops: third order. Nothing moves while the
        action is 0.

    Rewards:
        The terms make up a distance that weighs every direction by the order 1, 2 or 3 of the Lie
        bracket that generates it. With p the offset in radii, theta = log R the rotation vector in
        world axes and ``m = (theta_x + p_y, theta_y - p_x)`` the mismatch between what was rolled
        and what is turned, ``position`` = ``-|p|``, ``twist`` = ``-sqrt(|theta_z|)`` and
        ``mismatch`` = ``-cbrt(|m|)``; the roots are rounded off within 0.001 of 0, and lengths
        count up to 50. ``parked`` = 1 in the step that parks the ball.

        Negative distance is what one tries first: `weight_position` and `weight_angle`, of
        ``angle`` = ``-|theta|``, in place of `weight_twist` and `weight_mismatch`, as in
        configs/ball_park_naive_ppo.yaml.

    Starting State:
        Position uniform in the square ``|X|, |Y| <= start_half_width``, attitude uniform on SO(3).

    Episode End:
        The episode terminates when the ball is parked: its offset is at most `position_tolerance`
        and the angle of its attitude at most `angle_tolerance`. That step is the success
        (`info["is_success"]`).

    Reference:
        `shortest_path` is the shortest path, an elastica found by shooting, rolled as a polygon
        with one side per step. `three_rolls` takes three straight rolls; two are not enough for
        every pose.

        Bound: no path is shorter than ``max(distance, radius angle)``, less the tolerance. Paths
        that end just within tolerance may be shorter than those that lead to the very goal.

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
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("position", "twist", "mismatch", "angle", "parked")
    cost_unit: ClassVar = "distance rolled [m]"

    def constants(self) -> tuple[float, ...]:
        """Weights, largest rate, tolerances, start square."""
        return (
            self.weight_position,
            self.weight_twist,
            self.weight_mismatch,
            self.weight_angle,
            self.weight_parked,
            self.roll_per_step / self.dt,
            self.position_tolerance,
            self.angle_tolerance,
            self.start_half_width,
        )

    def actions(self) -> tuple[Entry, ...]:
        """Velocity of the centre, in a disc."""
        speed = self.roll_per_step / self.dt * span(self.radius)[1]
        return (
            Entry("VX", "m/s", "world, disc", -speed, speed),
            Entry("VY", "m/s", "world, disc", -speed, speed),
        )

    def features(self) -> tuple[Entry, ...]:
        """Offset in radii."""
        return (
            Entry("X / radius", "1", "world", -FAR, FAR),
            Entry("Y / radius", "1", "world", -FAR, FAR),
        )

    def largest_rate(self) -> float:
        """Rolling rate at full speed."""
        return self.roll_per_step / self.dt

    def lower_bound(self, y: Array) -> Array:
        """Path length [m] that no plan can beat: max(distance, radius * angle) to the origin."""
        distance = np.hypot(y[..., 4], y[..., 5])
        return np.maximum(distance, span(self.radius)[0] * rotations.angle(y[..., :4]))


@dataclass(frozen=True)
class BallParkRandom(BallPark):
    """Park balls of every size: `BallPark` with a radius that is drawn in every episode.

    Rolling knows no length but the radius. Positions are observed in radii and actions are rolling
    rates, so one and the same manoeuvre parks balls of all sizes. What does not scale are the
    square of the starts and the tolerance, which stay in metres: a ball of 0.5 m starts up to 5.7
    of its radii away and is parked within 0.2 of them, one of 2 m starts at no more than 1.4 and is
    parked within 0.05. The bounds of the action in m/s are those of the largest ball. With
    `observe_params` the radius is observed.

    Reference:
        The controllers of `BallPark`, planned with the radius that was drawn.

        Bound: no path is shorter than ``max(distance, radius angle)``, less the tolerance.
    """

    radius: Range = physical((0.5, 2.0), "radius of the ball", "m")
