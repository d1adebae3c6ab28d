"""Reverse the spin in the body by a commanded time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, log, select
from rigid_envs.engine.episode import Episode, clip_to_box
from rigid_envs.systems.free_body import saddle
from rigid_envs.systems.free_body.dynamics import FREE_BODY, Input, Parameters, State
from rigid_envs.systems.free_body.tasks import shared
from rigid_envs.tasks.fields import Entry, Range, span
from rigid_envs.tasks.task import AuxiliaryRanges

# Reduced coordinates of a spin that is to flip from e2 to -e2 in a given time: `AxisFlip`.
#
# A half turn about e2 makes the growing coordinate of the saddle positive. The motion on the
# separatrix that arrives at the commanded time is known; the spin is seen relative to it. The
# moments are the middles of their ranges.

_ARRIVED = 0.6  # of the tolerance: distance from -e2 on arrival
_DECADE = 0.4342944819032518  # 1 / log(10)
_DECADES = 20.0  # bound of phases
_SMALLEST = 1e-9  # of Omega; a smaller d is taken for this


@scalar
def decay(x: float) -> float:
    """exp(-x) for 0 <= x <= 16, to 1e-6: the 128th power of the fifth-order series."""
    z = -min(x, 16.0) * (1.0 / 128.0)
    e = 1.0 + z * fma(z, fma(z, fma(z, fma(z, 1.0 / 120.0, 1.0 / 24.0), 1.0 / 6.0), 0.5), 1.0)
    for _ in range(7):
        e = e * e
    return e


@scalar
def phase_left(at: saddle.Place, left: float, c: Any) -> float:
    """Time to the middle of the flip that arrives at the commanded time, over that of growth.

    From ``1 / sqrt(share)``, which d has in the middle, it decays as ``2 exp(-time)`` of that.
    """
    # omega1 = d / 2 and omega3 = -d / (2 ratio) are the components of the distance from -e2
    last = 2.0 * _ARRIVED * c.tolerance / math.sqrt(1.0 + 1.0 / (at.ratio * at.ratio))
    return fma(at.growth * c.spin_rate, left, -log(max(2.0 / (last * math.sqrt(at.share)), 1.0)))


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The spin, its time to the middle of the flip, and its difference from the timed motion."""
    w1, w2, w3 = shared.observed_rates(y, 1.0 / c.spin_rate)
    at = saddle.place_at(w1, w3, c)
    sign = saddle.growing_side(at, w2)
    d, s, w1, w3 = sign * at.d, sign * at.s, sign * w1, sign * w3
    left, most = max(aux.time_left, 0.0), 1.0 / math.sqrt(at.share)
    # on the separatrix omega2 = tanh(phase) and d = most / cosh(phase), over the rate of arrival
    wanted = phase_left(at, left, c)
    e = decay(abs(wanted))
    cosh_inverse = 2.0 * e / fma(e, e, 1.0)
    timed2 = fma(-e, e, 1.0) / fma(e, e, 1.0)
    before = left > 0.0
    late2 = -math.sqrt(max(fma(-at.share * d, d, 1.0), 0.0))
    timed2 = select(before, select(wanted < 0.0, -timed2, timed2), late2)
    timed_d = select(before, select(d < 0.0, -most, most) * cosh_inverse, d)
    error1, error2 = fma(-0.5, timed_d, w1), w2 - timed2
    error3 = fma(0.5 / at.ratio, timed_d, w3)
    rate = math.sqrt(fma(w2, w2, at.share * fma(d, d, s * s)))
    coming = log(max((rate + abs(w2)) * most, _SMALLEST) / max(abs(d), _SMALLEST))
    coming = select(w2 < 0.0, -coming, coming)
    return (
        w1,
        w2,
        w3,
        min(left / c.largest_flip_time, 1.0),
        saddle.within(_DECADE * wanted, _DECADES),
        select(before, saddle.within(_DECADE * (coming - wanted), _DECADES), 0.0),
        saddle.near(error1, c.tolerance),
        saddle.near(error2, c.tolerance),
        saddle.near(error3, c.tolerance),
    )


