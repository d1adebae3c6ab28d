"""Keep an asymmetric top upright."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, Vector, attitude, vertical
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma
from rigid_envs.engine.episode import Episode, clip_to_box, clip_to_disk, single
from rigid_envs.systems.heavy_top.dynamics import HEAVY_TOP, Input, Parameters, State
from rigid_envs.systems.heavy_top.symmetry import HALF_TURN, REFLECTION, TURN
from rigid_envs.systems.heavy_top.tasks import shared
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.parts import Held, held_for, limited, tilted
from rigid_envs.tasks.reduction import Frame, Reduction, turned_back

# Reduced coordinates of an asymmetric top that is held by body torques: `TopRandom`.


@scalar
def _lean(y: Any, c: Any) -> shared.Lean:
    """Parts of the lean in body axes, of a symmetric top with the mean of the moments."""
    G = vertical(attitude(y))
    return shared.parts(-G[0], -G[1], y.omega2, -y.omega1, y.omega3, c.fall_square, c.gyration)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Lean, height, spin, and the azimuth of the frame, by which moments and products differ."""
    lean = _lean(y, c)
    frame = shared.lean_frame(lean, y.omega3)
    return (
        *shared.upright_seen(frame, lean, vertical(attitude(y))[2], y.omega3, c),
        shared.share(shared.length(y.omega1, y.omega2), 1.0),
        fma(2.0 * frame.cosine, frame.cosine, -1.0),
        2.0 * frame.side * frame.cosine * frame.sine,
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame along the growing part of the lean."""
    return shared.lean_frame(_lean(y, c), y.omega3)


@scalar
def turn(a: Any, frame: Any) -> Vector:
    """Torque that drives the axis e3 along an action in the frame, and the torque about e3."""
    (along, left), _ = clip_to_disk((a[0], a[1]))
    x, z = turned_back(frame, along, left)
    return single(-z), single(x), frame.side * a[2]


TOP_RANDOM = Reduction(
    group="O(2) x Z2",
    frame=(
        "$x$ along the growing part of the lean in body axes, mirrored so that the spin is not "
        "negative. Torques across $e3$ are clipped to the disk in their square."
    ),
    symmetries=(TURN, HALF_TURN, REFLECTION),
    features=(
        *shared.UPRIGHT,
        Entry("share omega", "1", "rate across e3, of itself + 1 rad/s", 0.0, 1.0),
        Entry("cos 2 alpha", "1", "alpha of the frame in the body", -1.0, 1.0),
        Entry("sin 2 alpha", "1", "alpha of the frame in the body", -1.0, 1.0),
    ),
    observe=observe_reduced,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    Frame and entries are those of `SleepingTop` in body axes: the lean is $e = -(R31 + i R32)$,
    $e'$ stands for $omega2 - i omega1$, and the $x$-axis is along $e1$ where $u$ and $s$ are 0.

    Further entries: the share of $|(omega1, omega2)|$ with the half 1, $cos(2 alpha)$ and $S sin(2
    alpha)$ with the angle $alpha$ from $e1$ to the $x$-axis and the sign $S$ of $omega3$. The first
    two entries of the action, clipped to the disk and then as $p$ along $e1$ and $e2$, act as
    $(-p_2, p_1)$, and the third as $S a3$.
    """,
)
"""Reduction of `TopRandom`: turns about the vertical, half turn and reflections of the body.

The frame turns in the body, so the first two entries of the action are limited to a disk.
"""


# Keep an asymmetric heavy top with random moments upright.

_FAST = 30.0  # rad/s; bound of the observed rates


class Action(NamedTuple):
    """Torque about the body axes, as fractions of the maximum."""

    tau1: float
    tau2: float
    tau3: float


class Terms(NamedTuple):
    """Reward terms of `TopRandom`."""

    upright: float
    effort: float


class Constants(NamedTuple):
    """Largest torque [N m], success (tilt [rad], time [s]), start (tilt [rad], rates [rad/s]).

    Last m g ell / I [1/s^2] and I3 / I with the mean I of I1 and I2, for the reduced frame.
    """

    torque: float
    tolerance: float
    hold: float
    start_tilt: float
    start_spin: float
    start_rate: float
    fall_square: float
    gyration: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Held]:
    """Small tilt, spin in either sense, small transverse rates."""
    q = tilted(stream, c.start_tilt * randoms.uniform(stream, 0), 1 << 20, 1 << 21)
    spin = c.start_spin * (2.0 * randoms.uniform(stream, 1) - 1.0)
    across = randoms.in_disk(stream, 1 << 22)
    omega = (c.start_rate * across[0], c.start_rate * across[1], spin)
    return State(*q, *omega, *shared.ORIGIN), Held(0.0)


