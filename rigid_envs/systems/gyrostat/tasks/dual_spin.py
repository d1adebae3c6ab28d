"""Bring a satellite out of a flat spin by spinning up a rotor along its least axis."""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, Vector, dot, scaled
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, log, select, sqrt
from rigid_envs.engine.episode import Episode, NoAuxiliary, clip_to_interval
from rigid_envs.systems.free_body.saddle import near, within
from rigid_envs.systems.free_body.symmetry import HALF_TURN_1, HALF_TURN_2, ROTATION_IN_SPACE
from rigid_envs.systems.free_body.tasks.shared import FASTEST, DrawnRate, drawn_rate, observed_rates
from rigid_envs.systems.gyrostat.dynamics import (
    GYROSTAT,
    Input,
    Parameters,
    State,
    momentum,
    spin_momenta,
)
from rigid_envs.systems.gyrostat.tasks.shared import WheelTask, motor
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.parts import limited
from rigid_envs.tasks.reduction import Reduction, Side, turn_one

# The direction of L in the carrier: its isometric latitude about e1, and its longitude.

_FULL = 2.0  # bound of momenta over |L|, and of |L| over the capacity
_FAR = 10.0  # bound of the latitude
_POLE = 1e-18  # square of the sine of the angle from e1 below which there is no longitude
_TINY = 1e-100  # N m s


class Place(NamedTuple):
    """Direction of L in the carrier, its size [N m s], and the spin momentum of the rotor over it.

    With the longitude phi, ``L = |L| (tanh(latitude), (cos(phi), sin(phi)) / cosh(latitude))``.
    """

    size: float
    along: float
    latitude: float
    cosine: float
    sine: float
    stored: float


@scalar
def unit_momentum(y: Any, p: Any) -> tuple[float, Vector]:
    """|L| [N m s], and L / |L| in body axes."""
    L = momentum(y, p)
    size = max(sqrt(dot(L, L)), _TINY)
    return size, limited(scaled(1.0 / size, L), 1.0)


@scalar
def place_of(y: Any, p: Any) -> Place:
    """Where L is; cosine and sine are those of twice the longitude."""
    size, (n1, n2, n3) = unit_momentum(y, p)
    across = max(fma(n2, n2, n3 * n3), _POLE)
    latitude = log((1.0 + abs(n1)) / sqrt(across))
    return Place(
        size,
        n1,
        select(n1 < 0.0, -latitude, latitude),
        (n2 * n2 - n3 * n3) / across,
        within(2.0 * n2 * n3 / across, 1.0),
        spin_momenta(y, p)[0] / size,
    )


@scalar
def goal_latitude(size: float, A2: float, c: Any) -> float:
    """Latitude at which ``norm(L across e1) = A2 rate_tolerance``, at least 1."""
    return max(log(2.0 * size / (A2 * c.rate_tolerance)), 1.0)


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Any) -> Row:
    """Angular velocity, direction of L in the body, spin momentum of the rotor over |L|."""
    size, direction = unit_momentum(y, p)
    stored = within(spin_momenta(y, p)[0] / size, _FULL)
    return (*observed_rates(y, 1.0), *direction, stored)


# Reduced coordinates: half turns such that L is led to e1, and not to -e1.

_HELD = 10.0  # weight of the spin momentum in the choice of the side
_NEAR = 0.2  # half of the share of the latitude that is left


