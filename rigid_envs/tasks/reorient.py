"""Turn a body at rest to an attitude that is drawn: a goal environment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, free_body, goals, randoms
from rigid_envs.kernels.actions import clip_to_box, single
from rigid_envs.kernels.algebra import Quaternion, Row, Vector, matrix
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import select, sincos
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import FreeBody
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting
from rigid_envs.tasks.moments import fastest, spun_up

__all__ = ["Reorient"]

_FAST = 20.0  # rad/s; observed no further than this
_STEPS = 100  # time limit of the registered environment, for which rates are bounded
_TORQUE, _ANGLE, _RATE = range(1, 4)  # constants after the weight
_REST = (0.0, 0.0, 0.0)


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """At rest; attitudes of body and goal uniform on SO(3)."""
    q, goal = randoms.quaternion(stream, 1 << 20), randoms.quaternion(stream, 1 << 21)
    return (*q, 0.0, 0.0, 0.0), goal


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Torque about the three body axes."""
    return y, (c[_TORQUE] * a[0], c[_TORQUE] * a[1], c[_TORQUE] * a[2])


@scalar
def pose(q: Quaternion, omega: Vector) -> Row:
    """The nine entries of R and omega [rad/s], rounded to float32 as they are observed."""
    r = matrix(q)
    return (
        single(r[0]),
        single(r[1]),
        single(r[2]),
        single(r[3]),
        single(r[4]),
        single(r[5]),
        single(r[6]),
        single(r[7]),
        single(r[8]),
        single(min(max(omega[0], -_FAST), _FAST)),
        single(min(max(omega[1], -_FAST), _FAST)),
        single(min(max(omega[2], -_FAST), _FAST)),
    )


@scalar
def reached(achieved: Row, desired: Row, c: Row) -> bool:
    """Angle and rate within tolerance; the angle is that of tr(R^T R') = 1 + 2 cos."""
    trace, square = 0.0, 0.0
    for k in range(9):
        trace += achieved[k] * desired[k]
    for k in range(9, 12):
        square += (achieved[k] - desired[k]) * (achieved[k] - desired[k])
    _, cosine = sincos(c[_ANGLE])
    near: bool = trace >= 1.0 + 2.0 * cosine
    return near & (square <= c[_RATE] * c[_RATE])


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Whether the goal is reached, and the torque."""
    here = pose((y[0], y[1], y[2], y[3]), (y[4], y[5], y[6]))
    success = reached(here, pose((memo[0], memo[1], memo[2], memo[3]), _REST), c)
    torque = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    return memo, (select(success, 0.0, -1.0),), dt * torque, success, False


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Achieved and desired pose, and omega; of the goal nothing but the desired pose."""
    here = pose((y[0], y[1], y[2], y[3]), (y[4], y[5], y[6]))
    there = pose((memo[0], memo[1], memo[2], memo[3]), _REST)
    return (*here, *there, here[9], here[10], here[11])


GOAL = (0.0,) * 12
SHAPES = Shapes(*free_body.SHAPES, (1.0,) * 3, (1.0, 0.0, 0.0, 0.0), (0.0,) * 3, (0.0,) * 4)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        free_body.step,
        free_body.restore,
        free_body.WEIGHTS,
        clip_to_box,
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
    episode.reset(free_body.derive, start, observe, SHAPES, memory, rows, mode)


@kernel
def reach(achieved: Array, desired: Array, constants: Array, out: Array) -> None:
    """`goals.reach_rows` of this task."""
    goals.reach_rows(reached, GOAL, SHAPES.constants, achieved, desired, constants, out)


