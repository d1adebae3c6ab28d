"""Bring a nutating top to steady precession."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Choice, Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, attitude, vertical
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, sincos
from rigid_envs.engine.episode import Episode, clip_to_disk, clip_to_square, single
from rigid_envs.systems.heavy_top.dynamics import HEAVY_TOP, Input, Parameters, State
from rigid_envs.systems.heavy_top.symmetry import PHASE, REFLECTION, TURN
from rigid_envs.systems.heavy_top.tasks import shared
from rigid_envs.tasks.fields import Entry
from rigid_envs.tasks.parts import held_for, limited, limited_pair, tilted
from rigid_envs.tasks.reduction import Frame, Reduction, axial_seen, frame_along, turned_back
from rigid_envs.tasks.task import AuxiliaryRanges

# Reduced coordinates of a symmetric top led into steady precession: `TopPrecession`.

_NEAR, _CLOSE = 0.3, 0.02  # rad, rad/s


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """x-axis across e3 towards the vertical, in body axes, mirrored so that the spin is positive.

    Of the upright top it is against the direction in which e3 moves.
    """
    G = vertical(attitude(y))
    return frame_along(G[0], G[1], -y.omega2, y.omega1, y.omega3 < 0.0)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Tilt and rates, their deviations from the goal, momentum and nutation.

    With s, c of the tilt and s*, c* of the goal: the momentum about the vertical is off by
    ``d = s^2 phi' - s*^2 f + gyration omega3 (c - c*)``, which gravity does not change. The tilt
    nutates about its steady value, at the rate Omega near the goal; theta'' is that without torque.
    The parameters may be hidden: those of the middle top are used.
    """
    frame = frame_of(y, aux, p, c)
    G = vertical(attitude(y))
    across, falling, spin = axial_seen(frame, (y.omega1, y.omega2, y.omega3))
    falling = -falling
    tilt, rate = shared.precession(y)
    rate, goal_rate = (
        frame.side * rate,
        frame.side * shared.steady(aux.goal_tilt, y.omega3, p, c.fast_branch),
    )
    goal_sine, goal_cosine = sincos(aux.goal_tilt)
    sine = math.sqrt(fma(G[0], G[0], G[1] * G[1]))
    momentum = c.gyration * spin
    moment = fma(sine, across, -goal_sine * goal_sine * goal_rate)
    moment = fma(momentum, G[2] - goal_cosine, moment)
    bend = fma(across, fma(rate, G[2], -momentum), c.fall_square * sine)
    turn_rate = fma(-2.0 * goal_rate, goal_cosine, momentum)
    wave = math.sqrt(fma(turn_rate, turn_rate, (goal_rate * goal_sine) ** 2))
    bend = bend / max(wave, 1e-3)
    off, late = tilt - aux.goal_tilt, fma(-goal_rate, sine, across)
    return (
        tilt,
        aux.goal_tilt,
        min(spin, shared.FAST) * 0.2,
        goal_rate,
        *limited_pair((across, falling), 2.0),
        *shared.shares(off, late, _NEAR),
        *shared.shares(off, late, _CLOSE),
        *shared.shares(falling, bend, _NEAR),
        *shared.shares(falling, bend, _CLOSE),
        moment / (abs(moment) + _NEAR),
        moment / (abs(moment) + _CLOSE),
    )


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float]:
    """Torque about e1 and e2 of one along the axes of the frame, limited to a disk."""
    (along, left), _ = clip_to_disk((a[0], a[1]))
    x, z = turned_back(frame, along, left)
    return single(frame.side * x), single(frame.side * z)