FLIP = saddle.half_turned(
    features=(
        *shared.REDUCED_RATES,
        Entry("time left / longest", "1", "none", 0.0, 1.0),
        Entry("wanted time to flip", "1", "decades of growth", -_DECADES, _DECADES),
        Entry("late by", "1", "decades of growth", -_DECADES, _DECADES),
        *(Entry(f"near error{k}", "1", "reduced", -1.0, 1.0) for k in (1, 2, 3)),
    ),
    observe=observe_reduced,
    frame_of=saddle.growing_frame,
    turn=saddle.turn,
    formulas="""
    With $w$, $r$, $growth$, $d$ and $s$ of `IntermediateAxis` and $k = I1 (I3 - I1) / (4 I2 (I3 -
    I2))$, $S$ is the sign of $w2 (d - s) + d + s$. From here on $w1$, $w3$, $d$ and $s$ are those
    times $S$.

    The motion that arrives at $T$, within 0.6 of `tolerance`, is $w2 = tanh(W)$, $d = D = +-1 /
    (sqrt(k) cosh(W))$ with the sign of $d$, and $s = 0$, where the wanted time is $W = Omega growth
    left - log(max(2 / (l sqrt(k)), 1))$, $l = 1.2 tolerance / sqrt(1 + 1 / r^2)$ and $left$ is the
    time left, at least 0. With $n = sqrt(w2^2 + k (d^2 + s^2))$ the flip is to come at $C =
    +-log((n + |w2|) / (sqrt(k) |d|))$ with the sign of $w2$; numerator over $sqrt(k)$ and $|d|$ are
    at least $1e-9$.

    Entries: $w1$, $w2$, $w3$, the time left over the largest of `flip_time`, $W / log(10)$, $(C -
    W) / log(10)$, and the shares of $w1 - D / 2$, $w2 - tanh(W)$ and $w3 + D / (2 r)$ with the half
    `tolerance`. When no time is left, the sixth is 0, $D$ is $d$, and $tanh(W)$ is replaced by
    $-sqrt(max(1 - k d^2, 0))$. $|W|$ counts as at most 16 in $tanh$ and $cosh$, whose error is
    below $1e-5$. The action $a$ acts as $(S a1, a2, S a3)$.
    """,
)
"""Reduction of `AxisFlip`: SO(3), turns in space, times the half turn about e2."""


# Reverse the spin of a free body by a commanded time with the least impulse.


class Terms(NamedTuple):
    """Reward terms of `AxisFlip`."""

    spin: float
    impulse: float


class Constants(NamedTuple):
    """Rate [rad/s], torque [N m], tolerance, spread of the starts [rad/s], commanded times [s].

    And the middles of the moments [kg m^2].
    """

    spin_rate: float
    torque: float
    tolerance: float
    start_spread: float
    least_flip_time: float
    largest_flip_time: float
    middle1: float
    middle2: float
    middle3: float


