"""Pump a roller up a valley."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Choice, Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, Vector
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import log, select, sincos
from rigid_envs.engine.episode import Episode, clip_to_interval
from rigid_envs.systems.roller.dynamics import ROLLER, Input, Parameters, State
from rigid_envs.systems.roller.symmetry import REFLECTION
from rigid_envs.systems.roller.system import Roller
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.reduction import Reduction
from rigid_envs.tasks.task import AuxiliaryRanges, Rolling

# Reduced coordinates of a roller in a valley: energy and phase of the swing.

_MOST = 4.0  # bound of amplitudes and energies in those of rest on the rim
_LOG = 10.0  # bound of their logarithm


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Energy and phase, which are even in (s, v).

    A change of the ratio keeps the momentum, so that the present ratio does not matter: the energy
    is that after a change to the least ratio, ``x^2 + w^2``, in that of rest on the rim. The
    action that pumps depends on the sign of x w, the sine of twice the phase.
    """
    low = 1.0 + p.beta
    top = sincos(0.5 * c.rim)[0]
    x = sincos(0.5 * p.curvature * y.s)[0] / top
    momentum = (low + aux.beta_change) * y.v
    w = momentum * math.sqrt(p.curvature / (p.g * low)) * (0.5 / top)
    energy = x * x + w * w
    inverse = 1.0 / max(energy, 1e-12)
    sine = 2.0 * x * w * inverse
    return (
        (x * x - w * w) * inverse,
        sine,
        min(max(4.0 * sine, -1.0), 1.0),
        min(energy, _MOST),
        min(max(-log(max(energy, 1e-12)), -_LOG), _LOG),
    )


SWING = Reduction(
    group="Z2",
    frame="none is needed: the observation is even, and so is the action.",
    symmetries=(REFLECTION,),
    features=(
        Entry("cos 2 phase", "1", "phase 0: turning point", -1.0, 1.0),
        Entry("sin 2 phase", "1", "> 0: ascending", -1.0, 1.0),
        Entry("4 sin 2 phase", "1", "limited", -1.0, 1.0),
        Entry("E / E_rim", "1", "energy at the least ratio", 0.0, _MOST),
        Entry("log(E_rim / E)", "1", "energy at the least ratio", -_LOG, _LOG),
    ),
    observe=observe_reduced,
    formulas="""
        With the angle $x = curvature s$, the momentum $P = (1 + beta + addition) v$ and the least
        ratio $beta$ of the episode: $a = sin(x / 2) / sin(rim / 2)$ and $b = P sqrt(curvature / (g
        (1 + beta))) / (2 sin(rim / 2))$; $E / E_rim = a^2 + b^2$, at least $1e-12$ where it
        divides, $cos 2 phase = (a^2 - b^2) / (a^2 + b^2)$ and $sin 2 phase = 2 a b / (a^2 + b^2)$,
        each limited to its bounds.
    """,
)
"""Reduction of `RollPump`: the reflection; the action has no direction."""


# Drive a roller out of a valley by changing its inertia ratio.

_FAST = 5.0  # bound of the observed speed in units of sqrt(g / curvature)


class Action(NamedTuple):
    """Change of the inertia ratio: -1 is no addition, 1 the largest."""

    beta_change: float


class Terms(NamedTuple):
    """Reward terms of `RollPump`."""

    shortfall: float
    over: float


class Constants(NamedTuple):
    """Largest addition to the ratio; angles from the bottom: rim, largest start [rad]."""

    beta_change: float
    rim: float
    start_angle: float


class Auxiliary(NamedTuple):
    """Current addition to the inertia ratio."""

    beta_change: float = 0.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """At rest on either side: the angle uniform between half of the largest and the largest."""
    side = select(randoms.uniform(stream, 0) < 0.5, -1.0, 1.0)
    angle = c.start_angle * (0.5 + 0.5 * randoms.uniform(stream, 1))
    return State(s=side * angle / p.curvature, v=0.0), Auxiliary(beta_change=0.0)


