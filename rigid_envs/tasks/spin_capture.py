"""Bring any spin to the unstable intermediate axis, by torques weaker than the tumbling."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, free_body, randoms
from rigid_envs.kernels.actions import clip_to_box
from rigid_envs.kernels.algebra import Row, vertical
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import FreeBody
from rigid_envs.tasks.base import ROTATION, Array, Entry, Task
from rigid_envs.tasks.fields import Choice, Integer, Number, Range, physical, setting, span
from rigid_envs.tasks.moments import check_order, fastest, spun_up

__all__ = ["SpinCapture"]

_FAST = 20.0  # target rates; observed no further than this
_STEPS = 600  # time limit of the registered environment, for which rates are bounded
_ACTUATORS = ("e1 e2 e3", "e1 e2", "e1 e3", "e2 e3", "e1", "e2", "e3")
_RATE, _TOLERANCE, _HOLD, _LOW, _HIGH, _TORQUE = range(3, 9)  # constants after three weights


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """Direction of spin uniform on the sphere, its rate uniform; attitude uniform on SO(3)."""
    rate = fma(c[_HIGH] - c[_LOW], randoms.uniform(stream, 0), c[_LOW])
    axis = vertical(randoms.quaternion(stream, 1 << 21))
    q = randoms.quaternion(stream, 1 << 20)
    return (*q, rate * axis[0], rate * axis[1], rate * axis[2]), (0.0,)


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Torque about the body axes that have an actuator."""
    return y, (c[_TORQUE] * a[0], c[_TORQUE + 1] * a[1], c[_TORQUE + 2] * a[2])


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Spin error, distance in energy and momentum, torque, and for how long there is no error."""
    rate, tolerance, hold = c[_RATE], c[_TOLERANCE], c[_HOLD]
    scale = 1.0 / rate
    w1, w2, w3 = scale * y[4], scale * y[5], scale * y[6]
    error = math.sqrt(w1 * w1 + (w2 - 1.0) * (w2 - 1.0) + w3 * w3)
    L1, L2, L3 = p[0] * w1, p[1] * w2, p[2] * w3
    unit = p[4] * p[4]  # 1 / I2^2
    momentum = unit * (L1 * L1 + L2 * L2 + L3 * L3)
    energy = p[4] * (L1 * w1 + L2 * w2 + L3 * w3)
    apart = abs(energy - momentum) + abs(momentum - 1.0)
    square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    full = c[_TORQUE] * c[_TORQUE] + c[_TORQUE + 1] * c[_TORQUE + 1]
    full = full + c[_TORQUE + 2] * c[_TORQUE + 2]
    held = select(error < tolerance, memo[0] + 1.0, 0.0)
    terms = (1.0 / (1.0 + 10.0 * error), 1.0 / (1.0 + 10.0 * apart), -square / full)
    return (held,), terms, dt * math.sqrt(square), held * dt >= hold * (1.0 - 1e-9), False


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Angular velocity in target rates."""
    s = 1.0 / c[_RATE]
    return (
        min(max(s * y[4], -_FAST), _FAST),
        min(max(s * y[5], -_FAST), _FAST),
        min(max(s * y[6], -_FAST), _FAST),
    )