class Auxiliary(NamedTuple):
    """Time until the commanded time [s]; 1 while the spin error has stayed within tolerance."""

    time_left: float = 0.0
    kept: float = 0.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """Spin Omega about e2, perturbed uniformly in a ball; commanded time uniform in its range."""
    low, high = c.least_flip_time, c.largest_flip_time
    left = fma(high - low, randoms.uniform(stream, 1 << 21), low)
    return shared.perturbed_spin(stream, c.spin_rate, c.start_spread), Auxiliary(left, 1.0)


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Spin reward from the commanded time on, torque impulse, and the success test."""
    scale = 1.0 / c.spin_rate
    e1, e2, e3 = scale * y.omega1, scale * y.omega2 + 1.0, scale * y.omega3
    error = math.sqrt(e1 * e1 + e2 * e2 + e3 * e3)
    torque = math.sqrt(u.tau1 * u.tau1 + u.tau2 * u.tau2 + u.tau3 * u.tau3)
    left = aux.time_left - dt
    due = left < 1e-9 * dt
    kept = select(due & (error >= c.tolerance), 0.0, aux.kept)
    terms = Terms(
        spin=select(due, 1.0 / (1.0 + 10.0 * error), 0.0),
        impulse=-torque / (math.sqrt(3.0) * c.torque),
    )
    return Auxiliary(left, kept), terms, dt * torque, due & (kept > 0.0), False


@scalar
def observe(
    y: State, aux: Auxiliary, p: Parameters, c: Constants
) -> tuple[float, float, float, float]:
    """Angular velocity divided by Omega; time left divided by the longest time."""
    w1, w2, w3 = shared.observed_rates(y, 1.0 / c.spin_rate)
    return w1, w2, w3, min(max(aux.time_left / c.largest_flip_time, 0.0), 1.0)


@dataclass(frozen=True)
class AxisFlip(shared.PerturbedSpinTask):
    """Reverse the spin in the body, from e2 to -e2, by a commanded time with the least impulse.

    The angular momentum $L$ is fixed in space, but not in the body: spin about the unstable
    intermediate axis flips to the opposite direction by itself (the Dzhanibekov effect). A small
    early impulse along the unstable direction is enough; the more time is left, the smaller it can
    be. The difficulty is to flip at the commanded time and to stay at $-e2$, which is as unstable
    as $e2$.

    The time $T$ is drawn at reset and the time left is observed. From $T$ on to the end of the
    episode the spin must stay at $-e2$, where holding it costs almost no impulse.

    Physics:
        The moments are $I1 < I2 < I3$. Reversing the spin directly takes the impulse $2 L = 2 I2
        Omega$. An impulse of relative size $delta$ along the unstable direction flips the body
        after the time $log(1 / delta) / lambda$ plus a constant, with $lambda = Omega sqrt((I2 -
        I1)(I3 - I2) / (I1 I3))$. So from exact spin about $e2$ the least impulse decreases as
        $exp(-lambda T)$ with the commanded time $T$.

    Rewards:
        `spin` = $1 / (1 + 10 error)$ with $error = |omega + Omega e2| / Omega$ from the commanded
        time $T$ on, and 0 before: the motion until then is not rewarded. The time left is $T$ at
        the start, and every step subtracts `dt`; observed is $max(time left, 0)$ over the largest
        of `flip_time`. From $T$ on is when less than $1e-9 dt$ is left. `impulse` = $-|tau| /
        (sqrt(3) torque)$, not squared, so that its sum is proportional to the impulse to be
        minimised.

    Starting State:
        $omega$ is $Omega e2$ (`spin_rate`) plus a perturbation uniform in a ball of radius
        `start_spread`; the attitude is uniform on $SO(3)$. The commanded time is uniform in
        `flip_time`.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): the error has been
        below `tolerance` from the commanded time on, in every step up to this one.

    Reference:
        `transfer` leads to the separatrix by impulses where the free motion makes them do most, and
        pushes at once only if the flip would be late: see
        `rigid_envs.systems.free_body.transfer.TimedTransfer`. `timed` tracks the free motion that
        flips at the commanded time, $tau = -1.5 Omega I (omega - omega_free)$, where $omega_free$
        lies on the separatrix ($tanh$ and $cosh$ of the time left). `brute_force` reverses the spin
        at once, $tau = -4 Omega I (omega + Omega e2)$.

        Exact: torque about $e2$ alone, from exact spin, costs $2 L = 2 I2 Omega$. No torque needs
        less than the distance of the start from the goal in the plane of
        `rigid_envs.systems.free_body.transfer.polhode_point`.

    Source:
        Landau & Lifshitz, *Mechanics*, section 37; Van Damme, Mardesic & Sugny 2017,
        arXiv:1606.08237.
    """

    n_substeps: int = 4
    spin_rate: float = setting(1.0, Number("rate Omega", "rad/s", 1e-3, 1e3))
    torque: float = 0.5
    flip_time: Range = setting((12.0, 20.0), Number("commanded time T", "s", 1e-3, 1e4, drawn=True))
    tolerance: float = setting(
        0.05, Number("largest spin error of a success / Omega", "1", 1e-6, 1.0)
    )
    weight_spin: float = setting(1.0, Number("weight of the spin term", "1", -1e3, 1e3))
    weight_impulse: float = setting(1.0, Number("weight of the impulse term", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=FREE_BODY,
        Action=shared.BodyTorque,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        start=start,
        clip=clip_to_box,
        actuate=shared.actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = FLIP
    counters: ClassVar = ("kept",)

    @property
    def least_flip_time(self) -> float:
        """Least commanded time [s]."""
        return span(self.flip_time)[0]

    @property
    def largest_flip_time(self) -> float:
        """Largest commanded time [s]."""
        return span(self.flip_time)[1]

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity divided by Omega, and the time left."""
        return (*super().features(), Entry("time left / longest", "1", "none", 0.0, 1.0))

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """The time left is at most the largest commanded one, and falls with the steps."""
        rounding = 1e-9 * self.largest_flip_time
        left = (self.least_flip_time - self.dt * elapsed - rounding, self.largest_flip_time)
        return {"time_left": left, "kept": (0.0, 1.0)}
