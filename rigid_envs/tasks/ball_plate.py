"""Hold a ball on a commanded point of a table by tilting it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import dynamic_ball, episode, randoms
from rigid_envs.kernels.actions import clip_to_square
from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import select
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import DynamicBall
from rigid_envs.tasks.ball_park_dynamic import speed_bound
from rigid_envs.tasks.base import ROTATION, Array, Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting, span

__all__ = ["BallPlate"]

_FAR, _FAST = 20.0, 20.0  # m, and m/s or rad/s; observed no further than this
_WIDE = 2.0  # limits; tilt and tilt rate are observed no further than this
# constants after the two weights
_LIMIT, _RATE, _PERIOD, _TOLERANCE, _HOLD, _RADIUS, _SPEED, _EDGE = range(2, 10)


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """On a level table: ball and point uniform in one disc, velocity in another."""
    x, y = randoms.in_disc(stream, 0)
    vx, vy = randoms.in_disc(stream, 1 << 20)
    point_x, point_y = randoms.in_disc(stream, 1 << 21)
    r, v = c[_RADIUS], c[_SPEED]
    q = randoms.quaternion(stream, 1 << 22)
    ball = (*q, r * x, r * y, v * vx, v * vy, 0.0, 0.0, 0.0, 0.0, 0.0)
    return ball, (r * point_x, r * point_y, 0.0)


@scalar
def reachable(rate: float, angle: float, now: float, c: Row) -> float:
    """The rate nearest to the commanded one from which the angle can still stop at its limit.

    Rates change linearly over a period, also when the table stops in the next one: it then stands
    at angle + (now + 2 rate) period / 2.
    """
    rest, per_period = angle + 0.5 * c[_PERIOD] * now, 1.0 / c[_PERIOD]
    low, high = (-c[_LIMIT] - rest) * per_period, (c[_LIMIT] - rest) * per_period
    return min(max(min(max(rate, low), high), -c[_RATE]), c[_RATE])


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Accelerations that bring the tilt rates to the commanded ones within the period."""
    rate_x = reachable(c[_RATE] * a[0], y[9], y[11], c)
    rate_y = reachable(c[_RATE] * a[1], y[10], y[12], c)
    per_period = 1.0 / c[_PERIOD]
    return y, (0.0, 0.0, (rate_x - y[11]) * per_period, (rate_y - y[12]) * per_period)


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Distance to the point, tilt rates, for how long the ball is there; beyond the edge is off."""
    dx, dy = y[4] - memo[0], y[5] - memo[1]
    distance = math.sqrt(dx * dx + dy * dy)
    held = select(distance < c[_TOLERANCE], memo[2] + 1.0, 0.0)
    square = y[11] * y[11] + y[12] * y[12]
    effort = min(square * (0.5 / (c[_RATE] * c[_RATE])), 1.0)
    terms = (1.0 / (1.0 + 5.0 * distance), -effort)
    success = held * dt >= c[_HOLD] * (1.0 - 1e-9)
    off = y[4] * y[4] + y[5] * y[5] > c[_EDGE] * c[_EDGE]
    return (memo[0], memo[1], held), terms, dt * math.sqrt(square), success, off


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Offset from the point, position, velocity, spin, and the tilt in parts of its limits."""
    dx, dy = y[4] - memo[0], y[5] - memo[1]
    tilt, rate = 1.0 / c[_LIMIT], 1.0 / c[_RATE]
    return (
        min(max(dx, -_FAR), _FAR),
        min(max(dy, -_FAR), _FAR),
        min(max(y[4], -_FAR), _FAR),
        min(max(y[5], -_FAR), _FAR),
        min(max(y[6], -_FAST), _FAST),
        min(max(y[7], -_FAST), _FAST),
        min(max(y[8], -_FAST), _FAST),
        min(max(tilt * y[9], -_WIDE), _WIDE),
        min(max(tilt * y[10], -_WIDE), _WIDE),
        min(max(rate * y[11], -_WIDE), _WIDE),
        min(max(rate * y[12], -_WIDE), _WIDE),
    )


SHAPES = Shapes(*dynamic_ball.SHAPES, (1.0,) * 5, (0.0,) * 3, (0.0,) * 2, (0.0,) * 10)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        dynamic_ball.step,
        dynamic_ball.restore,
        dynamic_ball.WEIGHTS,
        clip_to_square,
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
    episode.reset(dynamic_ball.derive, start, observe, SHAPES, memory, rows, mode)


