"""Turn a tippe top upside down."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, cast

from rigid_envs.base.settings import Number, refusal, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, attitude, dot, rotate, vertical
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, sincos
from rigid_envs.engine.episode import Episode, clip_to_interval
from rigid_envs.systems.spheroid import dynamics as spheroid
from rigid_envs.systems.spheroid.dynamics import SPHEROID, Input, Parameters, State
from rigid_envs.systems.spheroid.symmetry import PHASE, REFLECTION, TURN
from rigid_envs.systems.spheroid.system import Spheroid
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.parts import Held, held_for, limited, limited_pair, tilted
from rigid_envs.tasks.reduction import (
    Frame,
    Reduction,
    Side,
    axial_seen,
    frame_along,
    polar_seen,
    turn_one,
)
from rigid_envs.tasks.symmetry import TRANSLATION
from rigid_envs.tasks.task import Task

# Reduced coordinates of a tippe top: `TippeTop`.

_FAST = 30.0  # rad/s; bound of the observed rates
_QUICK = 30.0  # m/s; bound of the observed velocities
_MOST = 20.0  # bound of Jellett's integral, in units of that which is needed


class Seen(NamedTuple):
    """Axis e3 and angular velocity in world axes, slip [m/s], Jellett's integral [N m^2 s]."""

    axis: tuple[float, float, float]
    omega: tuple[float, float, float]
    slip_x: float
    slip_y: float
    jellett: float


@scalar
def _seen(y: Any, c: Any) -> Seen:
    """What the reduced frame needs, of the top in the middle of the ranges."""
    q = attitude(y)
    axis, omega = rotate(q, (0.0, 0.0, 1.0)), (y.omega1, y.omega2, y.omega3)
    level = dot(vertical(q), (c.moment * y.omega1, c.moment * y.omega2, c.axial * y.omega3))
    omega = rotate(q, omega)
    arm = (c.depth * axis[0], c.depth * axis[1], fma(c.depth, axis[2], -c.reach))
    return Seen(
        axis,
        omega,
        y.VX + fma(omega[1], arm[2], -omega[2] * arm[1]),
        y.VY + fma(omega[2], arm[0], -omega[0] * arm[2]),
        fma(c.reach, level, -c.depth * c.axial * y.omega3),
    )


