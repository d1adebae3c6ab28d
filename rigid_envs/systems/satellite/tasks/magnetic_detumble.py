"""Bring a tumbling satellite to rest by magnetic coils."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, refusal, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, Vector, attitude, cross, dot, scaled
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, log, select, sqrt
from rigid_envs.engine.episode import Episode, NoAuxiliary, clip_to_ball, single
from rigid_envs.systems.free_body.saddle import near, within
from rigid_envs.systems.free_body.symmetry import HALF_TURN_1, HALF_TURN_2
from rigid_envs.systems.free_body.tasks.shared import DrawnRate, drawn_rate
from rigid_envs.systems.satellite.dynamics import SATELLITE, Input, Parameters, State, field
from rigid_envs.systems.satellite.symmetry import HALF_ORBIT
from rigid_envs.systems.satellite.tasks.shared import CoilTask, Dipole, actuate, turn_of_field
from rigid_envs.tasks.fields import Entry, Range
from rigid_envs.tasks.parts import limited
from rigid_envs.tasks.reduction import Reduction

_FAR = 100.0  # bound of rates, in largest rates at the start
_SHORT = 1e-9  # sine of an angle below which two vectors are parallel
_TINY = 1e-100
_LOG_LARGE = 20.0


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Any) -> Row:
    """Angular velocity, field and direction against its change, in body axes; place."""
    h, cosine, sine = turn_of_field(y)
    rates = scaled(1.0 / c.largest_start_rate, (y.omega1, y.omega2, y.omega3))
    B = scaled(1.0 / p.b, field(attitude(y), y.latitude, p))
    return (*limited(rates, _FAR), *limited(B, 2.0), *limited(h, 1.0), cosine, sine)


# Reduced coordinates: axes along the angular momentum across the field, and along the field.


class Axes(NamedTuple):
    """Unit vectors in body axes: of the dipole that brakes, and of the momentum across the field.

    The third one, along the field, is their cross product.
    """

    brake1: float
    brake2: float
    brake3: float
    across1: float
    across2: float
    across3: float


@scalar
def normal_to(n: Vector) -> Vector:
    """A unit vector across a unit vector n: along n x e_k with the least of its coordinates k."""
    first = (abs(n[0]) <= abs(n[1])) & (abs(n[0]) <= abs(n[2]))
    second = abs(n[1]) <= abs(n[2])
    k1 = select(first, 1.0, 0.0)
    k2 = select(first, 0.0, select(second, 1.0, 0.0))
    v = cross(n, (k1, k2, 1.0 - k1 - k2))
    return scaled(1.0 / sqrt(dot(v, v)), v)


@scalar
def directions(y: Any, p: Any, c: Any) -> tuple[Vector, Vector, Vector, Vector, Vector]:
    """B [T] and L [N m s]; unit vectors n along B, of the dipole that brakes, of L across n.

    The moments are the middles of their ranges.
    """
    B = field(attitude(y), y.latitude, p)
    n = scaled(1.0 / max(sqrt(dot(B, B)), _TINY), B)
    L = (c.middle1 * y.omega1, c.middle2 * y.omega2, c.middle3 * y.omega3)
    brake = cross(L, n)
    part = sqrt(dot(brake, brake))
    none, other = part <= _SHORT * sqrt(dot(L, L)), normal_to(n)
    inverse = 1.0 / select(none, 1.0, part)
    d = (
        select(none, other[0], inverse * brake[0]),
        select(none, other[1], inverse * brake[1]),
        select(none, other[2], inverse * brake[2]),
    )
    return B, L, n, d, cross(n, d)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Momentum, angular velocity and change of the field along the reduced axes."""
    B, L, n, d, t = directions(y, p, c)
    h, cosine, sine = turn_of_field(y)
    omega = (y.omega1, y.omega2, y.omega3)
    rate, per_rate = sqrt(dot(omega, omega)), 1.0 / c.largest_start_rate
    per_size = 1.0 / max(sqrt(dot(L, L)), _TINY)
    spin = dot(L, n) * per_size
    return (
        within(log(1.0 + rate / c.rate_tolerance), _LOG_LARGE),
        near(rate, c.rate_tolerance),
        near(rate, 0.3 * c.largest_start_rate),
        within(spin, 1.0),
        within(dot(L, t) * per_size, 1.0),
        within(per_rate * dot(omega, n), _FAR),
        within(per_rate * dot(omega, d), _FAR),
        within(per_rate * dot(omega, t), _FAR),
        within(dot(h, n), 1.0),
        within(dot(h, d), 1.0),
        within(dot(h, t), 1.0),
        within(sqrt(dot(B, B)) / p.b, 2.0),
        cosine,
        sine,
        within(per_size * abs(L[0]), 1.0),
        within(per_size * abs(L[1]), 1.0),
        within(per_size * abs(L[2]), 1.0),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Axes:
    """Axes of the dipole that brakes and of the momentum across the field."""
    _, _, _, d, t = directions(y, p, c)
    return Axes(*d, *t)


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float, float]:
    """Dipole about the axes of the body."""
    d = (frame.brake1, frame.brake2, frame.brake3)
    t = (frame.across1, frame.across2, frame.across3)
    n = cross(d, t)
    return (
        single(fma(a[0], d[0], fma(a[1], t[0], a[2] * n[0]))),
        single(fma(a[0], d[1], fma(a[1], t[1], a[2] * n[1]))),
        single(fma(a[0], d[2], fma(a[1], t[2], a[2] * n[2]))),
    )


