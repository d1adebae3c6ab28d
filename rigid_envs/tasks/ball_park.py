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

    Five dimensions, two controls: every way to the goal is a manoeuvre. Roll with the centre
    velocity; each step is an exact rotation. The episode ends when the ball is parked.

    Reward. With p the offset in radii, theta = log R (world axes) and m = (theta_x + p_y,
    theta_y - p_x) the mismatch between what was rolled and what is turned, the cost
    ``0.5 |p| + sqrt(|theta_z|) + cbrt(|m|)`` weighs every direction by the order of the Lie
    bracket that generates it (1, 2, 3: growth vector (2, 3, 5)); 0.02 of it is charged per step,
    10 are paid at success. Negative distance ``|p| + angle`` in its place (`weight_angle`,
    `weight_position`) is what one tries first: see configs/ball_park_naive_ppo.yaml, and the
    README for how the two compare.

    Attributes:
        radius: radius of the ball [m].
        roll_per_step: largest roll in one control period [rad].
        start_half_width: half the side of the square of starting positions [m].
        position_tolerance: parked if the offset is at most this [m],
        angle_tolerance: and the angle of the attitude is at most this [rad].
        weight_position: weight of ``position`` = -|p|.
        weight_twist: weight of ``twist`` = -sqrt(|theta_z|).
        weight_mismatch: weight of ``mismatch`` = -cbrt(|m|).
        weight_angle: weight of ``angle`` = -|theta|.
        weight_parked: weight of ``parked`` = 1 in the step that parks the ball.

    Source: Jurdjevic 1993, doi:10.1007/BF00375605; shortest paths: Arthurs & Walsh 1986.
    """

    radius: Range = physical(1.0, "radius of the ball", "m")
    roll_per_step: float = setting(
        math.pi / 8, Number("largest roll per control period", "rad", 1e-3, math.pi / 2)
    )
    start_half_width: float = setting(2.0, Number("half side of the start square", "m", 0.0, 20.0))
    position_tolerance: float = setting(0.1, Number("parking tolerance", "m", 1e-6, 10.0))
    angle_tolerance: float = setting(0.15, Number("parking tolerance", "rad", 1e-6, 3.2))
    weight_position: float = setting(0.01, Number("weight of -|p|", "1", -1e3, 1e3))
    weight_twist: float = setting(0.02, Number("weight of -sqrt|theta_z|", "1", -1e3, 1e3))
    weight_mismatch: float = setting(0.02, Number("weight of -cbrt|m|", "1", -1e3, 1e3))
    weight_angle: float = setting(0.0, Number("weight of -|theta|", "1", -1e3, 1e3))
    weight_parked: float = setting(10.0, Number("weight of success", "1", -1e3, 1e3))

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
    parked within 0.05. With `observe_params` the radius is observed. Reward and success are those
    of `BallPark`.

    Attributes:
        radius: radius of the ball, from half to twice that of `BallPark` [m].
        roll_per_step, start_half_width, position_tolerance, angle_tolerance: as in `BallPark`.
        weight_position, weight_twist, weight_mismatch, weight_angle, weight_parked: likewise.

    Source: as `BallPark`.
    """

    radius: Range = physical((0.5, 2.0), "radius of the ball", "m")
