"""Bring a tumbling body to rest by impulses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, free_body, randoms
from rigid_envs.kernels.actions import clip_to_ball
from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import FreeBody
from rigid_envs.tasks.base import ROTATION, Array, Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting, span
from rigid_envs.tasks.moments import fastest

__all__ = ["Detumble"]

_FAST = 20.0  # rad/s; observed no further than this
_FAR = 100.0  # bound of the momentum term
_STEPS = 50  # time limit of the registered environment, for which rates are bounded
_IMPULSE, _MOMENTUM, _TOLERANCE = range(2, 5)  # constants after the two weights


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """Angular momentum uniform in a ball; attitude uniform on SO(3)."""
    a, b, d = randoms.in_ball(stream, 0)
    q, L = randoms.quaternion(stream, 1 << 20), c[_MOMENTUM]
    return (*q, L * a * p[3], L * b * p[4], L * d * p[5]), ()


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """The impulse changes omega at once; it is handed on as the input, for `judge` to see."""
    j1, j2, j3 = c[_IMPULSE] * a[0], c[_IMPULSE] * a[1], c[_IMPULSE] * a[2]
    q = (y[0], y[1], y[2], y[3])
    return (*q, y[4] + j1 * p[3], y[5] + j2 * p[4], y[6] + j3 * p[5]), (j1, j2, j3)


@scalar
def drift(y: Row, u: Row, p: Row, h: float) -> Row:
    """Free motion: the input is an impulse that has acted already."""
    return free_body.step(y, (0.0, 0.0, 0.0), p, h)


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Squares of momentum and impulse."""
    L1, L2, L3 = p[0] * y[4], p[1] * y[5], p[2] * y[6]
    scale = 1.0 / c[_MOMENTUM]
    momentum = (L1 * L1 + L2 * L2 + L3 * L3) * (scale * scale)
    square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    terms = (-min(momentum, _FAR), -square / (c[_IMPULSE] * c[_IMPULSE]))
    success = momentum < c[_TOLERANCE] * c[_TOLERANCE]
    return memo, terms, math.sqrt(square), success, False


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Angular velocity."""
    return (
        min(max(y[4], -_FAST), _FAST),
        min(max(y[5], -_FAST), _FAST),
        min(max(y[6], -_FAST), _FAST),
    )


SHAPES = Shapes(*free_body.SHAPES, (1.0,) * 3, (), (0.0,) * 3, (0.0,) * 5)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        drift,
        free_body.restore,
        free_body.WEIGHTS,
        clip_to_ball,
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


@dataclass(frozen=True)
class Detumble(Task):
    """Bring the angular momentum of a tumbling body to zero by impulses.

    Each step is an impulse, which changes the momentum at once, and then a free drift, which turns
    L in the body and keeps its size. What is observed is the angular velocity, which the drift
    changes in a way that is not linear. But impulses act on the momentum, and of it only the size
    counts, which the drift keeps: what is best is known exactly.

    Physics:
        An impulse j changes the momentum by ``L -> L + j``; then the body drifts freely for a
        control period, by Euler's equations ``I omega' = I omega x omega``. Momentum and impulse
        are vectors in body axes, which are the principal axes, and ``omega = I^-1 L``. The drift
        keeps the size of L, and L in space, to rounding.

        The momentum that largest impulses could add up to before the time limit bounds the rates.

    Rewards:
        ``momentum`` = ``-(|L| / start_momentum)^2`` after the step (not below -100) and ``impulse``
        = ``-(|j| / impulse)^2``: the quadratic cost, of which the optimum is known.

    Starting State:
        The angular momentum is uniform in a ball of radius `start_momentum`; the attitude is
        uniform on SO(3).

    Episode End:
        The episode does not end before its time. Success (`info["is_success"]`): |L| is below
        `tolerance` times `start_momentum`.

    Reference:
        Exact: with a and b the weights over the squares of start_momentum and impulse, the cost to
        go is ``P |L|^2`` with the root ``P = (-a + sqrt(a^2 + 4 a b)) / 2`` of the scalar Riccati
        equation ``P = b (a + P) / (a + b + P)``, under the law ``j = -L (a + P) / (a + b + P)``,
        which is `riccati`: in n steps it pays ``P (|L_0|^2 - |L_n|^2)``. With equal weights it
        stays within the ball of impulses for all starts.

        In the least time, L takes ``|L| / impulse`` steps, rounded up. `brake` does it, by the
        largest impulse against L.

    Version History:
        v0: first version.

    Source:
        Bertsekas, *Dynamic Programming and Optimal Control*, volume I, section 4.1.
    """

    n_substeps: int = setting(6, Integer("integrator steps per control period", 1, 1000))
    rotation: str = setting("none", ROTATION)
    I1: Range = physical(1.0, "principal moment about e1", "kg m^2")
    I2: Range = physical(2.0, "principal moment about e2", "kg m^2")
    I3: Range = physical(3.0, "principal moment about e3", "kg m^2")
    impulse: float = setting(0.5, Number("largest impulse of a step", "N m s", 1e-6, 1e6))
    start_momentum: float = setting(3.0, Number("largest |L| at the start", "N m s", 1e-6, 1e6))
    tolerance: float = setting(
        0.01, Number("largest |L| of a success / start_momentum", "1", 1e-6, 1.0)
    )
    weight_momentum: float = setting(1.0, Number("weight of the momentum term", "1", -1e3, 1e3))
    weight_impulse: float = setting(1.0, Number("weight of the impulse term", "1", -1e3, 1e3))

    system_type: ClassVar = FreeBody
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("momentum", "impulse")
    cost_unit: ClassVar = "impulse [N m s]"

    def constants(self) -> tuple[float, ...]:
        """Weights, impulse, start, tolerance."""
        return (
            self.weight_momentum,
            self.weight_impulse,
            self.impulse,
            self.start_momentum,
            self.tolerance,
        )

    def actions(self) -> tuple[Entry, ...]:
        """Impulse, in a ball."""
        return tuple(
            Entry(f"j{k}", "N m s", "body, ball", -self.impulse, self.impulse) for k in (1, 2, 3)
        )

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity."""
        return tuple(Entry(f"omega{k}", "rad/s", "body", -_FAST, _FAST) for k in (1, 2, 3))

    def largest_rate(self) -> float:
        """What full impulses can make of the start before the time limit."""
        moments = (self.I1, self.I2, self.I3)
        momentum = self.start_momentum + _STEPS * self.impulse
        return fastest(moments, momentum / math.sqrt(min(span(moment)[0] for moment in moments)))
