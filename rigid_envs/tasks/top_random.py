"""Keep an asymmetric heavy top upright whose moments are not known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, heavy_top, randoms
from rigid_envs.kernels.actions import clip_to_box
from rigid_envs.kernels.algebra import Row, vertical
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import atan2, select
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import HeavyTop
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting, span
from rigid_envs.tasks.tops import fastest_top, tilted, weight

__all__ = ["TopRandom"]

_STEPS = 300  # time limit of the registered environment
_FAST = 30.0  # rad/s; observed no further than this
_TORQUE, _TOLERANCE, _HOLD, _TILT, _SPIN, _RATE = range(2, 8)  # constants after the two weights


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """A small tilt, a spin in either sense, small rates across it."""
    q = tilted(stream, c[_TILT] * randoms.uniform(stream, 0))
    spin = c[_SPIN] * (2.0 * randoms.uniform(stream, 1) - 1.0)
    across = randoms.in_disc(stream, 1 << 22)
    omega = (c[_RATE] * across[0], c[_RATE] * across[1], spin)
    return (*q, *omega, 0.0, 0.0, 0.0, 0.0), (0.0,)


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Torque about the three body axes."""
    t = c[_TORQUE]
    return y, (t * a[0], t * a[1], t * a[2], 0.0, 0.0, 0.0, 0.0, 0.0)


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Tilt, torque, and for how long the tilt has been small."""
    torque, hold = c[_TORQUE], c[_HOLD]
    up = vertical((y[0], y[1], y[2], y[3]))
    tilt = atan2(math.sqrt(up[0] * up[0] + up[1] * up[1]), up[2])
    square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    held = select(tilt < c[_TOLERANCE], memo[0] + 1.0, 0.0)
    terms = (1.0 / (1.0 + 10.0 * tilt), -square * (1.0 / (3.0 * torque * torque)))
    return (held,), terms, dt * math.sqrt(square), held * dt >= hold * (1.0 - 1e-9), False


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Angular velocity in body axes, the frame of the torque."""
    return (
        min(max(y[4], -_FAST), _FAST),
        min(max(y[5], -_FAST), _FAST),
        min(max(y[6], -_FAST), _FAST),
    )


SHAPES = Shapes(*heavy_top.SHAPES, (1.0,) * 6, (0.0,), (0.0,) * 3, (0.0,) * 8)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        heavy_top.step,
        heavy_top.restore,
        heavy_top.WEIGHTS,
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
    episode.reset(heavy_top.derive, start, observe, SHAPES, memory, rows, mode)


@dataclass(frozen=True)
class TopRandom(Task):
    """Keep an asymmetric heavy top upright; its moments are drawn in every episode.

    Three different moments leave the top, besides its energy, only the vertical momentum: neither
    its spin nor its tilt can be foretold for long. Left alone from the starts here it falls and
    tumbles for ever, without order. The spin itself pulls the tilt round in a body that answers
    differently about e1 and e2, and only its torque, about all three body axes, is at hand.

    The moments are drawn anew in every episode; `observe_params` shows them.

    Physics:
        ``I omega' = I omega x omega + m g ell (G2, -G1, 0) + tau`` about the pivot, with the
        vertical G in body axes, ``G' = G x omega``. Without torque the energy and the vertical
        momentum are conserved; in general there is no further integral.

        The free motion is chaotic: neighbouring motions part exponentially. The ranges keep ``I3 <
        I1 < I2`` for every top, and ``I2 <= I1 + I3``, as every body must.

        The energy that gravity and full torque could give the top before the time limit bounds its
        rates.

    Rewards:
        ``upright`` = ``1 / (1 + 10 theta)`` with the tilt theta: steepest at the vertical, and not
        flat anywhere. ``effort`` = ``-|tau|^2 / (3 torque^2)``, small beside it.

    Starting State:
        The tilt is uniform up to `start_tilt`, omega3 uniform up to `start_spin` in either sense,
        and the rates across e3 uniform in a disk of radius `start_rate`. The direction of the tilt
        and the phase of the body are uniform.

    Episode End:
        The episode does not end before its time. Success (`info["is_success"]`): the tilt has been
        below `tolerance` throughout the last `hold` seconds.

    Reference:
        `lqr` is the linear-quadratic regulator of the upright top that turns about e3, linear in
        (G1, G2, omega1, omega2) with a gain for every omega3, for the middle of the ranges. The
        torque about e3 is left alone.

    Version History:
        v0: first version.

    Source:
        Goldstein, Poole & Safko, *Classical Mechanics*, sections 5.5 and 5.7; that there is no
        further integral: Ziglin 1983, "Branching of solutions and the nonexistence of first
        integrals in Hamiltonian mechanics II", Functional Analysis and Its Applications 17.
    """

    dt: float = setting(0.05, Number("control period", "s", 1e-4, 1.0))
    n_substeps: int = setting(2, Integer("integrator steps per control period", 1, 1000))
    I1: Range = physical((0.85, 1.0), "moment about e1, at the pivot", "kg m^2")
    I2: Range = physical((1.05, 1.25), "moment about e2, at the pivot", "kg m^2")
    I3: Range = physical((0.45, 0.65), "moment about e3", "kg m^2")
    m: Range = physical(1.0, "mass", "kg")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    ell: Range = physical(1.0 / 9.81, "distance from pivot to centre of mass", "m")
    torque: float = setting(0.3, Number("largest torque about each axis", "N m", 1e-6, 1e6))
    start_tilt: float = setting(0.2, Number("largest tilt at the start", "rad", 0.0, math.pi))
    start_spin: float = setting(
        2.0, Number("largest spin at the start, in either sense", "rad/s", 0.0, 1e3)
    )
    start_rate: float = setting(
        0.05, Number("largest rate across e3 at the start", "rad/s", 0.0, 1e3)
    )
    tolerance: float = setting(0.1, Number("largest tilt of a success", "rad", 1e-6, math.pi))
    hold: float = setting(5.0, Number("time within tolerance at the end", "s", 0.0, 1e4))
    weight_upright: float = setting(1.0, Number("weight of the upright term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    system_type: ClassVar = HeavyTop
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("upright", "effort")
    cost_unit: ClassVar = "torque impulse [N m s]"
    memo_names: ClassVar = ("held",)

    def constants(self) -> tuple[float, ...]:
        """Weights, torque, tolerance, hold, start."""
        return (
            self.weight_upright,
            self.weight_effort,
            self.torque,
            self.tolerance,
            self.hold,
            self.start_tilt,
            self.start_spin,
            self.start_rate,
        )

    def actions(self) -> tuple[Entry, ...]:
        """Torques about the body axes."""
        return tuple(Entry(f"tau{k}", "N m", "body", -self.torque, self.torque) for k in (1, 2, 3))

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity."""
        return tuple(Entry(f"omega{k}", "rad/s", "body", -_FAST, _FAST) for k in (1, 2, 3))

    def largest_rate(self) -> float:
        """What gravity and full torque make of the fastest start before the time limit."""
        moments = (self.I1, self.I2, self.I3)
        mgl = weight(self.m, self.g, self.ell)
        push = self.torque * math.sqrt(sum(1.0 / span(moment)[0] for moment in moments))
        return fastest_top(moments, self.start_spin, self.start_rate, mgl, push * _STEPS * self.dt)
