"""Reverse a spin in the body by a commanded time, with the least impulse."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, free_body, randoms
from rigid_envs.kernels.actions import clip_to_box
from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import FreeBody
from rigid_envs.tasks.base import ROTATION, Array, Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting, span
from rigid_envs.tasks.moments import check_order, fastest, spun_up

__all__ = ["AxisFlip"]

_FAST = 20.0  # target rates; observed no further than this
_STEPS = 250  # time limit of the registered environment, for which rates are bounded
_RATE, _TORQUE, _TOLERANCE, _SPREAD, _LOW, _HIGH = range(2, 8)  # constants after two weights


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """Spin Omega about e2 and a perturbation uniform in a ball; the time left, uniform."""
    rate, spread = c[_RATE], c[_SPREAD]
    a, b, d = randoms.in_ball(stream, 0)
    q = randoms.quaternion(stream, 1 << 20)
    left = fma(c[_HIGH] - c[_LOW], randoms.uniform(stream, 1 << 21), c[_LOW])
    return (*q, spread * a, spread * b + rate, spread * d), (left, 1.0)


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Torque about the three body axes."""
    return y, (c[_TORQUE] * a[0], c[_TORQUE] * a[1], c[_TORQUE] * a[2])


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Spin error about -e2 once the time has come, impulse, and whether it has been small since."""
    scale = 1.0 / c[_RATE]
    e1, e2, e3 = scale * y[4], scale * y[5] + 1.0, scale * y[6]
    error = math.sqrt(e1 * e1 + e2 * e2 + e3 * e3)
    torque = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    left = memo[0] - dt
    due = left < 1e-9 * dt
    kept = select(due & (error >= c[_TOLERANCE]), 0.0, memo[1])
    spin = select(due, 1.0 / (1.0 + 10.0 * error), 0.0)
    terms = (spin, -torque / (math.sqrt(3.0) * c[_TORQUE]))
    return (left, kept), terms, dt * torque, due & (kept > 0.0), False


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Angular velocity in target rates, and the time left, as a part of the longest."""
    s = 1.0 / c[_RATE]
    return (
        min(max(s * y[4], -_FAST), _FAST),
        min(max(s * y[5], -_FAST), _FAST),
        min(max(s * y[6], -_FAST), _FAST),
        min(max(memo[0] / c[_HIGH], 0.0), 1.0),
    )


SHAPES = Shapes(*free_body.SHAPES, (1.0,) * 3, (0.0,) * 2, (0.0,) * 3, (0.0,) * 8)


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


@dataclass(frozen=True)
class AxisFlip(Task):
    """Reverse the spin in the body, from e2 to -e2, by a commanded time with the least impulse.

    L is fixed in space, but not in the body: spin about the unstable intermediate axis flips to the
    opposite direction by itself (Dzhanibekov). A push onto the unstable direction is enough, if it
    comes in time, and the smaller, the more time there is. The difficulty is to flip at the right
    moment, and not to leave -e2 again, which is as unstable as e2.

    The time T is drawn at reset and the time left is observed. From T on to the end of the episode
    the spin must stay at -e2, where holding it costs next to nothing.

    Physics:
        Euler's equations ``I omega' = I omega x omega + tau``, all in body axes, which are the
        principal axes. Without torque the energy T and the angular momentum L in space are
        conserved.

        Turning the spin by brute force takes the impulse ``2 L = 2 I2 Omega``. A push of the size
        delta onto the unstable direction flips the body after ``log(1 / delta) / lambda`` and a
        constant, with ``lambda = Omega sqrt((I2 - I1)(I3 - I2) / (I1 I3))``. So from exact spin
        about e2 the impulse falls like ``exp(-lambda T)`` with the time T that is given.

        The energy that full torque could give the body before the time limit bounds its rates.

    Rewards:
        ``spin`` = ``1 / (1 + 10 error)`` with ``error = |omega + Omega e2| / Omega`` from the
        commanded time on, 0 before: how the body gets there does not count. ``impulse`` =
        ``-|tau| / (sqrt(3) torque)``, not squared: it sums up to the impulse that is to be least.

    Starting State:
        omega is ``Omega e2`` (`spin_rate`) and a perturbation uniform in a ball of radius
        `start_spread`; the attitude is uniform on SO(3). The commanded time is uniform in
        `flip_time`.

    Episode End:
        The episode does not end before its time. Success (`info["is_success"]`): the error has been
        below `tolerance` at the commanded time and ever since.

    Reference:
        `timed` tracks the free motion that flips in time, ``tau = -1.5 Omega I (omega -
        omega_free)``, where omega_free lies on the separatrix (a tanh and a cosh of the time left).
        `brute_force` turns the spin at once, ``tau = -4 Omega I (omega + Omega e2)``.

        Exact: torque about e2 alone, from exact spin, costs ``2 L = 2 I2 Omega``.

    Version History:
        v0: first version.

    Source:
        Landau & Lifshitz, *Mechanics*, section 37; Van Damme, Mardesic & Sugny 2017,
        arXiv:1606.08237.
    """

    n_substeps: int = setting(4, Integer("integrator steps per control period", 1, 1000))
    rotation: str = setting("none", ROTATION)
    I1: Range = physical(1.0, "least principal moment", "kg m^2")
    I2: Range = physical(2.0, "middle principal moment", "kg m^2")
    I3: Range = physical(3.0, "largest principal moment", "kg m^2")
    spin_rate: float = setting(1.0, Number("rate Omega", "rad/s", 1e-3, 1e3))
    torque: float = setting(0.5, Number("largest torque about each axis", "N m", 1e-6, 1e6))
    start_spread: float = setting(
        0.1, Number("radius of the ball of perturbations at the start", "rad/s", 0.0, 1e3)
    )
    flip_time: Range = setting((12.0, 20.0), Number("commanded time T", "s", 1e-3, 1e4, drawn=True))
    tolerance: float = setting(
        0.05, Number("largest spin error of a success / Omega", "1", 1e-6, 1.0)
    )
    weight_spin: float = setting(1.0, Number("weight of the spin term", "1", -1e3, 1e3))
    weight_impulse: float = setting(1.0, Number("weight of the impulse term", "1", -1e3, 1e3))

    system_type: ClassVar = FreeBody
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("spin", "impulse")
    cost_unit: ClassVar = "torque impulse [N m s]"
    memo_names: ClassVar = ("time_left", "kept")

    def _check_parameters(self) -> None:
        check_order((self.I1, self.I2, self.I3))
        super()._check_parameters()

    def constants(self) -> tuple[float, ...]:
        """Weights, rate, torque, tolerance, start, commanded times."""
        return (
            self.weight_spin,
            self.weight_impulse,
            self.spin_rate,
            self.torque,
            self.tolerance,
            self.start_spread,
            *span(self.flip_time),
        )

    def actions(self) -> tuple[Entry, ...]:
        """Torques about the body axes."""
        return tuple(Entry(f"tau{k}", "N m", "body", -self.torque, self.torque) for k in (1, 2, 3))

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity in target rates, time left."""
        return (
            *(Entry(f"omega{k} / Omega", "1", "body", -_FAST, _FAST) for k in (1, 2, 3)),
            Entry("time left / longest", "1", "none", 0.0, 1.0),
        )

    def largest_rate(self) -> float:
        """What full torque can make of the start before the time limit."""
        moments, time = (self.I1, self.I2, self.I3), _STEPS * self.dt
        rate = self.spin_rate + self.start_spread
        return fastest(moments, spun_up(moments, rate, (self.torque,) * 3, time))