@scalar
def _frame(seen: Seen) -> Frame:
    x, y_, _ = seen.axis
    return frame_along(x, y_, seen.slip_x, seen.slip_y, seen.jellett < 0.0)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Axis, rates, slip and Jellett's integral, in the frame of the lean."""
    seen = _seen(y, c)
    frame = _frame(seen)
    lean, _ = polar_seen(frame, seen.axis[0], seen.axis[1])
    slip = limited_pair(polar_seen(frame, seen.slip_x, seen.slip_y), _QUICK)
    needed = frame.side * seen.jellett / c.needed
    return (
        lean,
        seen.axis[2],
        *limited(axial_seen(frame, seen.omega), _FAST),
        min(max(frame.side * y.omega3, -_FAST), _FAST),
        *slip,
        min(needed, _MOST),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Side:
    """The side to which the frame is mirrored: all that the torque asks for."""
    return Side(_frame(_seen(y, c)).side)


TIPPE_TOP = Reduction(
    group="E(2) x SO(2)",
    frame=(
        "$x$ along the horizontal part of the axis, mirrored so that Jellett's integral is not "
        "negative."
    ),
    symmetries=(TRANSLATION, TURN, PHASE, REFLECTION),
    features=(
        Entry("sin(theta)", "1", "lean of the axis", -1.0, 1.0),
        Entry("R33", "1", "body to world", -1.0, 1.0),
        *(Entry(f"omega_{k}", "rad/s", "reduced", -_FAST, _FAST) for k in "xyz"),
        Entry("omega3", "rad/s", "reduced", -_FAST, _FAST),
        *(Entry(f"slip_{k}", "m/s", "reduced", -_QUICK, _QUICK) for k in "xy"),
        Entry("J / needed", "1", "limited", 0.0, _MOST),
    ),
    observe=observe_reduced,
    Frame=Side,
    frame_of=frame_of,
    turn=turn_one,
    formulas="""
    The slip is $v = V + omega x (offset e3 - radius e_z)$, its horizontal part, in world axes, and
    $J = L . (radius e_z - offset e3)$. The $x$-axis of the frame is along the horizontal part of
    $e3$, along $v$ where that is 0, and that of the world where both are 0; $y$ is to the left of
    it, or to the right where $J < 0$: then $S = -1$, else 1.

    Entries: the length of the horizontal part of $e3$, $R33$, $S omega$ along $x$, along $y$ and
    along the vertical, $S omega3$, $v$ in the frame, and $S J$ over the $J$ above which a top that
    stands on its head is stable. The action acts times $S$.
    """,
)
"""Reduction of `TippeTop`: motions of the plane, reflections, and the phase."""


# Turn a tippe top upside down with little torque: friction does the rest.

_PARAMETERS = ("m", "radius", "offset", "I1", "I3", "g", "mu", "slip_speed", "drag")


class Action(NamedTuple):
    """Torque about the axis, as a fraction of the maximum."""

    tau3: float


class Terms(NamedTuple):
    """Reward terms of `TippeTop`."""

    inverted: float
    effort: float


class Constants(NamedTuple):
    """Torque [N m], success (angle [rad], time [s]), start (tilts [rad], spins / rising spin).

    For the reduced frame: moments [kg m^2], radius and offset [m], Jellett's integral [N m^2 s].
    """

    torque: float
    tolerance: float
    hold: float
    start_tilt_low: float
    start_tilt_high: float
    start_spin_low: float
    start_spin_high: float
    moment: float
    axial: float
    reach: float
    depth: float
    needed: float


@scalar
def derive_sphere(
    m: float,
    radius: float,
    half_height: float,
    offset: float,
    I1: float,
    I3: float,
    g: float,
    mu: float,
    slip_speed: float,
    drag: float,
) -> Parameters:
    """Parameters of a sphere: both semi-axes are the radius, though drawn independently."""
    return spheroid.derive(m, radius, radius, offset, I1, I3, g, mu, slip_speed, drag)


@scalar
def rising_spin(p: Parameters) -> float:
    """Spin [rad/s] above which an upright top leaves the vertical, by friction.

    ``n^2 r (I1 r - I3 (r - a)) = m g a (r - a)^2``.
    """
    rest = p.radius - p.offset
    return math.sqrt(
        p.m * p.g * p.offset * rest * rest / (p.radius * p.I1 - rest * p.I3) / p.radius
    )


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Held]:
    """Slow spin about a leaning axis, of either sense; tilt, spin, azimuth and phase uniform."""
    width = c.start_tilt_high - c.start_tilt_low
    tilt = fma(width, randoms.uniform(stream, 0), c.start_tilt_low)
    width = c.start_spin_high - c.start_spin_low
    spin = 2.0 * randoms.uniform(stream, 1) - 1.0
    share = fma(width, abs(spin), c.start_spin_low)
    spin = math.copysign(share * rising_spin(p), spin)
    q = tilted(stream, tilt, 1 << 20, 1 << 21)
    return State(*q, 0.0, 0.0, spin, 0.0, 0.0, 0.0, 0.0), Held(0.0)


@scalar
def actuate(a: Action, y: State, aux: Held, p: Parameters, c: Constants) -> tuple[State, Input]:
    """Torque about the axis of the body."""
    return y, Input(0.0, 0.0, c.torque * a.tau3, 0.0, 0.0)


@scalar
def outcome(
    y: State, u: Input, aux: Held, p: Parameters, c: Constants, dt: float
) -> tuple[Held, Terms, float, bool, bool]:
    """Reward terms, torque impulse as cost, success after the hold time."""
    up = vertical(attitude(y))
    _, edge = sincos(c.tolerance)
    held, success = held_for(up[2] < -edge, aux, c, dt)
    size = abs(u.tau3)
    terms = Terms(inverted=0.5 - 0.5 * up[2], effort=-size / c.torque)
    return Held(held), terms, dt * size, success, False


