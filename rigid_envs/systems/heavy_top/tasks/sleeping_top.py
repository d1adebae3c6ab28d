"""Keep a slow top upright."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, refusal, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, Vector, attitude, rotate, vertical
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma
from rigid_envs.engine.episode import Episode, clip_to_disk, single
from rigid_envs.systems.heavy_top.dynamics import HEAVY_TOP, Input, Parameters, State
from rigid_envs.systems.heavy_top.symmetry import PHASE, REFLECTION, TURN
from rigid_envs.systems.heavy_top.tasks import shared
from rigid_envs.tasks.fields import Entry, Range, span
from rigid_envs.tasks.parts import Held, held_for, limited, tilted
from rigid_envs.tasks.reduction import Frame, Reduction, turned_back

# Reduced coordinates of a symmetric top that is held by a horizontal torque: `SleepingTop`.


@scalar
def _lean(y: Any, c: Any) -> shared.Lean:
    omega = (y.omega1, y.omega2, y.omega3)
    return shared.world_lean(attitude(y), omega, c.fall_square, c.gyration)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Lean, height and spin; the parameters may be hidden, so those of the middle top are used."""
    lean = _lean(y, c)
    frame = shared.lean_frame(lean, y.omega3)
    return shared.upright_seen(frame, lean, vertical(attitude(y))[2], y.omega3, c)


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame along the growing part of the lean."""
    return shared.lean_frame(_lean(y, c), y.omega3)


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float]:
    """Torque about the horizontal axis that drives the axis e3 along an action in the frame."""
    x, z = turned_back(frame, a[0], a[1])
    return single(-z), single(x)


SLEEPING_TOP = Reduction(
    group="O(2) x SO(2)",
    frame=(
        "$x$ along the growing part of the lean, mirrored so that the spin is not negative. The "
        "action is the push of the axis: the torque is at right angles to it."
    ),
    symmetries=(TURN, PHASE, REFLECTION),
    features=shared.UPRIGHT,
    observe=observe_reduced,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    The lean is $e = R13 + i R23$ with the rate $e'$. With $fall = m g ell / I$, $I$ the mean of
    $I1$ and $I2$, and $kappa = I3 omega3 / I$: $b = e' - i kappa e / 2$, $growth = sqrt(max(fall -
    kappa^2 / 4, 0))$, $u = b + growth e$, $s = b - growth e$. The $x$-axis of the frame is along
    $u$, along $s$ where $u$ is 0, and that of the world where both are 0; $y$ is to the left of it,
    or to the right where $omega3 < 0$.

    Entries: $min(3 |u|, 3)$, the shares of $|u|$, $s$, $s$ and $e$ with their halves, $R33$,
    $min(|kappa| / (2 sqrt(fall)), 4)$ and $growth / sqrt(fall)$. The action, as $p$ in world axes,
    acts as $(-p_y, p_x)$.
    """,
)
"""Reduction of `SleepingTop`: O(2), turns about the vertical and reflections, and the phase."""


# Keep a top upright whose spin is below the sleeping threshold.

_FAST = 20.0  # rad/s; bound of the observed rates


class Action(NamedTuple):
    """Horizontal torque in world axes, as a fraction of the maximum."""

    tau_x: float
    tau_y: float


class Terms(NamedTuple):
    """Reward terms of `SleepingTop`."""

    upright: float
    effort: float


class Constants(NamedTuple):
    """Torque [N m], success (tilt [rad], time [s]), start (tilt [rad], spins / critical spin).

    Last m g ell / I1 [1/s^2] and I3 / I1, for the reduced frame.
    """

    torque: float
    tolerance: float
    hold: float
    start_tilt: float
    start_spin_low: float
    start_spin_high: float
    fall_square: float
    gyration: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Held]:
    """Slow spin and small tilt; tilt, spin, azimuth and phase uniform."""
    tilt = c.start_tilt * randoms.uniform(stream, 0)
    width = c.start_spin_high - c.start_spin_low
    spin = shared.critical_spin(p) * fma(width, randoms.uniform(stream, 1), c.start_spin_low)
    q = tilted(stream, tilt, 2, 1 << 20)
    return State(*q, 0.0, 0.0, spin, *shared.ORIGIN), Held(0.0)


@scalar
def actuate(a: Action, y: State, aux: Held, p: Parameters, c: Constants) -> tuple[State, Input]:
    """Horizontal torque in world axes."""
    return y, Input(*shared.NONE, c.torque * a.tau_x, c.torque * a.tau_y, *shared.NONE)


@scalar
def outcome(
    y: State, u: Input, aux: Held, p: Parameters, c: Constants, dt: float
) -> tuple[Held, Terms, float, bool, bool]:
    """Reward terms, torque impulse as cost, success after the hold time."""
    tilt = shared.tilt_of(y)
    size = math.sqrt(u.tau_world_x * u.tau_world_x + u.tau_world_y * u.tau_world_y)
    held, success = held_for(tilt < c.tolerance, aux, c, dt)
    terms = Terms(
        upright=1.0 / (1.0 + 10.0 * tilt),
        effort=-(size * size) * (1.0 / (c.torque * c.torque)),
    )
    return Held(held), terms, dt * size, success, False


@scalar
def observe(y: State, aux: Held, p: Parameters, c: Constants) -> Vector:
    """Angular velocity in world axes, the frame of the torque."""
    return limited(rotate(attitude(y), (y.omega1, y.omega2, y.omega3)), _FAST)


