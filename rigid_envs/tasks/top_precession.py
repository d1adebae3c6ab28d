"""Damp the nutation of a top until it precesses steadily at a commanded tilt."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, heavy_top, randoms
from rigid_envs.kernels.actions import clip_to_square
from rigid_envs.kernels.algebra import Row, vertical
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import atan2, fma, select, sincos
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import HeavyTop
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.fields import Choice, Integer, Number, Range, physical, setting, span
from rigid_envs.tasks.tops import derive_symmetric, fastest_spinning, tilted, weight

__all__ = ["TopPrecession"]

_STEPS = 400  # time limit of the registered environment
_FAST = 30.0  # rad/s; observed no further than this
_TORQUE, _TOLERANCE, _HOLD, _FAST_BRANCH, _GOAL, _GOALS, _TILT, _RATE, _SPIN, _SPINS = range(3, 13)


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """Any tilt, any rates across the axis, a spin above the critical one; a goal."""
    q = tilted(stream, c[_TILT] * randoms.uniform(stream, 0))
    critical = 2.0 * math.sqrt(p[0] * p[3] * p[4] * p[5]) / p[2]
    spin = critical * fma(c[_SPINS], randoms.uniform(stream, 1), c[_SPIN])
    goal = fma(c[_GOALS], randoms.uniform(stream, 2), c[_GOAL])
    across = randoms.in_disc(stream, 1 << 22)
    omega = (c[_RATE] * across[0], c[_RATE] * across[1], spin)
    return (*q, *omega, 0.0, 0.0, 0.0, 0.0), (0.0, goal)


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Torque about e1 and e2."""
    return y, (c[_TORQUE] * a[0], c[_TORQUE] * a[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@scalar
def precession(y: Row) -> tuple[float, float]:
    """Tilt [rad] and rate of precession phi' = (omega1 G1 + omega2 G2) / (G1^2 + G2^2) [rad/s].

    G is the vertical in body axes. At the vertical the rate is none, and 0 is given.
    """
    G = vertical((y[0], y[1], y[2], y[3]))
    square = G[0] * G[0] + G[1] * G[1]
    rate = (y[4] * G[0] + y[5] * G[1]) / max(square, 1e-12)
    return atan2(math.sqrt(square), G[2]), min(max(rate, -_FAST), _FAST)


@scalar
def steady(tilt: float, spin: float, p: Row, fast_branch: float) -> float:
    """Rate of steady precession: a root of I1 cos(theta) x^2 - I3 omega3 x + m g ell = 0.

    Where there is none (a slow spin, from outside) both are taken where they meet.
    """
    _, cosine = sincos(tilt)
    L, mgl, level = p[2] * spin, p[3] * p[4] * p[5], p[0] * cosine
    root = math.sqrt(max(L * L - 4.0 * level * mgl, 0.0))
    total = L + select(L < 0.0, -root, root)
    slow = 2.0 * mgl / select(abs(total) < 1e-9, 1e-9, total)
    fast = 0.5 * total / select(abs(level) < 1e-9, 1e-9, level)
    rate = select(fast_branch > 0.5, fast, slow)
    return min(max(rate, -_FAST), _FAST)


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Errors of tilt and rate, torque, and for how long both errors have been small."""
    goal = steady(memo[1], y[6], p, c[_FAST_BRANCH])
    tilt, rate = precession(y)
    off = abs(tilt - memo[1])
    wrong = abs(rate - goal) / abs(goal)
    square = u[0] * u[0] + u[1] * u[1]
    near = (off <= c[_TOLERANCE] * memo[1]) & (wrong <= c[_TOLERANCE])
    held = select(near, memo[0] + 1.0, 0.0)
    terms = (
        1.0 / (1.0 + 10.0 * off),
        1.0 / (1.0 + 10.0 * wrong),
        -square * (1.0 / (2.0 * c[_TORQUE] * c[_TORQUE])),
    )
    success = held * dt >= c[_HOLD] * (1.0 - 1e-9)
    return (held, memo[1]), terms, dt * math.sqrt(square), success, False


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Angular velocity in body axes, tilt and rate of precession, and what both should be."""
    tilt, rate = precession(y)
    return (
        min(max(y[4], -_FAST), _FAST),
        min(max(y[5], -_FAST), _FAST),
        min(max(y[6], -_FAST), _FAST),
        tilt,
        rate,
        memo[1],
        steady(memo[1], y[6], p, c[_FAST_BRANCH]),
    )


SHAPES = Shapes(*heavy_top.SHAPES, (1.0,) * 6, (0.0,) * 2, (0.0,) * 2, (0.0,) * 13)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        heavy_top.step,
        heavy_top.restore,
        heavy_top.WEIGHTS,
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
    episode.reset(derive_symmetric, start, observe, SHAPES, memory, rows, mode)


@dataclass(frozen=True)
class TopPrecession(Task):
    """Bring a nutating top to steady precession at a commanded tilt.

    A top that is released anyhow nods between two tilts while it precesses. At every tilt there are
    two rates at which it would precess without nodding: a slow one, kept up by gravity, and a fast
    one, nearly that of the free body. The commanded tilt and its rate on the chosen `branch` are
    observed.

    The steady motion needs no torque at all; the way there does, and it leads sideways: pushed
    over, a top goes round, and pushed round it rises or falls. The torque acts about e1 and e2,
    axes that turn with the spin, which nothing changes.

    Physics:
        ``I omega' = I omega x omega + (tau1, tau2, 0) + ell e3 x R^T (0, 0, -m g)`` about the
        pivot, in body axes. The top is symmetric, I1 = I2 (`I_perp`), and omega3 is conserved under
        any action. Without torque the energy and the vertical momentum are conserved too.

        Steady precession at the tilt theta has one of the two rates that are the roots of
        ``I1 cos(theta) phi'^2 - I3 omega3 phi' + m g ell = 0``. Spins are above the critical one,
        ``2 sqrt(I1 m g ell) / I3``, so that both roots exist at every tilt. By default the slow
        rates are 0.26 to 0.53 rad/s and the fast ones 1.98 to 6.17 rad/s.

        The energy that gravity and full torque could give the top before the time limit bounds its
        rates.

    Rewards:
        ``tilt`` = ``1 / (1 + 10 |theta - goal|)`` and ``rate`` = ``1 / (1 + 10 e)`` with the
        relative error e of the precession rate phi': steepest at the goal, and not flat anywhere.
        ``effort`` = ``-|tau|^2 / (2 torque^2)``, small beside them.

    Starting State:
        The commanded tilt is uniform from `goal_tilt` up to `goal_spread` above it. The tilt is
        uniform up to `start_tilt`; the spin, as a part of the critical one, uniform from
        `start_spin` up to `start_spread` above it; the rates across e3 are uniform in a disk of
        radius `start_rate`. The direction of the tilt and the phase of the body are uniform.

    Episode End:
        The episode does not end before its time. Success (`info["is_success"]`): tilt and
        precession rate have been within `tolerance` of their goals, relatively, throughout the last
        `hold` seconds.

    Reference:
        `lqr` is the linear-quadratic regulator of the steady precession, linear in (theta - goal,
        theta', phi' - rate) with a gain for every tilt and spin, on the branch of the task.

        Exact: the roots. From steady precession on either branch, actions of 0 are a success at the
        cost 0.

    Version History:
        v0: first version.

    Source:
        Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7.
    """

    dt: float = setting(0.05, Number("control period", "s", 1e-4, 1.0))
    n_substeps: int = setting(2, Integer("integrator steps per control period", 1, 1000))
    I_perp: Range = physical(1.0, "moments I1 = I2 about the pivot", "kg m^2")
    I3: Range = physical(0.5, "moment about the axis of symmetry", "kg m^2")
    m: Range = physical(1.0, "mass", "kg")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    ell: Range = physical(1.0 / 9.81, "distance from pivot to centre of mass", "m")
    branch: str = setting("slow", Choice("root of steady precession", ("slow", "fast")))
    torque: float = setting(0.5, Number("largest torque about each axis", "N m", 1e-6, 1e6))
    goal_tilt: float = setting(0.3, Number("least commanded tilt", "rad", 0.05, 0.9))
    goal_spread: float = setting(
        0.6, Number("width of the range of commanded tilts", "rad", 0.0, 0.6)
    )
    start_tilt: float = setting(1.2, Number("largest tilt at the start", "rad", 0.0, math.pi))
    start_rate: float = setting(1.0, Number("largest rate across e3 at first", "rad/s", 0.0, 1e3))
    start_spin: float = setting(1.2, Number("least spin / critical spin", "1", 1.0, 10.0))
    start_spread: float = setting(
        0.8, Number("width of the range of spins / critical spin", "1", 0.0, 10.0)
    )
    tolerance: float = setting(0.02, Number("largest relative errors of a success", "1", 1e-6, 1.0))
    hold: float = setting(5.0, Number("time within tolerance at the end", "s", 0.0, 1e4))
    weight_tilt: float = setting(0.5, Number("weight of the tilt term", "1", -1e3, 1e3))
    weight_rate: float = setting(0.5, Number("weight of the rate term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    system_type: ClassVar = HeavyTop
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("tilt", "rate", "effort")
    cost_unit: ClassVar = "torque impulse [N m s]"
    memo_names: ClassVar = ("held", "goal_tilt")
    aliases: ClassVar = {"I1": "I_perp", "I2": "I_perp"}

    def constants(self) -> tuple[float, ...]:
        """Weights, torque, tolerance, hold, branch, goals, start."""
        return (
            self.weight_tilt,
            self.weight_rate,
            self.weight_effort,
            self.torque,
            self.tolerance,
            self.hold,
            float(self.branch == "fast"),
            self.goal_tilt,
            self.goal_spread,
            self.start_tilt,
            self.start_rate,
            self.start_spin,
            self.start_spread,
        )

    def actions(self) -> tuple[Entry, ...]:
        """Torques about e1 and e2."""
        return tuple(Entry(f"tau{k}", "N m", "body", -self.torque, self.torque) for k in (1, 2))

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity, tilt and rate of precession, and their goals."""
        return (
            *(Entry(f"omega{k}", "rad/s", "body", -_FAST, _FAST) for k in (1, 2, 3)),
            Entry("theta", "rad", "world", 0.0, math.pi),
            Entry("phi'", "rad/s", "world", -_FAST, _FAST),
            Entry("goal theta", "rad", "world", 0.0, math.pi),
            Entry("goal phi'", "rad/s", "world", -_FAST, _FAST),
        )

    def largest_rate(self) -> float:
        """What gravity and full torque make of the fastest start before the time limit."""
        mgl = weight(self.m, self.g, self.ell)
        critical = 2.0 * math.sqrt(span(self.I_perp)[1] * mgl) / span(self.I3)[0]
        spin = (self.start_spin + self.start_spread) * critical
        impulse = math.sqrt(2.0) * self.torque * _STEPS * self.dt
        return fastest_spinning(self.I_perp, self.I3, spin, self.start_rate, mgl, impulse)
