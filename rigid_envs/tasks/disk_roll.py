"""Keep a slow disk rolling, on a commanded circle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, randoms, rolling_disk
from rigid_envs.kernels.actions import clip_to_interval
from rigid_envs.kernels.algebra import Row, compose
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import atan2, fma, select, sincos
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import RollingDisk
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.disks import TIGHT, fastest_disk, rolling
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting

__all__ = ["DiskRoll", "DiskRollRandom"]

_FAST = 50.0  # rad/s; observed no further than this
_FALLEN = 0.5 * math.sqrt(3.0)  # sine of a lean of 60 degrees
(_TORQUE, _TOLERANCE, _HOLD, _GOAL, _GOALS, _LEAN, _RATE, _SPEED, _SPEEDS) = range(3, 12)


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """Near upright, slower than the speed at which the disk stands by itself; a circle."""
    lean = c[_LEAN] * (2.0 * randoms.uniform(stream, 0) - 1.0)
    wn = c[_RATE] * (2.0 * randoms.uniform(stream, 1) - 1.0)
    wl = c[_RATE] * (2.0 * randoms.uniform(stream, 2) - 1.0)
    share = fma(c[_SPEEDS], randoms.uniform(stream, 3), c[_SPEED])
    w3 = share * math.sqrt(p[0] * p[4] * p[1] * p[2] / (p[3] * p[6]))
    side = select(randoms.uniform(stream, 4) < 0.5, -1.0, 1.0)
    goal = side * fma(c[_GOALS], randoms.uniform(stream, 5), c[_GOAL])
    heading, phase = randoms.direction(stream, 1 << 20), randoms.direction(stream, 1 << 21)
    sine, cosine = sincos(0.25 * math.pi + 0.5 * lean)
    turned = compose((heading[0], 0.0, 0.0, heading[1]), (cosine, sine, 0.0, 0.0))
    q = compose(turned, (phase[0], 0.0, 0.0, phase[1]))
    n1, n2 = 2.0 * phase[0] * phase[1], phase[0] * phase[0] - phase[1] * phase[1]
    omega = (fma(n1, wn, -n2 * wl), fma(n2, wn, n1 * wl), w3)
    return (*q, *omega, 0.0, 0.0), (0.0, goal)


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Torque about the direction of travel."""
    return y, (0.0, c[_TORQUE] * a[0], 0.0)


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Error of the curvature, lean and torque; for how long the error was small; the fall."""
    sine, cosine, _, _, _, curvature = rolling(y)
    wrong = abs(curvature - memo[1]) / abs(memo[1])
    held = select(wrong <= c[_TOLERANCE], memo[0] + 1.0, 0.0)
    fallen = abs(sine) > _FALLEN
    effort = u[1] / c[_TORQUE]
    success = (held * dt >= c[_HOLD] * (1.0 - 1e-9)) & (abs(sine) <= _FALLEN)
    terms = (1.0 / (1.0 + 10.0 * wrong), cosine, -effort * effort)
    return (held, memo[1]), terms, dt * abs(u[1]), success, fallen


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Lean and its rate, turn and roll rate, curvature and what it should be."""
    sine, cosine, rate, wn, w3, curvature = rolling(y)
    return (
        atan2(sine, cosine),
        min(max(rate, -_FAST), _FAST),
        min(max(wn, -_FAST), _FAST),
        min(max(w3, -_FAST), _FAST),
        curvature,
        memo[1],
    )


SHAPES = Shapes(*rolling_disk.SHAPES, (1.0,) * 5, (0.0, 1.0), (0.0,), (0.0,) * 12)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        rolling_disk.step,
        rolling_disk.restore,
        rolling_disk.WEIGHTS,
        clip_to_interval,
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
    episode.reset(rolling_disk.derive, start, observe, SHAPES, memory, rows, mode)