TOP_PRECESSION = Reduction(
    group="O(2) x SO(2)",
    frame=(
        "across $e3$ towards the vertical, which turns with the line of nodes, mirrored so that "
        "the spin is not negative. The action is clipped to the disk in the square."
    ),
    symmetries=(TURN, PHASE, REFLECTION),
    features=(
        Entry("theta", "rad", "world", 0.0, math.pi),
        Entry("goal theta", "rad", "world", 0.0, math.pi),
        Entry("|omega3| / 5", "rad/s", "limited", 0.0, 0.2 * shared.FAST),
        Entry("goal phi'", "rad/s", "reduced", -shared.FAST, shared.FAST),
        Entry("phi' sin theta", "rad/s", "reduced, limited", -2.0, 2.0),
        Entry("theta'", "rad/s", "reduced, limited", -2.0, 2.0),
        *(
            Entry(f"share {name}", "1", f"of size of both + {half}", -1.0, 1.0)
            for pair in (("theta - goal", "(phi' - goal) sin theta"), ("theta'", "theta'' / Omega"))
            for half in (_NEAR, _CLOSE)
            for name in pair
        ),
        *(
            Entry("share d", "1", f"momentum d about the vertical, of |d| + {half}", -1.0, 1.0)
            for half in (_NEAR, _CLOSE)
        ),
    ),
    observe=observe_reduced,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    The $x$-axis of the frame, in the plane of $e1$ and $e2$, is along $(R31, R32)$, along
    $(-omega2, omega1)$ where that is 0, and along $e1$ where both are 0; $y$ is to the left of it,
    or to the right where $omega3 < 0$. $S$ is the sign of $omega3$, $(c, s)$ the $x$-axis, $theta*$
    the goal.

    Rates: $phi' sin(theta)$ stands for $v = S (c omega1 + s omega2)$, $theta' = s omega1 - c
    omega2$, $phi'$ is that of *Rewards* times $S$, as is its goal $f$, with the drawn parameters.
    With $fall = m g ell / I1$ and $M = I3 |omega3| / I1$: $d = sin(theta) v - sin(theta*)^2 f + M
    (cos(theta) - cos(theta*))$, $theta'' = v (phi' cos(theta) - M) + fall sin(theta)$, $Omega^2 =
    (M - 2 f cos(theta*))^2 + (f sin(theta*))^2$, $Omega$ at least $1e-3$. The third entry is
    $min(|omega3|, 30) / 5$; the shares are those of the vectors $(theta - theta*, v - f
    sin(theta))$, $(theta', theta'' / Omega)$ and of $d$.

    The action, clipped to the disk and then as $p$ along $e1$ and $e2$, acts as $S p$.
    """,
)
"""Reduction of `TopPrecession`: turns about the vertical, phase and reflections.

The frame turns in the body, so the action is limited to the disk in the square of the torques.
"""


# Damp the nutation of a top until it precesses steadily at a commanded tilt.

_SLOW = 1e-9  # rad/s; a goal below it, as of a top without spin, counts as this in its error


class Action(NamedTuple):
    """Torque about e1 and e2, as fractions of the maximum."""

    tau1: float
    tau2: float


class Terms(NamedTuple):
    """Reward terms of `TopPrecession`."""

    tilt: float
    rate: float
    effort: float


class Constants(NamedTuple):
    """Torque [N m], success (relative errors, time [s]), branch, tilts [rad], rate [rad/s], spins.

    Spins are fractions of the critical spin. Last m g ell / I1 [1/s^2] and I3 / I1, for the reduced
    frame.
    """

    torque: float
    tolerance: float
    hold: float
    fast_branch: float
    goal_tilt: float
    goal_spread: float
    start_tilt: float
    start_rate: float
    start_spin: float
    start_spread: float
    fall_square: float
    gyration: float


class Auxiliary(NamedTuple):
    """Control periods for which the errors have been small; commanded tilt [rad]."""

    held: float = 0.0
    goal_tilt: float = 0.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """Random tilt, transverse rates and goal; spin above the critical one."""
    q = tilted(stream, c.start_tilt * randoms.uniform(stream, 0), 1 << 20, 1 << 21)
    spin = shared.critical_spin(p) * fma(c.start_spread, randoms.uniform(stream, 1), c.start_spin)
    goal = fma(c.goal_spread, randoms.uniform(stream, 2), c.goal_tilt)
    across = randoms.in_disk(stream, 1 << 22)
    omega = (c.start_rate * across[0], c.start_rate * across[1], spin)
    return State(*q, *omega, *shared.ORIGIN), Auxiliary(held=0.0, goal_tilt=goal)


@scalar
def actuate(
    a: Action, y: State, aux: Auxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Torque about e1 and e2."""
    return y, Input(c.torque * a.tau1, c.torque * a.tau2, *shared.NONE, *shared.NONE)


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Reward terms, torque impulse as cost, success after the hold time."""
    goal = shared.steady(aux.goal_tilt, y.omega3, p, c.fast_branch)
    tilt, rate = shared.precession(y)
    off = abs(tilt - aux.goal_tilt)
    wrong = abs(rate - goal) / max(abs(goal), _SLOW)
    square = u.tau_body1 * u.tau_body1 + u.tau_body2 * u.tau_body2
    near = (off <= c.tolerance * aux.goal_tilt) & (wrong <= c.tolerance)
    held, success = held_for(near, aux, c, dt)
    terms = Terms(
        tilt=1.0 / (1.0 + 10.0 * off),
        rate=1.0 / (1.0 + 10.0 * wrong),
        effort=-square * (1.0 / (2.0 * c.torque * c.torque)),
    )
    return Auxiliary(held, aux.goal_tilt), terms, dt * math.sqrt(square), success, False


@scalar
def observe(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> Row:
    """Angular velocity in body axes, tilt and rate of precession, and their goals."""
    tilt, rate = shared.precession(y)
    return (
        *limited((y.omega1, y.omega2, y.omega3), shared.FAST),
        tilt,
        rate,
        aux.goal_tilt,
        shared.steady(aux.goal_tilt, y.omega3, p, c.fast_branch),
    )


@dataclass(frozen=True)
class TopPrecession(shared.SymmetricTopTask):
    """Bring a nutating top to steady precession at a commanded tilt.

    A top from a general start nutates between two tilts while it precesses. At every tilt there are
    two rates of steady precession, without nutation: a slow one, due to gravity, and a fast one,
    close to that of the free body. The commanded tilt and its rate on the chosen `branch` are
    observed.

    The steady motion needs no torque, but the transition does, and the response is gyroscopic: a
    tilting torque makes the top precess, and a torque about the vertical makes it rise or fall. The
    torque acts about $e1$ and $e2$, axes that turn with the spin, which is constant.

    Physics:
        The torque is $(tau1, tau2, 0)$ in body axes. The top is symmetric, $I1 = I2$ (`I_perp`),
        and $omega3$ is conserved under any action.

        Steady precession at the tilt $theta$ has one of the two rates that are the roots of $I1
        cos(theta) phi'^2 - I3 omega3 phi' + m g ell = 0$. Spins are above the critical one, $2
        sqrt(I1 m g ell) / I3$, so that both roots exist at every tilt. By default the slow rates
        are 0.26 to 0.53 rad/s and the fast ones 1.98 to 6.17 rad/s.

    Rewards:
        `tilt` = $1 / (1 + 10 |theta - goal|)$ and `rate` = $1 / (1 + 10 e)$ with the relative error
        $e$ of the precession rate $phi'$: their slopes are largest at the goal and nowhere zero.
        `effort` = $-|tau|^2 / (2 torque^2)$ has a small weight.

        $e = |phi' - goal| / max(|goal|, 1e-9)$ with $phi' = (omega1 R31 + omega2 R32) / max(R31^2 +
        R32^2, 1e-12)$; both rates are limited to $+-30$ rad/s. With the present $omega3$, $a = I1
        cos(theta)$ at the goal, $b = I3 omega3$, $c = m g ell$ and $n = b +- sqrt(max(b^2 - 4 a c,
        0))$, the sign that of $b$, the goal is $2 c / n$ (slow) or $n / (2 a)$ (fast), also where a
        given spin is too slow for a root; $|n|$ below $1e-9$ counts as $1e-9$ in $2 c / n$.

    Starting State:
        The commanded tilt is uniform from `goal_tilt` up to `goal_spread` above it. The tilt is
        uniform up to `start_tilt`; the spin, as a fraction of the critical one, uniform from
        `start_spin` up to `start_spread` above it; the rates across $e3$ are uniform in a disk of
        radius `start_rate`. The direction of the tilt and the phase of the body are uniform.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): tilt and precession
        rate have been at most `tolerance` off their goals, relatively, throughout the last `hold`
        seconds: $|theta - goal| <= tolerance goal$ and $e <= tolerance$.

    Reference:
        `lqr` is the linear-quadratic regulator of the steady precession, linear in $(theta - goal,
        theta', phi' - rate)$ with a gain for every tilt and spin, on the branch of the task.

        Exact: the roots. From steady precession on either branch, zero actions succeed at zero
        cost.

    Source:
        Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7.
    """

    n_substeps: int = 2
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

    episode: ClassVar = Episode(
        dynamics=HEAVY_TOP,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        derive=shared.derive_symmetric,
        start=start,
        clip=clip_to_square,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = TOP_PRECESSION
    cost_unit: ClassVar = "torque impulse [N m s]"

    @property
    def fast_branch(self) -> float:
        """1 where the goal is the fast root of steady precession, 0 where it is the slow one."""
        return float(self.branch == "fast")

    def actions(self) -> tuple[Entry, ...]:
        """Torques about e1 and e2."""
        return tuple(Entry(f"tau{k}", "N m", "body", -self.torque, self.torque) for k in (1, 2))

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity, tilt and rate of precession, and their goals."""
        return (
            *(Entry(f"omega{k}", "rad/s", "body", -shared.FAST, shared.FAST) for k in (1, 2, 3)),
            Entry("theta", "rad", "world", 0.0, math.pi),
            Entry("phi'", "rad/s", "world", -shared.FAST, shared.FAST),
            Entry("goal theta", "rad", "world", 0.0, math.pi),
            Entry("goal phi'", "rad/s", "world", -shared.FAST, shared.FAST),
        )

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """Commanded tilts of a start."""
        tilts = (self.goal_tilt, self.goal_tilt + self.goal_spread)
        return {**super().auxiliary_ranges(p, elapsed), "goal_tilt": tilts}

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates from the fastest start under gravity and full torque."""
        spin = (self.start_spin + self.start_spread) * self.largest_critical_spin
        impulse = math.sqrt(2.0) * self.torque * duration
        return shared.fastest_spinning(
            self.I_perp, self.I3, spin, self.start_rate, self.mgl, impulse
        )
