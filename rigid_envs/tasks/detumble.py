"""Bring a tumbling body to rest by impulses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from rigid_envs.kernels import free_body, randoms
from rigid_envs.kernels.actions import clip_to_ball
from rigid_envs.kernels.algebra import attitude
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.episode import Episode, NoAuxiliary
from rigid_envs.kernels.free_body import FREE_BODY, Input, Parameters, State
from rigid_envs.systems import FreeBody
from rigid_envs.tasks.base import ROTATION, Entry, Task
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting, span
from rigid_envs.tasks.free_bodies import FASTEST, MiddleMoments, fastest, observed_rates
from rigid_envs.tasks.reduced.detumble import MOMENTUM

__all__ = ["Detumble"]

_FAR = 100.0  # bound of the momentum term


class Action(NamedTuple):
    """Impulse in body axes, as a fraction of the maximum."""

    j1: float
    j2: float
    j3: float


class Terms(NamedTuple):
    """Reward terms of `Detumble`."""

    momentum: float
    impulse: float


class Constants(NamedTuple):
    """Largest impulse and largest |L| at the start [N m s], tolerance.

    And the middles of the moments [kg m^2].
    """

    impulse: float
    start_momentum: float
    tolerance: float
    middle1: float
    middle2: float
    middle3: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """Angular momentum uniform in a ball; attitude uniform on SO(3)."""
    a, b, d = randoms.in_ball(stream, 0)
    q, L = randoms.quaternion(stream, 1 << 20), c.start_momentum
    return State(*q, L * a * p.inverse1, L * b * p.inverse2, L * d * p.inverse3), ()


@scalar
def actuate(
    a: Action, y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """The impulse changes omega at once; the input passes it on to `outcome`."""
    j1, j2, j3 = c.impulse * a.j1, c.impulse * a.j2, c.impulse * a.j3
    kicked = State(
        *attitude(y),
        y.omega1 + j1 * p.inverse1,
        y.omega2 + j2 * p.inverse2,
        y.omega3 + j3 * p.inverse3,
    )
    return kicked, Input(j1, j2, j3)


@scalar
def drift(y: State, u: Input, p: Parameters, h: float) -> State:
    """One step of free motion: the impulse in the input has acted already."""
    return free_body.step(y, Input(0.0, 0.0, 0.0), p, h)


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """Quadratic terms of momentum and impulse."""
    L1, L2, L3 = p.I1 * y.omega1, p.I2 * y.omega2, p.I3 * y.omega3
    scale = 1.0 / c.start_momentum
    momentum = (L1 * L1 + L2 * L2 + L3 * L3) * (scale * scale)
    square = u.tau1 * u.tau1 + u.tau2 * u.tau2 + u.tau3 * u.tau3
    terms = Terms(momentum=-min(momentum, _FAR), impulse=-square / (c.impulse * c.impulse))
    return aux, terms, math.sqrt(square), momentum < c.tolerance * c.tolerance, False


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Constants) -> tuple[float, float, float]:
    """Angular velocity."""
    return observed_rates(y, 1.0)


@dataclass(frozen=True)
class Detumble(MiddleMoments, Task):
    """Bring the angular momentum of a tumbling body to zero by impulses.

    Each step is an impulse, which changes the angular momentum L at once, and then free motion,
    which rotates L in the body and conserves its norm. The observation is the angular velocity,
    whose free motion is nonlinear. But impulses act on the momentum, and the cost depends on its
    norm only, so the optimal policy is known exactly.

    Physics:
        An impulse j changes the momentum by ``L -> L + j``; then the body moves freely for a
        control period, by Euler's equations ``I omega' = I omega x omega``. Momentum and impulse
        are vectors in body axes, which are the principal axes, and ``omega = I^-1 L``. The free
        motion conserves the norm of L, and L in space, to rounding.

        The sum of the largest impulses until the time limit bounds the rates.

    Rewards:
        ``momentum`` = ``-(|L| / start_momentum)^2`` after the step (not below -100) and ``impulse``
        = ``-(|j| / impulse)^2``: a quadratic cost with a known optimum.

    Starting State:
        The angular momentum is uniform in a ball of radius `start_momentum`; the attitude is
        uniform on SO(3).

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): |L| is below
        `tolerance` times `start_momentum`.

    Reference:
        Exact: with a and b the weights over the squares of start_momentum and impulse, the cost to
        go is ``P |L|^2`` with the root ``P = (-a + sqrt(a^2 + 4 a b)) / 2`` of the scalar Riccati
        equation ``P = b (a + P) / (a + b + P)``, under the law ``j = -L (a + P) / (a + b + P)``,
        which is `riccati`: n steps cost ``P (|L_0|^2 - |L_n|^2)``. With equal weights it stays
        within the ball of impulses for all starts.

        The least time to rest is ``|L| / impulse`` steps, rounded up. `brake` attains it with the
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
    episode: ClassVar = Episode(
        dynamics=FREE_BODY,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=NoAuxiliary,
        start=start,
        clip=clip_to_ball,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
        advance=drift,
    )
    reduction: ClassVar = MOMENTUM
    cost_unit: ClassVar = "impulse [N m s]"

    def actions(self) -> tuple[Entry, ...]:
        """Impulse, in a ball."""
        return tuple(
            Entry(f"j{k}", "N m s", "body, ball", -self.impulse, self.impulse) for k in (1, 2, 3)
        )

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity."""
        return tuple(Entry(f"omega{k}", "rad/s", "body", -FASTEST, FASTEST) for k in (1, 2, 3))

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates after the largest impulse in every step."""
        moments = (self.I1, self.I2, self.I3)
        momentum = self.start_momentum + duration / self.dt * self.impulse
        return fastest(moments, momentum / math.sqrt(min(span(moment)[0] for moment in moments)))