@dataclass(frozen=True)
class DiskRoll(Task):
    """Keep a disk rolling that is too slow to stand, and lead it round a commanded circle.

    A disk rolls at 0.5 to 0.95 of the speed above which it stands by itself, and is to be led round
    a circle of a curvature that is drawn anew in every episode; where the circle lies is free. The
    only control is a torque about the direction of travel.

    Why it is hard: the torque does not act on the turn rate and the roll rate at all; those follow
    the lean, as when a bicycle is steered by leaning. So the disk must be leaned as far as the
    circle asks for, and held there against its weight.

    Physics:
        With the turn rate wn about the radius that points up, the roll rate w3 about the axis and
        theta = pi / 2 + lean, ``d(wn sin(theta)) = (I3 / I1) w3 sin(theta) dtheta`` and ``dw3 = m
        r^2 / (I3 + m r^2) wn dtheta``, whatever the torque. Without it the energy is conserved.

        Upright rolling is stable where ``I3 (I3 + m r^2) w3^2 > I1 m g r``: a disk above ``w3^2 = g
        / (3 r)``, a hoop above ``g / (4 r)``. Below, a small lean grows, and left alone the disk
        falls or reels.

    Rewards:
        ``circle`` = ``1 / (1 + 10 e)`` with e the relative error of the curvature of the way of the
        contact, ``upright`` = ``cos(lean)``, which is paid for rolling on, and ``effort`` =
        ``-(tau / torque)^2``.

    Starting State:
        Lean uniform within `start_lean`, turn rate and lean rate each within `start_rate`, the roll
        rate between `start_speed` and `start_speed` + `start_spread` of the threshold. The
        commanded curvature times radius is to either side, between `goal_curvature` and
        `goal_curvature` + `goal_spread`. Heading and phase are uniform.

    Episode End:
        Success (`info["is_success"]`): e has been at most `tolerance` throughout the last `hold`
        seconds, and the disk has not fallen. The episode terminates when it has, at a lean of more
        than 60 degrees.

    Reference:
        `lqr` is the linear-quadratic regulator of the lean, about that with which the disk rolls on
        the commanded circle, and the torque that holds it there.

    Version History:
        v0: first version.

    Source:
        Routh, *Advanced Rigid Dynamics*, section 244; O'Reilly 1996, "The dynamics of rolling disks
        and sliding disks", doi:10.1007/BF01833295.
    """

    dt: float = setting(0.05, Number("control period", "s", 1e-4, 1.0))
    n_substeps: int = setting(3, Integer("integrator steps per control period", 1, 1000))
    m: Range = physical(1.0, "mass", "kg")
    radius: Range = physical(1.0, "radius of the rim", "m")
    I1: Range = physical(0.25, "moment about a diameter", "kg m^2")
    I3: Range = physical(0.5, "moment about the axis", "kg m^2")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    torque: float = setting(3.0, Number("largest lean torque", "N m", 1e-6, 1e6))
    goal_curvature: float = setting(0.1, Number("least curvature * radius", "1", 1e-3, 1.0))
    goal_spread: float = setting(0.15, Number("curvatures above the least", "1", 0.0, 1.0))
    start_lean: float = setting(0.1, Number("largest lean at the start", "rad", 0.0, 1.0))
    start_rate: float = setting(0.1, Number("largest turn and lean rate", "rad/s", 0.0, 1e3))
    start_speed: float = setting(0.5, Number("least roll rate / threshold", "1", 1e-3, 10.0))
    start_spread: float = setting(0.45, Number("roll rates above the least", "1", 0.0, 10.0))
    tolerance: float = setting(0.05, Number("largest relative error of a success", "1", 1e-6, 1.0))
    hold: float = setting(5.0, Number("time within tolerance", "s", 0.0, 1e4))
    weight_circle: float = setting(0.5, Number("weight of the circle term", "1", -1e3, 1e3))
    weight_upright: float = setting(0.5, Number("weight of the upright term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    system_type: ClassVar = RollingDisk
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("circle", "upright", "effort")
    cost_unit: ClassVar = "torque impulse [N m s]"
    memo_names: ClassVar = ("held", "goal_curvature")

    def constants(self) -> tuple[float, ...]:
        """Weights, torque, tolerance, hold, circles, start."""
        return (
            self.weight_circle,
            self.weight_upright,
            self.weight_effort,
            self.torque,
            self.tolerance,
            self.hold,
            self.goal_curvature,
            self.goal_spread,
            self.start_lean,
            self.start_rate,
            self.start_speed,
            self.start_spread,
        )

    def actions(self) -> tuple[Entry, ...]:
        """Torque about the direction of travel."""
        return (Entry("tau_lean", "N m", "direction of travel", -self.torque, self.torque),)

    def features(self) -> tuple[Entry, ...]:
        """Lean and its rate, turn and roll rate, curvature and its goal."""
        return (
            Entry("lean", "rad", "theta - pi / 2", -0.5 * math.pi, 0.5 * math.pi),
            Entry("theta'", "rad/s", "direction of travel", -_FAST, _FAST),
            Entry("wn", "rad/s", "radius that points up", -_FAST, _FAST),
            Entry("w3", "rad/s", "axis", -_FAST, _FAST),
            Entry("curvature * radius", "1", "path of the contact", -TIGHT, TIGHT),
            Entry("goal curvature * radius", "1", "path of the contact", -2.0, 2.0),
        )

    def largest_rate(self) -> float:
        """What gravity and full torque make of the fastest start before the disk has fallen."""
        parameters = (self.m, self.radius, self.I1, self.I3, self.g)
        speed = self.start_speed + self.start_spread
        return fastest_disk(parameters, speed, self.start_rate, self.torque)


@dataclass(frozen=True)
class DiskRollRandom(DiskRoll):
    """Keep a wheel rolling on a commanded circle that is drawn anew in every episode.

    `DiskRoll` with mass, radius and moments that are not known, from flat (I3 = 2 I1, the most that
    a body can have) to thick wheels: the threshold is 0.53 to 0.72 sqrt(g / r), and the torque that
    holds a lean differs by a factor of 1.5. Curvatures are observed as they are, so a wheel can be
    held on its circle whatever it is made of; `observe_params` shows what that is.

    Reference:
        The regulator of `DiskRoll` for the middle of the ranges, which does not know the wheel.

        Exact: the threshold ``I3 (I3 + m r^2) w3^2 = I1 m g r`` of each wheel.
    """

    n_substeps: int = setting(4, Integer("integrator steps per control period", 1, 1000))
    m: Range = physical((0.85, 1.15), "mass", "kg")
    radius: Range = physical((0.95, 1.05), "radius of the rim", "m")
    I1: Range = physical((0.3, 0.36), "moment about a diameter", "kg m^2")
    I3: Range = physical((0.5, 0.6), "moment about the axis", "kg m^2")