@scalar
def side(at: Place) -> float:
    """1 where e1 is the nearer end, -1 where -e1 is."""
    return select(fma(_HELD, at.stored, at.latitude - at.sine) < 0.0, -1.0, 1.0)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Latitude, longitude and its rate, rate about e1, momenta, what is left."""
    at = place_of(y, p)
    sign = side(at)
    per_A2, per_A3 = 0.5 / c.middle2, 0.5 / c.middle3
    mean = fma(per_A2 - per_A3, at.cosine, per_A2 + per_A3)
    drift = fma(at.size * at.along, mean, -y.omega1)
    left = goal_latitude(at.size, c.middle2, c) - sign * at.latitude
    omega = (y.omega1, y.omega2, y.omega3)
    return (
        within(sign * at.latitude, _FAR),
        at.cosine,
        -sign * at.sine,
        within(sign * drift, FASTEST),
        within(sign * y.omega1, FASTEST),
        within(sign * at.stored, _FULL),
        min(at.size / c.capacity, _FULL),
        near(left, _NEAR),
        near(sign * y.omega1, c.rate_tolerance),
        near(sqrt(dot(omega, omega)), c.rate_tolerance),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Side:
    """The side to which L is led."""
    return Side(side(place_of(y, p)))


SPUN = Reduction(
    group="SO(3) x V4",
    frame="half turn such that L is led to $e1$, and not to $-e1$.",
    symmetries=(ROTATION_IN_SPACE, HALF_TURN_1, HALF_TURN_2),
    features=(
        Entry("latitude", "1", "reduced", -_FAR, _FAR),
        Entry("cos 2 phi", "1", "reduced", -1.0, 1.0),
        Entry("-sin 2 phi", "1", "> 0: comes nearer", -1.0, 1.0),
        Entry("phi'", "rad/s", "reduced", -FASTEST, FASTEST),
        Entry("omega1", "rad/s", "reduced", -FASTEST, FASTEST),
        Entry("l / |L|", "1", "reduced", -_FULL, _FULL),
        Entry("|L| / capacity", "1", "none", 0.0, _FULL),
        Entry("near goal", "1", "x / (x + 0.2)", -1.0, 1.0),
        Entry("near omega1", "1", "x / (x + tolerance)", -1.0, 1.0),
        Entry("near |omega|", "1", "x / (x + tolerance)", 0.0, 1.0),
    ),
    observe=observe_reduced,
    Frame=Side,
    frame_of=frame_of,
    turn=turn_one,
    formulas="""
    With $n = L / |L|$ in body axes, the latitude is $s = +-log((1 + |n1|) / sqrt(n2^2 + n3^2))$
    with the sign of $n1$; $cos 2 phi = (n2^2 - n3^2) / (n2^2 + n3^2)$ and $sin 2 phi = 2 n2 n3 /
    (n2^2 + n3^2)$, where $n2^2 + n3^2$ counts as at least $1e-18$. $S$ is the sign of $10 l / |L| +
    s - sin 2 phi$.

    Entries: $S s$, limited to $+-10$; $cos 2 phi$; $-S sin 2 phi$; $S phi'$ with $phi' = L1
    ((1 + cos 2 phi) / I2 + (1 - cos 2 phi) / I3) / 2 - omega1$; $S omega1$; $S l / |L|$ and $|L| /
    capacity$, limited to 2; the shares of what is left of the latitude, $max(log(2 |L| / (I2
    rate_tolerance)), 1) - S s$, with the half 0.2, and of $S omega1$ and $|omega|$ with the half
    `rate_tolerance`. The action $a$ acts as $S a$.
    """,
)
"""Reduction of `DualSpin`: SO(3), turns in space, times the half turns about the three axes."""


# Lead a satellite out of flat spin by the torque of the motor of a rotor.


class RotorTorque(NamedTuple):
    """Torque of the motor on the rotor, as a fraction of the maximum."""

    u1: float


class Terms(NamedTuple):
    """Reward terms of `DualSpin`."""

    cone: float
    turning: float
    rest: float


class Constants(NamedTuple):
    """Torque [N m], capacity [N m s], period [s], start and tolerance [rad/s].

    And the middles of the moments [kg m^2].
    """

    torque: float
    capacity: float
    dt: float
    least_start_rate: float
    largest_start_rate: float
    start_spread: float
    rate_tolerance: float
    middle2: float
    middle3: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, NoAuxiliary]:
    """Spin about e3, perturbed uniformly in a ball; the rotor turns with the carrier."""
    rate = drawn_rate(stream, 1 << 21, c)
    a, b, d = randoms.in_ball(stream, 0)
    omega = (c.start_spread * a, c.start_spread * b, fma(c.start_spread, d, rate))
    return State(*randoms.quaternion(stream, 1 << 20), *omega), NoAuxiliary()


@scalar
def actuate(
    a: RotorTorque, y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Torque of the motor."""
    return y, Input(motor(a.u1, spin_momenta(y, p)[0], c), 0.0, 0.0, 0.0, 0.0, 0.0)


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """How far L is from e1, how fast the carrier turns about it; time as cost; rest ends it."""
    at, omega = place_of(y, p), (y.omega1, y.omega2, y.omega3)
    come = abs(at.latitude) / goal_latitude(at.size, p.A2, c)
    rest = sqrt(dot(omega, omega)) <= c.rate_tolerance
    terms = Terms(
        cone=min(come, 1.0) - 1.0,
        turning=-min(p.A1 * abs(y.omega1) / at.size, 1.0),
        rest=select(rest, 1.0, 0.0),
    )
    return aux, terms, dt, rest, rest