@dataclass(frozen=True)
class Reorient(Task):
    """Turn a body from rest to rest to an attitude that is drawn anew in every episode.

    A goal environment with sparse reward. Goals are the rotation matrix R (body to world, row by
    row) and the angular velocity (body axes, [rad/s]), which is zero for all goals that are drawn;
    what is achieved on the way has another one.

    The turn must be begun and stopped in time, and on the way the gyroscopic term, as large as the
    torque at the rates that a fast turn needs, turns the axis of rotation in the body. The episode
    goes on at the goal, where staying pays best.

    Physics:
        Euler's equations ``I omega' = I omega x omega + tau``, all in body axes, which are the
        principal axes. Without torque the energy T and the angular momentum L in space are
        conserved.

        The gyroscopic term is at most ``(I_max - I_min) |omega|^2 / 2``, 1 N m at 1 rad/s for the
        default body; the torque is 0.5 N m about each axis. From rest, the rate is at most
        ``a t``, ``a = torque sqrt((1 / I1 + 1 / I2 + 1 / I3) / I_min)``, as energy is gained at
        ``omega . tau``, and backwards from the goal likewise. So no turn from rest to rest by an
        angle takes less than ``2 sqrt(angle / a)``
        (`rigid_envs.control.attitude.least_slew_time`).

        The energy that full torque could give the body before the time limit bounds its rates.

    Rewards:
        ``reached`` = 0 where angle and rate are within tolerance, else -1: the return counts the
        steps away from the goal. `compute_reward` gives the same for any pair of goals.

    Starting State:
        At rest; the attitudes of body and goal are uniform on SO(3), each by itself.

    Episode End:
        The episode does not end before its time. Success (`info["is_success"]`): the angle to the
        goal is at most `angle_tolerance`, and the difference of the angular velocities at most
        `rate_tolerance`.

    Reference:
        `quaternion_pd` is quaternion feedback, ``tau = -I (2 k vec(e) + 2 sqrt(k) omega)`` with ``k
        = 6 torque / I_max`` and e the turn from goal to body, of the two signs the one with w >= 0,
        so that the body does not unwind the long way.

        Bound: ``2 sqrt(angle / a)``; the tolerances let the goal be reached a little earlier. A
        half turn about e1 by one torque, full and then full against it, takes ``sqrt(a I1 /
        torque)`` times the bound.

    Version History:
        v0: first version.

    Source:
        Wie & Barba 1985, doi:10.2514/3.19988; unwinding: Bhat & Bernstein 2000,
        doi:10.1016/S0167-6911(99)00090-0; hindsight experience replay: Andrychowicz et al. 2017,
        arXiv:1707.01495.
    """

    n_substeps: int = setting(2, Integer("integrator steps per control period", 1, 1000))
    I1: Range = physical(1.0, "principal moment about e1", "kg m^2")
    I2: Range = physical(2.0, "principal moment about e2", "kg m^2")
    I3: Range = physical(3.0, "principal moment about e3", "kg m^2")
    torque: float = setting(0.5, Number("largest torque about each axis", "N m", 1e-6, 1e6))
    angle_tolerance: float = setting(
        0.1, Number("largest angle to the goal when reached", "rad", 1e-3, 3.2)
    )
    rate_tolerance: float = setting(
        0.05, Number("largest rate off the goal when reached", "rad/s", 1e-6, 1e3)
    )
    weight_reached: float = setting(1.0, Number("weight of not being there", "1", -1e3, 1e3))

    system_type: ClassVar = FreeBody
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    reach: ClassVar = staticmethod(reach)
    n_goal: ClassVar = 12
    terms: ClassVar = ("reached",)
    cost_unit: ClassVar = "torque impulse [N m s]"
    memo_names: ClassVar = ("goal_w", "goal_x", "goal_y", "goal_z")

    def constants(self) -> tuple[float, ...]:
        """Weight, torque, tolerances."""
        return (
            self.weight_reached,
            self.torque,
            min(self.angle_tolerance, math.pi),
            self.rate_tolerance,
        )

    def actions(self) -> tuple[Entry, ...]:
        """Torques about the body axes."""
        return tuple(Entry(f"tau{k}", "N m", "body", -self.torque, self.torque) for k in (1, 2, 3))

    def features(self) -> tuple[Entry, ...]:
        """Achieved and desired pose, angular velocity."""
        rates = tuple(Entry(f"omega{k}", "rad/s", "body", -_FAST, _FAST) for k in (1, 2, 3))
        turn = (Entry(f"R{i}{j}", "1", "body to world", -1.0, 1.0) for i in "123" for j in "123")
        goal = (*turn, *rates)
        return (*goal, *goal, *rates)

    def largest_rate(self) -> float:
        """What full torque can make of rest before the time limit."""
        moments, time = (self.I1, self.I2, self.I3), _STEPS * self.dt
        return fastest(moments, spun_up(moments, 0.0, (self.torque,) * 3, time))