@scalar
def observe(
    y: State, aux: Held, p: Parameters, c: Constants
) -> tuple[float, float, float, float, float]:
    """Angular velocity and velocity of the centre of mass, in world axes."""
    omega = rotate(attitude(y), (y.omega1, y.omega2, y.omega3))
    return (*limited(omega, _FAST), *limited_pair((y.VX, y.VY), _QUICK))


@dataclass(frozen=True)
class TippeTop(Task):
    """Turn a tippe top upside down with little torque about its axis.

    A tippe top is a sphere whose centre of mass is below its centre. Spun fast, it turns over and
    goes on spinning on its head, with the centre of mass above: friction at the contact does it.
    Here it spins too slowly to rise. A torque about its axis, as of the fingers that spin it, is
    the only control.

    The sense of the spin in the body is reversed on the way, while that in space stays: so a torque
    that speeds the spin up at the beginning slows it down at the end. Between the two there is an
    angle at which the torque does nothing.

    Physics:
        Friction at the contact is opposed to the slip $v$: $F = -(mu / sqrt(v^2 + slip_speed^2) +
        drag) N v$. It has no moment about the line from the centre of mass to the contact, so
        Jellett's integral $J = L . (r e_z - a e3)$ is constant without torque, for the radius $r$
        and the offset $a$. Torque changes it at $J' = (r cos(theta) - a) tau$.

        Upright spin leaves the vertical above the rate $n$ with $n^2 r (I1 r - I3 (r - a)) = m g a
        (r - a)^2$, here 3.80 rad/s; there $J = I3 n (r - a)$. Spin on the head is stable above $n^2
        r (I3 (r + a) - I1 r) = m g a (r + a)^2$, here 5.96 rad/s, and $J = I3 n (r + a)$, 2.91
        times as much.

    Rewards:
        `inverted` = $(1 - cos(theta)) / 2$ with the tilt $theta$; `effort` = $-|tau| / torque$, so
        that its sum is proportional to the impulse.

    Starting State:
        The tilt is uniform between `start_tilt_low` and `start_tilt_high`, the spin about the axis
        uniform from `start_spin_low` to `start_spin_high` of the $n$ at which the upright top
        rises, of either sense; the other rates and the velocity of the centre of mass are 0. The
        direction of the tilt and the phase of the body are uniform.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): $theta$ has been
        above $pi$ - `tolerance` throughout the last `hold` seconds.

    Reference:
        `two_spins` spins the top up until it rises, waits until the torque acts the other way, and
        gives $J$ the rest that it needs to stand: see
        `rigid_envs.systems.spheroid.controllers.TippeTopSpin`. `spin_up` gives all of it at the
        start.

        Thresholds: the two rates above.

    Source:
        Cohen 1977, "The tippe top revisited", doi:10.1119/1.10926; Rauch-Wojciechowski, Skoldstam &
        Glad 2005, "Mathematical analysis of the tippe top", doi:10.1070/RD2005v010n04ABEH000319.
    """

    dt: float = 0.2
    n_substeps: int = 14
    m: Range = physical(1.0, "mass", "kg")
    radius: Range = physical(1.0, "radius of the sphere", "m")
    offset: Range = physical(0.3, "depth of the centre of mass below the centre", "m")
    I1: Range = physical(0.38, "moment across the axis", "kg m^2")
    I3: Range = physical(0.4, "moment about the axis", "kg m^2")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    mu: Range = physical(0.6, "coefficient of friction", "1")
    slip_speed: Range = physical(2.0, "slip below which friction falls", "m/s")
    drag: Range = setting(
        0.0, Number("coefficient of viscous friction", "s/m", 0.0, 1e6, drawn=True)
    )
    torque: float = setting(0.5, Number("largest torque", "N m", 1e-6, 1e6))
    start_tilt_low: float = setting(0.1, Number("least tilt at the start", "rad", 0.0, math.pi))
    start_tilt_high: float = setting(0.5, Number("largest tilt at the start", "rad", 0.0, math.pi))
    start_spin_low: float = setting(0.5, Number("least spin / rising spin", "1", 0.0, 10.0))
    start_spin_high: float = setting(0.9, Number("largest spin / rising spin", "1", 0.0, 10.0))
    tolerance: float = setting(0.3, Number("largest angle from inverted", "rad", 1e-6, math.pi))
    hold: float = setting(3.0, Number("time within tolerance at the end", "s", 0.0, 1e4))
    weight_inverted: float = setting(1.0, Number("weight of the inverted term", "1", -1e3, 1e3))
    weight_effort: float = setting(1.0, Number("weight of the effort term", "1", -1e3, 1e3))

    system_type: ClassVar = Spheroid
    episode: ClassVar = Episode(
        dynamics=SPHEROID,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Held,
        derive=derive_sphere,
        start=start,
        clip=clip_to_interval,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = TIPPE_TOP
    counters: ClassVar = ("held",)
    # Full torque for 30 s exceeds the envelope of the system, at more than 30 rad/s: the step is
    # then stable but less accurate.
    envelope: ClassVar[float | None] = 1.0
    aliases: ClassVar = {"half_height": "radius"}
    cost_unit: ClassVar = "torque impulse [N m s]"

    def check_settings(self) -> None:
        """Also refuse ends in the wrong order, and tops that never rise or never stand."""
        super().check_settings()
        for name in ("start_tilt", "start_spin"):
            low, high = getattr(self, f"{name}_low"), getattr(self, f"{name}_high")
            if low > high:
                raise refusal(f"{name}_low", low, f"at most {name}_high = {high}")
        for top in self._tops():
            if not 0.0 < top.rising_spin < math.inf > top.standing_spin > 0.0:
                expected = "1 - offset / radius < I1 / I3 < 1 + offset / radius: it turns over"
                raise refusal("I1", self.I1, expected)

    def actions(self) -> tuple[Entry, ...]:
        """Torque about the axis."""
        return (Entry("tau3", "N m", "body", -self.torque, self.torque),)

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity and velocity of the centre of mass."""
        return (
            *(Entry(f"omega_{k}", "rad/s", "world", -_FAST, _FAST) for k in "xyz"),
            *(Entry(f"V{k}", "m/s", "world", -_QUICK, _QUICK) for k in "XY"),
        )

    def _middle(self) -> Spheroid:
        return cast(Spheroid, self.system())

    # What the reduced frame knows: the top in the middle of the ranges.
    @property
    def moment(self) -> float:
        """Middle of the range of I1 [kg m^2]."""
        return self._middle().I1

    @property
    def axial(self) -> float:
        """Middle of the range of I3 [kg m^2]."""
        return self._middle().I3

    @property
    def reach(self) -> float:
        """Middle of the range of the radius [m]."""
        return self._middle().radius

    @property
    def depth(self) -> float:
        """Middle of the range of the offset [m]."""
        return self._middle().offset

    @property
    def needed(self) -> float:
        """Jellett's integral above which the inverted top is stable [N m^2 s]."""
        return self._middle().standing_jellett

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates from the fastest start, by the work of the torque.

        Without torque the energy does not grow, and the potential energy falls by 2 m g offset at
        most; with it, (sqrt(2 T))' <= torque / sqrt(I3).
        """
        return max(self._fastest(top, duration) for top in self._tops())

    def _fastest(self, top: Spheroid, duration: float) -> float:
        spin = self.start_spin_high * top.rising_spin
        root = math.sqrt(top.I3 * spin**2 + 4.0 * top.m * top.g * top.offset)
        root += self.torque * duration / math.sqrt(top.I3)
        turn = max(1.0, top.I3 / top.I1) * root / math.sqrt(min(top.I1, top.I3))
        return turn + top.slowest_rate

    def _tops(self) -> Iterator[Spheroid]:
        """Tops at all ends of the ranges."""
        ends = (set(span(getattr(self, name))) for name in _PARAMETERS)
        for values in itertools.product(*ends):
            top = dict(zip(_PARAMETERS, values, strict=True))
            yield Spheroid(half_height=top["radius"], **top)