@dataclass(frozen=True)
class DualSpin(DrawnRate, WheelTask):
    """Bring a satellite out of a flat spin by spinning up a rotor along its least axis.

    A slender satellite that loses energy ends in a flat spin: it turns about $e3$, the axis of its
    largest moment, and its antenna along $e1$ sweeps through space. A single rotor along $e1$ is
    there to help. When it has taken up all the angular momentum, the carrier is at rest and $e1$,
    or $-e1$, points along $L$. The rotor cannot turn $L$ in space: it is the satellite that has to
    turn over, by a right angle, and all the motor can do for it is to speed up and slow down the
    rotor.

    At full torque the rotor is soon fast enough, but then the carrier tumbles on, in a wide
    nutation about $L$ that the rotor hardly damps any more. The motor must wait halfway, where the
    gyrostat turns over by itself, and it must get there, and go on from there, at the right time.

    Physics:
        $L = A omega + l e1$ is constant in space, $l' = u$ (`Gyrostat`), with $A = (I1 - J1, I2,
        I3)$. With $L = |L| (tanh(s), cos(phi) / cosh(s), sin(phi) / cosh(s))$ in body axes the
        motion is $s' = -(|L| / 2) (1 / A2 - 1 / A3) sin(2 phi)$ and $phi' = L1 (cos(phi)^2 / A2 +
        sin(phi)^2 / A3) - omega1$, $omega1 = (L1 - l) / A1$. So $L$ comes nearer to $e1$ as long as
        $phi$ is near $-45$ or $135$ degrees. It stays there for $l$ between $|L| (1 - A1 / A2)$ and
        $|L| (1 - A1 / A3)$: there $e1$ along $L$ is a saddle of the energy, below it a maximum and
        above it a minimum. For less $l$ the flat spin and $e1$ are divided by a separatrix.

    Rewards:
        With $n = L / |L|$ in body axes and $s = log((1 + |n1|) / sqrt(n2^2 + n3^2))$: `cone` =
        $min(s / max(log(2 |L| / (A2 rate_tolerance)), 1), 1) - 1$; $n2^2 + n3^2$ counts as at least
        $1e-18$. `turning` = $-min(A1 |omega1| / |L|, 1)$. Both are at most 0, so that a step costs
        less at a better place. `rest` = 1 in the step that succeeds.

    Starting State:
        $omega$ is the rate $Omega$ about $e3$, uniform in `start_rate`, plus a perturbation uniform
        in a ball of radius `start_spread`; the rotor is at rest relative to the carrier; the
        attitude is uniform on $SO(3)$.

    Episode End:
        The episode terminates when $|omega|$ is at most `rate_tolerance`. That step is the success
        (`info["is_success"]`). The carrier then remains nearly at rest if the motor is switched
        off.

    Reference:
        `ride` turns $phi$ to where $L$ comes nearer to $e1$ and holds it there, and spins the rotor
        up at full torque as soon as that leads to rest: see
        `rigid_envs.systems.gyrostat.controllers.DualSpinTurn`.

        No policy needs less than the time in which $s$ can grow from that of the start to that of
        the tolerance, $2 (arcosh(|L| / (A_max rate_tolerance)) - |s|) / (|L| |1 / A2 - 1 / A3|)$
        with the larger $A_max$ of $A2$ and $A3$, nor than the time in which the motor can bring the
        momentum into the rotor.

    Source:
        Hall 1996, "Momentum transfer in two-rotor gyrostats", Journal of Guidance, Control, and
        Dynamics 19(5); Hughes, *Spacecraft Attitude Dynamics*, chapter 6.
    """

    n_substeps: int = 8
    rotation: str = "none"
    J1: Range = physical(0.5, "moment of the rotor along e1 about its axis", "kg m^2")
    torque: float = setting(0.03, Number("largest torque of the motor", "N m", 1e-9, 1e6))
    capacity: float = setting(2.5, Number("largest spin momentum of the rotor", "N m s", 1e-9, 1e6))
    start_rate: Range = setting(
        (0.4, 0.6), Number("rate of the flat spin at the start", "rad/s", 0.0, 1e3, drawn=True)
    )
    start_spread: float = setting(
        0.1, Number("radius of the ball of perturbations at the start", "rad/s", 0.0, 1e3)
    )
    rate_tolerance: float = setting(
        0.03, Number("largest rate of the carrier at rest", "rad/s", 1e-6, 1e3)
    )
    weight_cone: float = setting(0.05, Number("weight of the cone term", "1", -1e3, 1e3))
    weight_turning: float = setting(0.05, Number("weight of the turning term", "1", -1e3, 1e3))
    weight_rest: float = setting(10.0, Number("weight of coming to rest", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=GYROSTAT,
        Action=RotorTorque,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=clip_to_interval,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = SPUN
    cost_unit: ClassVar[str] = "time [s]"

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity, direction of L, spin momentum of the rotor."""
        return (
            *(Entry(f"omega{k}", "rad/s", "body", -FASTEST, FASTEST) for k in "123"),
            *(Entry(f"L{k} / |L|", "1", "body", -1.0, 1.0) for k in "123"),
            Entry("l / |L|", "1", "body", -_FULL, _FULL),
        )

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates at a full rotor: the angular momentum is that of the start."""
        fastest = self.largest_start_rate + self.start_spread
        L = fastest * max(span(moment)[1] for moment in (self.I1, self.I2, self.I3))
        return self.turned_at_most(L, max(self.capacity, span(self.J1)[1] * fastest))