@scalar
def actuate(
    a: Action, y: State, aux: Auxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """New inertia ratio, at once; (1 + beta) v, the momentum about the contact, is conserved."""
    change = 0.5 * c.beta_change * (1.0 + a.beta_change)
    v = y.v * ((1.0 + (p.beta + aux.beta_change)) / (1.0 + (p.beta + change)))
    return State(y.s, v), Input(force=0.0, beta_change=change)


@scalar
def height(angle: float) -> float:
    """Height above the bottom in radii of the valley, 1 - cos(angle)."""
    sine, _ = sincos(0.5 * angle)
    return 2.0 * sine * sine


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Energy shortfall, time as cost, and success at the rim; the ratio is stored."""
    angle = p.curvature * y.s
    kinetic = 0.5 * (1.0 + (p.beta + u.beta_change)) * y.v * y.v * p.curvature / p.g
    over = abs(angle) >= c.rim
    missing = max(1.0 - (height(angle) + kinetic) / height(c.rim), 0.0)
    terms = Terms(shortfall=-min(missing, 1.0), over=select(over, 1.0, 0.0))
    return Auxiliary(u.beta_change), terms, dt, over, over


@scalar
def observe(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> Vector:
    """Angle from the bottom, velocity / sqrt(g / curvature), and addition to the ratio."""
    angle, v = p.curvature * y.s, y.v * math.sqrt(p.curvature / p.g)
    return (
        min(max(angle, -math.pi), math.pi),
        min(max(v, -_FAST), _FAST),
        min(aux.beta_change / c.beta_change, 1.0),
    )


@dataclass(frozen=True)
class RollPump(Rolling):
    """Roll out of a valley without external force, by changing the inertia ratio.

    A roller in a circular valley changes its ratio $beta = I / (m r^2)$ between that of a solid
    sphere (2/5) and that of a hoop (1) by moving masses along its spokes. It must pass the rim,
    which takes several swings.

    Why it is hard: the greedy policy fails. Making the ratio smaller adds energy, but only once;
    making it larger again costs no energy only at a turning point, so the policy must wait for it.

    Physics:
        `beta` is the least ratio, and $s$ is 0 at the bottom. Masses move instantaneously, at the
        beginning of a control period, and conserve the momentum about the contact, $P = (1 + beta)
        v$, here and below with what is added in $beta$: a smaller ratio at full speed adds energy,
        by the work done on the masses; a larger ratio at rest changes no energy. Energy is
        conserved while the ratio is constant. The motion has no slip for any `mu`.

        From one turning point to the next, $d(P^2)/ds = -2 (1 + beta) g sin(curvature s)$ shows
        that under any policy the height grows by a factor of at most $(1 + beta_hi) / (1 + beta_lo)
        = 10/7$. It grows by exactly this factor if the ratio is large during descent and small
        during ascent.

    Rewards:
        `shortfall` = $E / E_rim - 1$, limited to -1 .. 0, with $E = g (1 - cos(curvature s)) /
        curvature + (1 + beta) v^2 / 2$ after the step and $E_rim$ that of rest on the rim, so that
        a step costs less at a higher energy; and `over` = 1 in the step that passes the rim.

    Starting State:
        At rest on either side, with the smallest ratio. The angle from the bottom, as a fraction of
        `rim`, is uniform between half of `start_part` and `start_part`.

    Episode End:
        The episode terminates when the angle from the bottom is `rim` or more, on either side. That
        step is the success (`info["is_success"]`).

    Reference:
        `bang_bang` makes the ratio large during descent and small during ascent. As actions are
        held for a control period, some episodes take one pass more.

        Exact: the factor $(1 + beta_hi) / (1 + beta_lo) = 10/7$ in height per pass. From rest at
        the height $h$ to the rim it takes $log(h_rim / h) / log(10/7)$ passes, rounded up. No
        policy reaches the rim in less time than $(n - 1/2) pi sqrt((1 + beta_lo) / (g curvature))$
        with $n$ the number of passes. The least number of control periods is known nearly exactly,
        by regions of the plane of angle and momentum from which the rim is not reached in fewer.

    Source:
        Tea & Falk 1968, "Pumping on a swing", American Journal of Physics 36, for a swing of
        variable length.
    """

    rotation: str = setting("none", Choice("a roller is observed without attitude", ("none",)))
    m: Range = physical(1.0, "mass", "kg")
    radius: Range = physical(1.0, "rolling radius", "m")
    beta: Range = physical(0.4, "least inertia ratio", "1")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    slope: float = setting(0.0, Number("angle at s = 0: the bottom", "rad", 0.0, 0.0))
    curvature: Range = physical(0.2, "curvature of the path of the centre", "1/m")
    beta_change: float = setting(0.6, Number("largest addition to the ratio", "1", 1e-3, 1e3))
    rim: float = setting(1.2, Number("angle of the rim", "rad", 1e-2, 3.1))
    start_part: float = setting(0.3, Number("largest start / rim", "1", 1e-3, 0.99))
    weight_shortfall: float = setting(0.02, Number("weight of missing energy", "1", -1e3, 1e3))
    weight_over: float = setting(10.0, Number("weight of passing the rim", "1", -1e3, 1e3))

    system_type: ClassVar = Roller
    episode: ClassVar = Episode(
        dynamics=ROLLER,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        start=start,
        clip=clip_to_interval,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = SWING
    cost_unit: ClassVar = "time [s]"

    @property
    def start_angle(self) -> float:
        """Largest angle from the bottom at the start [rad]."""
        return self.start_part * self.rim

    def actions(self) -> tuple[Entry, ...]:
        """Addition to the ratio: -1 is none, 1 the largest."""
        return (Entry("beta_change", "1", "-1: 0", 0.0, self.beta_change),)

    def features(self) -> tuple[Entry, ...]:
        """Angle, velocity, and addition to the ratio."""
        return (
            Entry("curvature s", "rad", "path", -math.pi, math.pi),
            Entry("v sqrt(curvature / g)", "1", "path", -_FAST, _FAST),
            Entry("beta_change / largest", "1", "body", 0.0, 1.0),
        )

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """What can be added to the ratio."""
        return {"beta_change": (0.0, self.beta_change)}

    def largest_rate(self, duration: float) -> float:
        """Rate at the bottom after a descent from the rim, then at the smallest ratio."""
        swing = span(self.g)[1] * span(self.curvature)[1]
        low = 1.0 + span(self.beta)[0]
        share = (low + self.beta_change) / low  # of height, gained in one pass
        rim = min(2.0, 0.5 * self.rim**2)  # at least 1 - cos(rim)
        return math.sqrt(swing / low * max(1.0, 2.0 * rim * share))

    def lower_bound(self, y: Array) -> Array:
        """Lower bound on the time [s] to the rim, from rest in y, shape (...).

        The phase angle of (curvature s, P), with P scaled so that motion at the smallest ratio is a
        circle, changes at a rate of at most sqrt(g curvature / (1 + beta)). With the least number n
        of passes it must change by (n - 1/2) pi.
        """
        low = 1.0 + span(self.beta)[0]
        gain = math.log((low + self.beta_change) / low)
        s = y[..., Roller.components["arc_length"]][..., 0]
        start = 1.0 - np.cos(span(self.curvature)[1] * s)
        n = np.ceil(np.log((1.0 - np.cos(self.rim)) / start) / gain)
        swing = math.sqrt(span(self.g)[1] * span(self.curvature)[1] / low)
        return np.asarray((n - 0.5) * math.pi / swing)