@dataclass(frozen=True)
class BallPlate(Task):
    """Hold a ball on a point of a table that is commanded anew in every episode, by tilting it.

    The ball rolls without slipping on a table that turns about the point O of its surface by the
    angles alpha_x and alpha_y. The action commands the rates of the two angles. The attitude of the
    ball does not matter here, and is not observed (`rotation`).

    Why it is hard: the ball is two integrators behind the tilt, and tilting carries its centre the
    wrong way first. Weak tilt makes the ball slow to stop, and the table ends soon.

    Physics:
        Near level, in the axes of the table and with beta = I / (m radius^2),
        ``X'' = g alpha_y / (1 + beta) - radius alpha_y''`` and
        ``Y'' = -g alpha_x / (1 + beta) + radius alpha_x''``. What is simulated are the full
        equations, with centrifugal and gyroscopic terms. The mass has no effect. The motor brings
        the rates of the angles to the commanded ones linearly within the control period, and slows
        down in time to stop at `tilt_limit`.

        Tilting carries the centre of the ball the wrong way by radius times angle: a zero of the
        transfer function in the right half-plane, at ``sqrt(g / ((1 + beta) radius))``. On a
        turntable (`turntable_rate` Omega) a free ball does not roll straight on but round a circle,
        at ``beta / (1 + beta) Omega``: 2/7 of the rate of the table for a solid sphere, 2/5 for a
        hollow one, whatever its size and speed.

    Rewards:
        ``near`` = ``1 / (1 + 5 distance)`` with the distance to the point [m], and ``effort`` =
        ``-|rates|^2 / (2 tilt_rate^2)`` of the angles, against needless tilting.

    Starting State:
        The table is level and at rest. Ball and point are uniform in a disk of `start_radius`, the
        velocity in one of `start_speed`; the ball does not spin about the normal, and its attitude
        is uniform on SO(3).

    Episode End:
        Success (`info["is_success"]`): the distance to the point has been below `tolerance`
        throughout the last `hold` seconds. The episode terminates where the table ends, `margin`
        beyond the disk of starts and points.

    Reference:
        `lqr` is the linear-quadratic regulator ``rates = -K (offset, velocity, tilt, tilt rates)``
        of the level table, for an offset that counts up to 1 m.

        Exact: a free ball on a turntable goes round at ``beta / (1 + beta)`` of its rate. A ball at
        rest on its point stays there on a level table, without effort.

    Version History:
        v0: first version.

    Source:
        Neimark & Fufaev, *Dynamics of Nonholonomic Systems*, chapter III; turntable: Weltner 1979,
        doi:10.1119/1.11602; regulator: Anderson & Moore, *Optimal Control: Linear Quadratic
        Methods*, chapter 2.
    """

    n_substeps: int = setting(2, Integer("integrator steps per control period", 1, 1000))
    rotation: str = setting("none", ROTATION)
    m: Range = physical(1.0, "mass, without effect", "kg")
    radius: Range = physical(1.0, "radius of the ball", "m")
    beta: Range = setting(
        0.4, Number("inertia ratio I / (m radius^2)", "1", 1e-3, 2.0 / 3.0, drawn=True)
    )
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    turntable_rate: Range = setting(
        0.0, Number("rate of the surface about its normal", "rad/s", -10.0, 10.0, drawn=True)
    )
    tilt_limit: float = setting(0.1, Number("largest tilt about each axis", "rad", 1e-3, 0.5))
    tilt_rate: float = setting(0.4, Number("largest rate of each tilt", "rad/s", 1e-3, 10.0))
    start_radius: float = setting(
        2.0, Number("radius of the disc of starts and points", "m", 0.0, 100.0)
    )
    start_speed: float = setting(0.5, Number("largest speed at the start", "m/s", 0.0, 10.0))
    margin: float = setting(2.0, Number("table beyond that disc", "m", 0.1, 100.0))
    tolerance: float = setting(0.05, Number("largest distance of a success", "m", 1e-6, 10.0))
    hold: float = setting(2.0, Number("time within tolerance", "s", 0.0, 1e4))
    weight_near: float = setting(1.0, Number("weight of the distance term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    system_type: ClassVar = DynamicBall
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("near", "effort")
    cost_unit: ClassVar = "angle tilted [rad]"
    memo_names: ClassVar = ("point_X", "point_Y", "held")

    def constants(self) -> tuple[float, ...]:
        """Weights, tilt, period, tolerance, hold, starts, edge."""
        return (
            self.weight_near,
            self.weight_effort,
            self.tilt_limit,
            self.tilt_rate,
            self.dt,
            self.tolerance,
            self.hold,
            self.start_radius,
            self.start_speed,
            self.start_radius + self.margin,
        )

    def actions(self) -> tuple[Entry, ...]:
        """Commanded rates of the two angles."""
        rate = self.tilt_rate
        return tuple(Entry(f"alpha_{k}'", "rad/s", "plate", -rate, rate) for k in "xy")

    def features(self) -> tuple[Entry, ...]:
        """Offset from the point, position, velocity, spin, tilt and its rate."""
        return (
            *(Entry(f"{k} - {k}*", "m", "plate", -_FAR, _FAR) for k in "XY"),
            *(Entry(k, "m", "plate", -_FAR, _FAR) for k in "XY"),
            *(Entry(f"V{k}", "m/s", "plate", -_FAST, _FAST) for k in "XY"),
            Entry("spin", "rad/s", "plate normal", -_FAST, _FAST),
            *(Entry(f"alpha_{k} / limit", "1", "plate", -_WIDE, _WIDE) for k in "xy"),
            *(Entry(f"alpha_{k}' / limit", "1", "plate", -_WIDE, _WIDE) for k in "xy"),
        )

    def largest_rate(self) -> float:
        """Rates of table and ball at the speed that no tilting exceeds before the edge."""
        beta, table = span(self.beta), max(abs(end) for end in span(self.turntable_rate))
        plate, edge = math.sqrt(2.0) * self.tilt_rate, self.start_radius + self.margin
        push = math.sqrt(2.0) * span(self.g)[1] * self.tilt_limit + plate * plate * edge
        gyration = table * beta[1] / (1.0 + beta[1])
        speed = speed_bound(push / (1.0 + beta[0]), edge, gyration) + self.start_speed
        # the tilting table moves the ball by radius times its rate, besides
        return 2.0 * plate + (speed + table * edge) / span(self.radius)[0]