@scalar
def actuate(a: Action, y: State, aux: Held, p: Parameters, c: Constants) -> tuple[State, Input]:
    """Torque about the three body axes."""
    return y, Input(c.torque * a.tau1, c.torque * a.tau2, c.torque * a.tau3, *shared.NONE, 0.0, 0.0)


@scalar
def outcome(
    y: State, u: Input, aux: Held, p: Parameters, c: Constants, dt: float
) -> tuple[Held, Terms, float, bool, bool]:
    """Reward terms, torque impulse as cost, success after the hold time."""
    tilt = shared.tilt_of(y)
    tau1, tau2, tau3 = u.tau_body1, u.tau_body2, u.tau_body3
    square = tau1 * tau1 + tau2 * tau2 + tau3 * tau3
    held, success = held_for(tilt < c.tolerance, aux, c, dt)
    terms = Terms(
        upright=1.0 / (1.0 + 10.0 * tilt),
        effort=-square * (1.0 / (3.0 * c.torque * c.torque)),
    )
    return Held(held), terms, dt * math.sqrt(square), success, False


@scalar
def observe(y: State, aux: Held, p: Parameters, c: Constants) -> Vector:
    """Angular velocity in body axes, the frame of the torque."""
    return limited((y.omega1, y.omega2, y.omega3), _FAST)


@dataclass(frozen=True)
class TopRandom(shared.TopTask):
    """Keep an asymmetric heavy top upright; its moments are drawn in every episode.

    A top with three different moments has only two integrals, the energy and the vertical momentum,
    and its free motion is chaotic: without control it falls and tumbles irregularly. The spin
    couples the tilts about $e1$ and $e2$, which respond differently. The control is a torque about
    all three body axes.

    The moments are drawn in every episode; they are observed with `observe_params`.

    Physics:
        With the vertical $G$ in body axes, $G' = G x omega$, gravity has the torque $m g ell (G2,
        -G1, 0)$. Beside the energy and the vertical momentum there is in general no further
        integral.

        The free motion is chaotic: neighbouring motions separate exponentially. The ranges ensure
        $I3 < I1 < I2$ for every top, and $I2 <= I1 + I3$, as for every rigid body.

    Rewards:
        `upright` = $1 / (1 + 10 theta)$ with the tilt $theta$: its slope is largest at the vertical
        and nowhere zero. `effort` = $-|tau|^2 / (3 torque^2)$ has a small weight.

    Starting State:
        The tilt is uniform up to `start_tilt`, $omega3$ uniform up to `start_spin` in either sense,
        and the rates across $e3$ uniform in a disk of radius `start_rate`. The direction of the
        tilt and the phase of the body are uniform.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): the tilt has been
        below `tolerance` throughout the last `hold` seconds.

    Reference:
        `lqr` is the linear-quadratic regulator of the upright top that turns about $e3$, linear in
        $(G1, G2, omega1, omega2)$ with a gain for every $omega3$, for the middle of the ranges. The
        torque about $e3$ is 0.

    Source:
        Goldstein, Poole & Safko, *Classical Mechanics*, sections 5.5 and 5.7; no further integral:
        Ziglin 1983, "Branching of solutions and the nonexistence of first integrals in Hamiltonian
        mechanics II", Functional Analysis and Its Applications 17.
    """

    dt: float = 0.05
    n_substeps: int = 2
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

    episode: ClassVar = Episode(
        dynamics=HEAVY_TOP,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Held,
        start=start,
        clip=clip_to_box,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = TOP_RANDOM
    counters: ClassVar = ("held",)
    cost_unit: ClassVar = "torque impulse [N m s]"

    def actions(self) -> tuple[Entry, ...]:
        """Torques about the body axes."""
        return tuple(Entry(f"tau{k}", "N m", "body", -self.torque, self.torque) for k in (1, 2, 3))

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity."""
        return tuple(Entry(f"omega{k}", "rad/s", "body", -_FAST, _FAST) for k in (1, 2, 3))

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates from the fastest start under gravity and full torque."""
        moments = (self.I1, self.I2, self.I3)
        mgl = shared.weight(self.m, self.g, self.ell)
        push = self.torque * math.sqrt(sum(1.0 / span(moment)[0] for moment in moments))
        return shared.fastest_top(moments, self.start_spin, self.start_rate, mgl, push * duration)