@dataclass(frozen=True)
class SleepingTop(shared.SymmetricTopTask):
    """Keep a spinning top upright whose spin is below the sleeping threshold.

    Upright spin above the critical rate is stable: the top sleeps. Here the spin is 0.3 to 0.95 of
    the critical one: without control the tilt grows, and the top precesses as it falls. A
    horizontal torque, given in world axes, holds it up.

    Physics:
        The torque $tau$ is that in world axes. The top is symmetric, $I1 = I2$ (`I_perp`).

        For a small tilt, in complex numbers with $e = e_x + i e_y$ the horizontal part of the axis
        of the top, $I1 e'' - i I3 omega3 e' - m g ell e = -i tau$ with $tau = tau_x + i tau_y$. The
        top sleeps upright if $(I3 omega3)^2 > 4 I1 m g ell$, above the critical spin $2 sqrt(I1 m g
        ell) / I3$, here 4 rad/s. At a fraction $s$ of it the tilt grows at the rate $sqrt((1 - s^2)
        m g ell / I1)$: 0.95 per second at 0.3, 0.31 at 0.95.

    Rewards:
        `upright` = $1 / (1 + 10 theta)$ with the tilt $theta$: its slope is largest at the vertical
        and nowhere zero. `effort` = $-|tau|^2 / torque^2$ has a small weight: the upright top needs
        no torque.

    Starting State:
        The tilt is uniform up to `start_tilt`, the spin uniform from `start_spin_low` to
        `start_spin_high` of the critical one, and the transverse rates are 0. The direction of the
        tilt and the phase of the body are uniform.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): the tilt has been
        below `tolerance` throughout the last `hold` seconds.

    Reference:
        `transfer` lets the top fall and rise again, where that is in time, and gives its impulses
        where they cost least: see `rigid_envs.systems.heavy_top.transfer.SleepTransfer`.
        `lqr` is the linear-quadratic regulator of the upright top, linear in $e$ and $e'$ with a
        gain for every spin.

        Threshold: the critical spin. To first order, a start is caught if $m g ell theta sqrt(1 -
        s^2) < torque$.

    Source:
        Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7.
    """

    torque: float = setting(0.3, Number("largest torque", "N m", 1e-6, 1e6))
    start_tilt: float = setting(0.2, Number("largest tilt at the start", "rad", 0.0, math.pi))
    start_spin_low: float = setting(0.3, Number("least spin / critical spin", "1", 0.0, 10.0))
    start_spin_high: float = setting(0.95, Number("largest spin / critical spin", "1", 0.0, 10.0))
    tolerance: float = setting(0.05, Number("largest tilt of a success", "rad", 1e-6, math.pi))
    hold: float = setting(5.0, Number("time within tolerance at the end", "s", 0.0, 1e4))
    weight_upright: float = setting(1.0, Number("weight of the upright term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=HEAVY_TOP,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Held,
        derive=shared.derive_symmetric,
        start=start,
        clip=clip_to_disk,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = SLEEPING_TOP
    # Full torque for 15 s exceeds the envelope of the system, at more than 10 rad/s: the step is
    # then stable but less accurate. See Physics.
    envelope: ClassVar[float | None] = 1.1
    cost_unit: ClassVar = "torque impulse [N m s]"

    def check_settings(self) -> None:
        """Also refuse ends of the spin in the wrong order."""
        super().check_settings()
        if self.start_spin_low > self.start_spin_high:
            most = f"at most start_spin_high = {self.start_spin_high}"
            raise refusal("start_spin_low", self.start_spin_low, most)

    def actions(self) -> tuple[Entry, ...]:
        """Horizontal torque, in a disk."""
        return tuple(
            Entry(f"tau_{k}", "N m", "world, disk", -self.torque, self.torque) for k in "xy"
        )

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity."""
        return tuple(Entry(f"omega_{k}", "rad/s", "world", -_FAST, _FAST) for k in "xyz")

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates from the fastest start under gravity and full torque."""
        moments = (self.I_perp, self.I_perp, self.I3)
        low = min(span(moment)[0] for moment in moments)
        growth = self.torque / math.sqrt(low) * duration
        spin = self.start_spin_high * self.largest_critical_spin
        return shared.fastest_top(moments, spin, 0.0, self.mgl, growth)


@dataclass(frozen=True)
class SleepingTopRandom(SleepingTop):
    """Keep a slow top with random parameters upright.

    `SleepingTop` with moments, mass and length that are drawn in every episode and not observed.
    Growth rate and response to the torque are 0.8 to 1.2 of those of the default top. The spin is
    0.3 to 0.95 of the critical spin of the drawn top, 0.8 to 5.6 rad/s, so the observed spin does
    not determine its ratio to the threshold. The drawn values are observed with `observe_params`.

    Physics:
        The torque $tau$ is that in world axes. The top is symmetric, $I1 = I2$ (`I_perp`).

        The top sleeps upright if $(I3 omega3)^2 > 4 I1 m g ell$. Below, at a fraction $s$ of that
        spin, the tilt grows at the rate $sqrt((1 - s^2) m g ell / I1)$. From a tilt $theta$ at rest
        the torque catches the unstable mode, to first order, if $m g ell theta sqrt(1 - s^2) <
        torque$. Here the worst top needs 0.24 of 0.3 N m; much wider ranges would contain tops that
        cannot be caught.

        The torque can spin up a light top faster.

    Reference:
        The regulator of `SleepingTop` for the middle of the ranges, without the drawn values.

        Threshold: the critical spin $2 sqrt(I1 m g ell) / I3$ of each top.
    """

    envelope: ClassVar[float | None] = None

    n_substeps: int = 2
    I_perp: Range = (0.85, 1.2)
    I3: Range = (0.42, 0.6)
    m: Range = (0.8, 1.2)
    ell: Range = (0.95 / 9.81, 1.05 / 9.81)
