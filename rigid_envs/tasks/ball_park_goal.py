"""Park a ball at a pose that is drawn: the goal environment of parking."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, goals, randoms, rolling_ball
from rigid_envs.kernels.actions import clip_to_disc, single
from rigid_envs.kernels.algebra import Row, matrix
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import select, sincos
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import RollingBall
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.fields import Number, Range, physical, setting, span

__all__ = ["BallParkGoal"]

_FAR = 50.0  # m, and radii; positions are observed no further than this
_RATE, _POSITION, _ANGLE, _SQUARE = range(1, 5)  # constants after the weight


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """Positions of ball and goal uniform in a square, both attitudes uniform on SO(3)."""
    side = 2.0 * c[_SQUARE]
    x, y = side * (randoms.uniform(stream, 0) - 0.5), side * (randoms.uniform(stream, 1) - 0.5)
    goal_x = side * (randoms.uniform(stream, 2) - 0.5)
    goal_y = side * (randoms.uniform(stream, 3) - 0.5)
    q, goal = randoms.quaternion(stream, 1 << 20), randoms.quaternion(stream, 1 << 21)
    return (*q, x, y), (*goal, goal_x, goal_y)


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Velocity of the centre; the ball does not spin about the vertical."""
    return y, (c[_RATE] * p[0] * a[0], c[_RATE] * p[0] * a[1], 0.0)


@scalar
def pose(y: Row) -> Row:
    """Position [m] and the nine entries of R, rounded to float32 as they are observed."""
    r = matrix((y[0], y[1], y[2], y[3]))
    x, y_ = min(max(y[4], -_FAR), _FAR), min(max(y[5], -_FAR), _FAR)
    return (
        single(x),
        single(y_),
        single(r[0]),
        single(r[1]),
        single(r[2]),
        single(r[3]),
        single(r[4]),
        single(r[5]),
        single(r[6]),
        single(r[7]),
        single(r[8]),
    )


@scalar
def reached(achieved: Row, desired: Row, c: Row) -> bool:
    """Distance and angle within tolerance; the angle is that of tr(R^T R') = 1 + 2 cos."""
    dx, dy = achieved[0] - desired[0], achieved[1] - desired[1]
    trace = 0.0
    for k in range(2, 11):
        trace += achieved[k] * desired[k]
    near: bool = dx * dx + dy * dy <= c[_POSITION] * c[_POSITION]
    _, cosine = sincos(c[_ANGLE])
    return near & (trace >= 1.0 + 2.0 * cosine)


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Whether the goal is reached, and the way rolled."""
    success = reached(pose(y), pose(memo), c)
    rolled = dt * math.sqrt(u[0] * u[0] + u[1] * u[1])
    return memo, (select(success, 0.0, -1.0),), rolled, success, False


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Achieved and desired pose, and the position in radii."""
    x, y_ = y[4] * p[1], y[5] * p[1]
    return (*pose(y), *pose(memo), min(max(x, -_FAR), _FAR), min(max(y_, -_FAR), _FAR))


GOAL = (0.0,) * 11
SHAPES = Shapes(*rolling_ball.SHAPES, (1.0,), (1.0,) + (0.0,) * 5, (0.0,) * 2, (0.0,) * 5)


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


@kernel
def reach(achieved: Array, desired: Array, constants: Array, out: Array) -> None:
    """`goals.reach_rows` of this task."""
    goals.reach_rows(reached, GOAL, SHAPES.constants, achieved, desired, constants, out)


@dataclass(frozen=True)
class BallParkGoal(Task):
    """Park the ball at a pose that is drawn anew in every episode; sparse reward.

    The ball of `BallPark`, as a goal environment: the observation is a dictionary, the goals are
    position and rotation matrix, and ``compute_reward`` says what any pair of them pays. What is
    observed besides the goals does not depend on the desired one, so a step may be remembered as
    one towards any other goal.

    Why it is hard: five dimensions are reached by two velocities, through manoeuvres alone, and
    nothing is paid on the way. One in three million of the poses in the square is within tolerance
    of a goal.

    Physics:
        Rolling without slipping, ``v = omega x radius e_z``, makes the horizontal angular velocity
        ``omega = (-VY, VX, 0) / radius`` in world axes. A step holds the velocity, and is the
        exact rotation by ``|v| dt / radius`` about the axis ``e_z x v``.

        Rolling does not depend on the place or on how the ball is marked. So what leads from pose
        to goal depends on nothing but their difference: the way between them, and the rotation
        from one attitude to the other in world axes.

    Rewards:
        ``reached`` = 0 where the distance to the goal is at most `position_tolerance` and the angle
        between the attitudes at most `angle_tolerance`, else -1: the return is minus the number of
        steps away from the goal. What is compared are the goals as they are observed, so rewards
        that are computed anew are those that were paid, to the bit.

    Starting State:
        Positions of ball and goal uniform in the square ``|X|, |Y| <= start_half_width``, both
        attitudes uniform on SO(3).

    Episode End:
        The episode goes on at the goal, where staying pays best. Success (`info["is_success"]`) is
        told of every step; that of an episode is that of its last step.

    Reference:
        `shortest_path` rolls from pose to goal as in `BallPark` and then rests; `three_rolls` takes
        three straight rolls.

        Bound: no path is shorter than ``max(distance, radius angle)`` from pose to goal, less the
        tolerance.

    Version History:
        v0: first version.

    Source:
        Jurdjevic 1993, "The geometry of the plate-ball problem", doi:10.1007/BF00375605; three
        rolls: Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79; hindsight
        experience replay: Andrychowicz et al. 2017, arXiv:1707.01495.
    """

    radius: Range = physical(1.0, "radius of the ball", "m")
    roll_per_step: float = setting(
        math.pi / 8, Number("largest roll per control period", "rad", 1e-3, math.pi / 2)
    )
    start_half_width: float = setting(
        2.0, Number("half side of the square of poses", "m", 0.0, 20.0)
    )
    position_tolerance: float = setting(
        0.1, Number("largest distance at the goal", "m", 1e-6, 10.0)
    )
    angle_tolerance: float = setting(0.15, Number("largest angle at the goal", "rad", 1e-3, 3.2))
    weight_reached: float = setting(
        1.0, Number("weight of -1 per step off the goal", "1", -1e3, 1e3)
    )

    system_type: ClassVar = RollingBall
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    reach: ClassVar = staticmethod(reach)
    n_goal: ClassVar = 11
    terms: ClassVar = ("reached",)
    cost_unit: ClassVar = "distance rolled [m]"
    memo_names: ClassVar = ("goal_w", "goal_x", "goal_y", "goal_z", "goal_X", "goal_Y")

    def constants(self) -> tuple[float, ...]:
        """Weight, largest rate, tolerances, square."""
        return (
            self.weight_reached,
            self.roll_per_step / self.dt,
            self.position_tolerance,
            min(self.angle_tolerance, math.pi),
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
        """Achieved and desired pose, position in radii."""
        goal = (
            Entry("X", "m", "world", -_FAR, _FAR),
            Entry("Y", "m", "world", -_FAR, _FAR),
            *(Entry(f"R{i}{j}", "1", "body to world", -1.0, 1.0) for i in "123" for j in "123"),
        )
        return (
            *goal,
            *goal,
            Entry("X / radius", "1", "world", -_FAR, _FAR),
            Entry("Y / radius", "1", "world", -_FAR, _FAR),
        )

    def largest_rate(self) -> float:
        """Rolling rate at full speed."""
        return self.roll_per_step / self.dt