SHAPES = Shapes(*free_body.SHAPES, (1.0,) * 3, (0.0,), (0.0,) * 3, (0.0,) * 11)


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
class SpinCapture(Task):
    """Bring a spin about any axis to the intermediate axis e2 at the rate Omega.

    The torque is weak: a tenth of what the gyroscopic terms of Euler's equations can reach at the
    rate Omega, so the spin cannot be turned against the tumbling. But energy and momentum can be
    steered while the body tumbles, and of all free motions those with the right ones arrive at e2.
    There the spin comes by itself and must be caught, as e2 is unstable.

    Two actuators can do it too, if more slowly. One cannot, as each conserves a quadratic form
    whatever it does; these choices of `actuators` are here for the proof.

    Physics:
        Euler's equations ``I omega' = I omega x omega + tau``, all in body axes, which are the
        principal axes. The gyroscopic term is ``(I3 - I1) Omega^2 / 2`` at most at the rate Omega,
        1 N m for the default body. Without torque the energy T and the size of L are conserved.

        Of all free motions only those on the separatrix, ``2 T I2 = L^2``, arrive at e2 (half of
        them at -e2); the right one has ``L = I2 Omega`` too. Bounded torque holds the default body
        at e2, to first order, while ``|omega1 - sqrt(3) omega3| < 0.273`` rad/s.

        One torque alone: tau1 keeps ``I2 (I2 - I1) omega2^2 + I3 (I3 - I1) omega3^2``, tau2 keeps
        ``2 T I2 - L^2``, and tau3 keeps ``I1 (I3 - I1) omega1^2 + I2 (I3 - I2) omega2^2``. Entries
        of the action about an axis without actuator do nothing.

        The energy that full torque could give the body before the time limit bounds its rates.

    Rewards:
        ``spin`` = ``1 / (1 + 10 error)`` with ``error = |omega - Omega e2| / Omega``, the aim
        itself. ``manifold`` = ``1 / (1 + 10 (|2 T I2 - L^2| + |L^2 - L0^2|) / L0^2)`` with
        ``L0 = I2 Omega``, which is 1 on the motions that lead to e2 or -e2 and guides the tumbling
        body there. ``effort`` = ``-|tau|^2`` as a part of the largest, ``n torque^2`` for n
        actuators.

    Starting State:
        The direction of omega in the body is uniform on the sphere, its size uniform in
        `start_rate`; the attitude is uniform on SO(3).

    Episode End:
        The episode does not end before its time. Success (`info["is_success"]`): the error has been
        below `tolerance` throughout the last `hold` seconds.

    Reference:
        `separatrix` steers onto the separatrix: torque down the slope of ``(p^2 + E^2) / 2``, where
        ``E = (omega2^2 + b (d^2 + s^2)) / Omega^2 - 1`` is the excess of the rate at which the
        motion would arrive and ``p = d s / Omega^2`` with ``d, s = omega1 -+ sqrt(I3 (I3 - I2) /
        (I1 (I2 - I1))) omega3`` vanishes on the separatrix; near e2, the linear-quadratic
        regulator.

        Proof of failure: with a torque about e3 alone the default body keeps ``omega1^2 +
        omega2^2``, and omega comes no nearer to ``Omega e2`` than ``|sqrt(omega1^2 + omega2^2) -
        Omega|``. A torque about e1 alone keeps ``omega2^2 + 3 omega3^2``.

    Version History:
        v0: first version.

    Source:
        Landau & Lifshitz, *Mechanics*, section 37; Bloch & Marsden 1990,
        doi:10.1016/0167-6911(90)90055-Y.
    """

    n_substeps: int = setting(3, Integer("integrator steps per control period", 1, 1000))
    rotation: str = setting("none", ROTATION)
    I1: Range = physical(1.0, "least principal moment", "kg m^2")
    I2: Range = physical(2.0, "middle principal moment", "kg m^2")
    I3: Range = physical(3.0, "largest principal moment", "kg m^2")
    spin_rate: float = setting(1.0, Number("target rate Omega", "rad/s", 1e-3, 1e3))
    torque: float = setting(0.1, Number("largest torque about each axis", "N m", 1e-6, 1e6))
    actuators: str = setting("e1 e2 e3", Choice("body axes that have an actuator", _ACTUATORS))
    start_rate: Range = setting(
        (0.5, 1.5), Number("rate of the spin at the start", "rad/s", 0.0, 1e3, drawn=True)
    )
    tolerance: float = setting(
        0.05, Number("largest spin error of a success / Omega", "1", 1e-6, 1.0)
    )
    hold: float = setting(5.0, Number("time within tolerance at the end", "s", 0.0, 1e4))
    weight_spin: float = setting(1.0, Number("weight of the spin term", "1", -1e3, 1e3))
    weight_manifold: float = setting(0.2, Number("weight of the manifold term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    system_type: ClassVar = FreeBody
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("spin", "manifold", "effort")
    cost_unit: ClassVar = "torque impulse [N m s]"
    memo_names: ClassVar = ("held",)

    def _check_parameters(self) -> None:
        check_order((self.I1, self.I2, self.I3))
        super()._check_parameters()

    def torques(self) -> tuple[float, float, float]:
        """Largest torque about each body axis [N m]; 0 where there is no actuator."""
        on = self.actuators.split()
        return (
            self.torque * ("e1" in on),
            self.torque * ("e2" in on),
            self.torque * ("e3" in on),
        )

    def constants(self) -> tuple[float, ...]:
        """Weights, target rate, tolerance, hold, start, torques."""
        return (
            self.weight_spin,
            self.weight_manifold,
            self.weight_effort,
            self.spin_rate,
            self.tolerance,
            self.hold,
            *span(self.start_rate),
            *self.torques(),
        )

    def actions(self) -> tuple[Entry, ...]:
        """Torques about the body axes."""
        return tuple(
            Entry(f"tau{k}", "N m", "body", -torque, torque)
            for k, torque in enumerate(self.torques(), start=1)
        )

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity in target rates."""
        return tuple(Entry(f"omega{k} / Omega", "1", "body", -_FAST, _FAST) for k in (1, 2, 3))

    def largest_rate(self) -> float:
        """What full torque can make of the fastest start before the time limit."""
        moments, time = (self.I1, self.I2, self.I3), _STEPS * self.dt
        return fastest(moments, spun_up(moments, span(self.start_rate)[1], self.torques(), time))
