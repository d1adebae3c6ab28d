"""Park a ball that has inertia: a force rolls it, and it must arrive at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import dynamic_ball, episode, randoms
from rigid_envs.kernels.actions import clip_to_disc
from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import cbrt, select
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import DynamicBall
from rigid_envs.tasks.ball_park import FAR, misplacement
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting, span

__all__ = ["BallParkDynamic", "speed_bound"]

_FAST = 50.0  # radii per second; observed no further than this
# constants after the six weights
_FORCE, _POSITION, _ANGLE, _SPEED, _SQUARE, _EDGE = range(6, 12)


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """At rest: position uniform in a square, attitude uniform on SO(3)."""
    half = c[_SQUARE]
    x = half * (2.0 * randoms.uniform(stream, 0) - 1.0)
    y = half * (2.0 * randoms.uniform(stream, 1) - 1.0)
    q = randoms.quaternion(stream, 2)
    return (*q, x, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), ()


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Horizontal force at the centre; the plate stays level."""
    return y, (c[_FORCE] * a[0], c[_FORCE] * a[1], 0.0, 0.0)


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """The terms of `BallPark`; parked is at rest, and beyond the edge is off."""
    distance, twist, mismatch, angle = misplacement(y, p[6])
    speed = math.sqrt(y[6] * y[6] + y[7] * y[7])
    there = (distance * p[1] <= c[_POSITION]) & (angle <= c[_ANGLE])
    parked = there & (speed <= c[_SPEED])
    off = distance * p[1] > c[_EDGE]
    terms = (
        -min(distance, FAR),
        -twist,
        -cbrt(min(mismatch, FAR)),
        -angle,
        select(parked, 1.0, 0.0),
        select(off, -1.0, 0.0),
    )
    impulse = dt * math.sqrt(u[0] * u[0] + u[1] * u[1])
    return memo, terms, impulse, parked, parked | off


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Position in radii, velocity in radii per second."""
    x, y_ = y[4] * p[6], y[5] * p[6]
    vx, vy = y[6] * p[6], y[7] * p[6]
    return (
        min(max(x, -FAR), FAR),
        min(max(y_, -FAR), FAR),
        min(max(vx, -_FAST), _FAST),
        min(max(vy, -_FAST), _FAST),
    )


SHAPES = Shapes(*dynamic_ball.SHAPES, (1.0,) * 5, (), (0.0,) * 2, (0.0,) * 12)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        dynamic_ball.level_step,
        dynamic_ball.restore,
        dynamic_ball.WEIGHTS,
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
    episode.reset(dynamic_ball.derive, start, observe, SHAPES, memory, rows, mode)


def speed_bound(push: float, reach: float, gyration: float = 0.0) -> float:
    """Speed [m/s] that a ball from rest cannot exceed inside a disc.

    Where |r| <= D and |a| <= a_max, ``d(r . v)/dt = v^2 + r . v' >= v^2 - a_max D - kappa D v``:
    a fast ball soon leaves the disc. In units of D and a_max, with w = v - kappa, it needs at least
    the time w - 1 from w = 1 on, and ``(w^3 - 1) / 3 - (w - 1) <= w + 1 + 2 kappa`` follows.

    Args:
        push: largest acceleration that does not depend on the velocity [m/s^2].
        reach: radius D of the disc [m].
        gyration: rate kappa at which the velocity is turned besides [rad/s].
    """
    return 2.6 * math.sqrt(push * reach) + 1.5 * abs(gyration) * reach


@dataclass(frozen=True)
class BallParkDynamic(Task):
    """Park a ball that has inertia: it is pushed, rolls on, and must come to rest at home.

    A horizontal force at the centre rolls the ball on a level plate without slipping. Position and
    attitude follow from the velocity as in `BallPark`: five dimensions, reached by manoeuvres
    alone, now with a drift of two dimensions that has to be stopped.

    Why it is hard: every curve costs force, every mistake goes on until it is braked, and the goal
    counts only at rest. Beyond `margin` outside the square of starts the plate ends.

    Physics:
        The contact takes its share, ``m (1 + beta) v' = F`` with beta = I / (m radius^2), so that
        a solid sphere accelerates at 5/7 of F / m. Without force it rolls straight on for ever: its
        velocity, its energy and its spin about the vertical, which is 0, are conserved, and a level
        plate leaves g without effect. On a turntable (`turntable_rate` Omega) the velocity turns
        besides, at ``beta / (1 + beta) Omega``.

        The attitude follows by rolling, ``v = omega x radius e_z``: growth vector (2, 3, 5) of the
        velocities, each by an integrator away from the force.

    Rewards:
        The cost of `BallPark`, by the orders of the Lie brackets. With p the offset in radii, theta
        = log R the rotation vector in world axes and ``m = (theta_x + p_y, theta_y - p_x)`` the
        mismatch between what was rolled and what is turned, ``position`` = ``-|p|``, ``twist`` =
        ``-sqrt(|theta_z|)``, ``mismatch`` = ``-cbrt(|m|)``, and ``angle`` = ``-|theta|`` without
        weight. ``parked`` = 1 in the step that parks the ball, and ``off`` = -1 in the step that
        leaves the plate: that costs more than to stay where one is for the whole episode.

    Starting State:
        At rest: position uniform in the square ``|X|, |Y| <= start_half_width``, attitude uniform
        on SO(3).

    Episode End:
        The episode terminates when the ball is parked: its offset is at most `position_tolerance`,
        the angle of its attitude at most `angle_tolerance` and its speed at most `speed_tolerance`.
        That step is the success (`info["is_success"]`). It terminates, too, when the ball leaves
        the plate, a disk that ends `margin` beyond the corners of the square of starts.

    Reference:
        `three_rolls` takes three straight rolls, each at full force first forward and then backward
        in whole control periods, tracked by ``F = m (1 + beta) (a + k^2 (position - X) + 2 k
        (velocity - V))`` with k = 2 / s.

        Bound: a motion from rest to rest over the length L takes ``2 sqrt(L (1 + beta) m / F)`` or
        more, and no path is shorter than ``L = max(distance, radius angle)``, less the tolerances.
        A ball need not stop at corners.

    Version History:
        v0: first version.

    Source:
        Neimark & Fufaev, *Dynamics of Nonholonomic Systems*, chapter III; Jurdjevic 1993, "The
        geometry of the plate-ball problem", doi:10.1007/BF00375605; three rolls: Hammersley 1983,
        "Oxford commemoration ball", LMS Lecture Notes 79.
    """

    dt: float = setting(0.2, Number("control period", "s", 1e-4, 1.0))
    n_substeps: int = setting(6, Integer("integrator steps per control period", 1, 1000))
    m: Range = physical(1.0, "mass", "kg")
    radius: Range = physical(1.0, "radius of the ball", "m")
    beta: Range = setting(
        0.4, Number("inertia ratio I / (m radius^2)", "1", 1e-3, 2.0 / 3.0, drawn=True)
    )
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    turntable_rate: Range = setting(
        0.0, Number("rate of the surface about its normal", "rad/s", -10.0, 10.0, drawn=True)
    )
    force: float = setting(4.0, Number("largest force at the centre", "N", 1e-6, 1e6))
    start_half_width: float = setting(2.0, Number("half side of the start square", "m", 0.0, 20.0))
    margin: float = setting(7.0, Number("plate beyond the corners of that square", "m", 0.1, 1e3))
    position_tolerance: float = setting(0.1, Number("largest offset when parked", "m", 1e-6, 10.0))
    angle_tolerance: float = setting(0.15, Number("largest angle when parked", "rad", 1e-6, 3.2))
    speed_tolerance: float = setting(0.05, Number("largest speed when parked", "m/s", 1e-6, 10.0))
    weight_position: float = setting(0.01, Number("weight of -|p|", "1", -1e3, 1e3))
    weight_twist: float = setting(0.02, Number("weight of -sqrt|theta_z|", "1", -1e3, 1e3))
    weight_mismatch: float = setting(0.02, Number("weight of -cbrt|m|", "1", -1e3, 1e3))
    weight_angle: float = setting(0.0, Number("weight of -|theta|", "1", -1e3, 1e3))
    weight_parked: float = setting(10.0, Number("weight of the step that parks", "1", -1e3, 1e3))
    weight_off: float = setting(20.0, Number("weight of leaving the plate", "1", -1e3, 1e3))

    system_type: ClassVar = DynamicBall
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("position", "twist", "mismatch", "angle", "parked", "off")
    cost_unit: ClassVar = "impulse of the force [N s]"
    still: ClassVar = ("tilt", "tilt_rate")

    def constants(self) -> tuple[float, ...]:
        """Weights, force, tolerances, start square, edge."""
        return (
            self.weight_position,
            self.weight_twist,
            self.weight_mismatch,
            self.weight_angle,
            self.weight_parked,
            self.weight_off,
            self.force,
            self.position_tolerance,
            self.angle_tolerance,
            self.speed_tolerance,
            self.start_half_width,
            self._edge(),
        )

    def actions(self) -> tuple[Entry, ...]:
        """Horizontal force, in a disc."""
        return tuple(Entry(f"F{k}", "N", "world, disc", -self.force, self.force) for k in "XY")

    def features(self) -> tuple[Entry, ...]:
        """Offset in radii, velocity in radii per second."""
        return (
            *(Entry(f"{k} / radius", "1", "world", -FAR, FAR) for k in "XY"),
            *(Entry(f"V{k} / radius", "1/s", "world", -_FAST, _FAST) for k in "XY"),
        )

    def largest_rate(self) -> float:
        """Rolling rate at the speed that no push exceeds on this plate."""
        beta, turntable = span(self.beta), max(abs(rate) for rate in span(self.turntable_rate))
        push = self.force / (span(self.m)[0] * (1.0 + beta[0]))
        gyration = turntable * beta[1] / (1.0 + beta[1])
        speed = speed_bound(push, self._edge(), gyration) + push * self.dt
        return (speed + turntable * self._edge()) / span(self.radius)[0]

    def _edge(self) -> float:
        """Radius of the plate [m]."""
        return math.sqrt(2.0) * self.start_half_width + self.margin