ACROSS_FIELD = Reduction(
    group="Z2 x V4",
    frame="first axis of the dipole that brakes, $L x B$, third axis along $B$.",
    symmetries=(HALF_ORBIT, HALF_TURN_1, HALF_TURN_2),
    features=(
        Entry("log omega", "1", "log(1 + |omega| / tolerance)", 0.0, _LOG_LARGE),
        Entry("near rest", "1", "x / (x + tolerance)", 0.0, 1.0),
        Entry("near slow", "1", "x / (x + 0.3 start)", 0.0, 1.0),
        Entry("L along B / |L|", "1", "reduced", -1.0, 1.0),
        Entry("L across B / |L|", "1", "reduced", -1.0, 1.0),
        *(Entry(f"omega along {k} / start", "1", "reduced", -_FAR, _FAR) for k in "ndt"),
        *(Entry(f"h along {k}", "1", "reduced", -1.0, 1.0) for k in "ndt"),
        Entry("|B| / b", "1", "none", 0.0, 2.0),
        Entry("cos 2u", "1", "place in the orbit", -1.0, 1.0),
        Entry("sin 2u", "1", "place in the orbit", -1.0, 1.0),
        *(Entry(f"abs L{k} / |L|", "1", "body", 0.0, 1.0) for k in "123"),
    ),
    observe=observe_reduced,
    Frame=Axes,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    $L = I omega$ with the middles of the moments, $n = B / |B|$, $d = L x n / |L x n|$ and $t = n x
    d$, the direction of $L$ across $n$. Where $|L x n| <= 1e-9 |L|$, $d$ is along $n x e_k$ with
    the $k$ of the least $|n_k|$, the first one of equal ones.

    Entries: $log(1 + |omega| / rate_tolerance)$ up to 20; the shares $x / (x + h)$ of $|omega|$
    with the halves $h$ of `rate_tolerance` and 0.3 of the largest `start_rate`; $L$ along $n$ and
    along $t$, over $|L|$; $omega$ along $n$, $d$ and $t$ over the largest `start_rate`, limited to
    $+-100$; $h$ along $n$, $d$ and $t$; $|B| / b$; $cos 2u$, $sin 2u$; $|L1|$, $|L2|$, $|L3|$ over
    $|L|$. However small $L$ is, it has a direction, but for $L = 0$. The action $a$ acts as the
    dipole $a1 d + a2 t + a3 n$.
    """,
)
"""Reduction of `MagneticDetumble`: half orbits, times the half turns about the three axes."""


# Bring a tumbling satellite to rest by magnetic coils.


class Terms(NamedTuple):
    """Reward terms of `MagneticDetumble`."""

    rate: float
    rest: float


class Constants(NamedTuple):
    """Dipole [A m^2], rates at the start and tolerance [rad/s].

    And the middles of the moments [kg m^2].
    """

    dipole: float
    least_start_rate: float
    largest_start_rate: float
    rate_tolerance: float
    middle1: float
    middle2: float
    middle3: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, NoAuxiliary]:
    """Angular velocity in any direction; attitude and place in the orbit uniform."""
    rate = drawn_rate(stream, 1 << 21, c)
    v = randoms.in_ball(stream, 0)
    rate = rate / max(sqrt(dot(v, v)), _TINY)
    u = 2.0 * math.pi * randoms.uniform(stream, 1 << 22)
    q = randoms.quaternion(stream, 1 << 20)
    return State(*q, rate * v[0], rate * v[1], rate * v[2], u), NoAuxiliary()


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """How slow the satellite is; time as cost; rest ends it."""
    omega = (y.omega1, y.omega2, y.omega3)
    over = sqrt(dot(omega, omega)) / c.rate_tolerance
    rest = over <= 1.0
    left = log(max(over, 1.0)) / log(c.largest_start_rate / c.rate_tolerance)
    return aux, Terms(-min(left, 1.0), select(rest, 1.0, 0.0)), dt, rest, rest


@dataclass(frozen=True)
class MagneticDetumble(DrawnRate, CoilTask):
    """Bring a tumbling satellite to rest by magnetic coils.

    Most small satellites have no thrusters. After the launch they tumble, and what they brake with
    is the Earth's magnetic field: a current in a coil makes a dipole $m$, on which the field $B$
    exerts the torque $m x B$. It is small, and it has no part along the field. So the angular
    momentum along $B$ cannot be braked where it is; the satellite has to wait until it is
    elsewhere on its orbit, where the field has turned.

    The largest dipole against the momentum across the field is what one would do with thrusters,
    and here it fails from many starts. What the turning field uncovers of the momentum is braked
    away at once; the momentum then follows the field and keeps its size. A good policy brakes at
    the pace at which the field turns.

    Physics:
        $I omega' = I omega x omega + 3 n^2 r x I r + m x B$ on a circular orbit with $u' = n$
        (`Satellite`); in space $r = (cos u, sin u, 0)$, $B = b (e - 3 (e . r) r)$ with the Earth's
        axis $e = (0, sin i, cos i)$. The field turns twice in an orbit: $B' = -3 n b sin(i) h$ with
        $h = (cos 2u, sin 2u, 0)$. The dipole is constant in body axes for a control period.

    Rewards:
        `rate` = $-min(log(max(|omega| / rate_tolerance, 1)) / log(Omega / rate_tolerance), 1)$ with
        the largest $Omega$ of `start_rate`; `rest` = 1 in the step that succeeds.

    Starting State:
        $omega$ has any direction and a magnitude uniform in `start_rate`; the attitude is uniform
        on $SO(3)$, the argument of latitude $u$ uniform.

    Episode End:
        The episode terminates when $|omega|$ is at most `rate_tolerance`. That step is the success
        (`info["is_success"]`).

    Reference:
        `b_dot` brakes the momentum across the field at a rate $k$ that is matched to the turning of
        the field, $m = k L x B / |B|^2$, $k = 2 n (1 + sin i)$, up to the largest dipole. It is
        named after the law $m = -k B'$ with the change of the field that a magnetometer in the
        tumbling satellite sees, which is nearly $B x omega$.

        No policy needs less than the time in which the largest dipole across the strongest field,
        $b sqrt(1 + 3 sin(i)^2)$, and the largest torque of gravity, $3 n^2 (I_max - I_min) / 2$,
        take away the momentum that is too much, $|L| - I_max rate_tolerance$.

    Source:
        Avanzini & Giulietti 2012, "Magnetic detumbling of a rigid spacecraft", doi:10.2514/1.53074;
        Stickler & Alfriend 1976, "Elementary magnetic attitude control system",
        doi:10.2514/3.57089.
    """

    n_substeps: int = 6
    start_rate: Range = setting(
        (0.05, 0.1), Number("angular velocity at the start", "rad/s", 0.0, 1e3, drawn=True)
    )
    rate_tolerance: float = setting(
        0.01, Number("largest angular velocity at rest", "rad/s", 1e-6, 1e3)
    )
    weight_rate: float = setting(0.05, Number("weight of the rate term", "1", -1e3, 1e3))
    weight_rest: float = setting(10.0, Number("weight of coming to rest", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=SATELLITE,
        Action=Dipole,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=clip_to_ball,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = ACROSS_FIELD
    cost_unit: ClassVar[str] = "time [s]"

    def check_settings(self) -> None:
        """Also refuse a start at rest."""
        super().check_settings()
        if not self.least_start_rate > self.rate_tolerance:
            expected = f"more than rate_tolerance = {self.rate_tolerance}"
            raise refusal("start_rate", self.start_rate, expected)

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity, field, change of the field, place in the orbit."""
        return (
            *(Entry(f"omega{k} / start_rate", "1", "body", -_FAR, _FAR) for k in "123"),
            *(Entry(f"B{k} / b", "1", "body", -2.0, 2.0) for k in "123"),
            *(Entry(f"h{k}", "1", "body", -1.0, 1.0) for k in "123"),
            Entry("cos 2u", "1", "place in the orbit", -1.0, 1.0),
            Entry("sin 2u", "1", "place in the orbit", -1.0, 1.0),
        )

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates at the largest torque during the whole episode."""
        return self.turned_at_most(self.largest_start_rate, duration)
