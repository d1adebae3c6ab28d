"""Keep the camera of a satellite on a point of the ground as it flies over."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import (
    Quaternion,
    Row,
    Vector,
    attitude,
    compose,
    cross,
    dot,
    half_turn,
    normalize,
    rotate,
    rotate_inverse,
    scaled,
)
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import atan2, fma, select, sincos, sqrt
from rigid_envs.engine.episode import Episode, clip_to_box
from rigid_envs.systems.free_body.saddle import within
from rigid_envs.systems.free_body.symmetry import ROTATION_IN_SPACE
from rigid_envs.systems.free_body.tasks.shared import HalfTurn, turn
from rigid_envs.systems.gyrostat.dynamics import GYROSTAT, Input, Parameters, State, momentum
from rigid_envs.systems.gyrostat.symmetry import HALF_TURN, MIRROR
from rigid_envs.systems.gyrostat.tasks.shared import BiasedWheelTask, biased
from rigid_envs.systems.gyrostat.tasks.wheel_reorient import (
    WheelTorques,
    actuate,
    stored,
    turn_pair,
)
from rigid_envs.tasks.fields import Entry, Range, physical
from rigid_envs.tasks.parts import Pair, limited, limited_pair
from rigid_envs.tasks.reduction import Reduction
from rigid_envs.tasks.task import UNIT, AuxiliaryRanges

EARTH = 6.371e6
"""Radius of the Earth [m]."""
ATTRACTION = 3.986004418e14
"""Standard gravitational parameter of the Earth [m^3/s^2]."""

_FULL, _FAST, _FAR = 2.0, 5.0, 10.0  # bounds of momenta, rates, and of distances and torques
_ANGLE = 3.142  # pi, and what rounding may add to it [rad]

# The line of sight: from the satellite on its circle to a point of the ground.


class Sight(NamedTuple):
    """Direction of the target [1], angular velocity of the direction [rad/s], its derivative."""

    direction: Vector
    rate: Vector
    acceleration: Vector


@scalar
def seen_from_orbit(place: Pair, target: Pair, c: Any) -> Sight:
    """The line of sight in the axes of the pass; lengths are in altitudes.

    The angles of the satellite and of its target are given by sine and cosine. With the target at d
    from the satellite, the angular velocity ``d x d' / d^2`` is across the line of sight.
    """
    far, n = c.ground + 1.0, c.orbit_rate
    along, up = far * place[0], far * place[1]
    d = (c.ground * target[0], -along, c.ground * target[1] - up)
    velocity, acceleration = (0.0, -n * up, n * along), (0.0, n * n * along, n * n * up)
    inverse = 1.0 / dot(d, d)
    rate = scaled(inverse, cross(d, velocity))
    turned, slowed = scaled(inverse, cross(d, acceleration)), -2.0 * inverse * dot(d, velocity)
    change = (
        fma(slowed, rate[0], turned[0]),
        fma(slowed, rate[1], turned[1]),
        fma(slowed, rate[2], turned[2]),
    )
    return Sight(scaled(sqrt(inverse), d), rate, change)


@scalar
def body_of_pass(y: Any, aux: Any) -> Quaternion:
    """Rotation from the axes of the pass to those of the satellite."""
    w, x, y_, z = attitude(y)
    frame = (aux.pass_w, aux.pass_x, aux.pass_y, aux.pass_z)
    return compose((w, -x, -y_, -z), frame)


@scalar
def seen_from_body(y: Any, aux: Any, c: Any) -> Sight:
    """The line of sight in the axes of the satellite."""
    place, target = (aux.sine, aux.cosine), (aux.target_sine, aux.target_cosine)
    turned, sight = body_of_pass(y, aux), seen_from_orbit(place, target, c)
    return Sight(
        rotate(turned, sight.direction),
        rotate(turned, sight.rate),
        rotate(turned, sight.acceleration),
    )


@scalar
def off_axis(direction: Vector) -> tuple[float, float, float]:
    """Angle of a direction from e3 [rad], and the turn about e1 and e2 that leads e3 there."""
    sine = sqrt(fma(direction[0], direction[0], direction[1] * direction[1]))
    angle = atan2(sine, direction[2])
    factor = select(sine > 1e-8, angle / select(sine > 1e-8, sine, 1.0), 1.0)
    return angle, -factor * direction[1], factor * direction[0]


@scalar
def to_go(aux: Any, c: Any) -> float:
    """Distance along the orbit to where it is nearest to the target [altitudes]."""
    distance: float = -(c.ground + 1.0) * atan2(aux.sine, aux.cosine)
    return distance


@scalar
def across(aux: Any, c: Any) -> float:
    """Distance of the target from the track on the ground [altitudes]."""
    distance: float = c.ground * atan2(aux.target_sine, aux.target_cosine)
    return distance


# Reduced coordinates: the line of sight in axes of the satellite, mirrored.


@scalar
def sides(sight: Sight) -> HalfTurn:
    """Signs of axial vectors, after which the line of sight turns forwards about e1 and e2."""
    s1 = select(sight.rate[0] < 0.0, -1.0, 1.0)
    s2 = select(sight.rate[1] < 0.0, -1.0, 1.0)
    return HalfTurn(s1, s2, s1 * s2)


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> HalfTurn:
    """Mirror image in which the satellite is seen."""
    return sides(seen_from_body(y, aux, c))


@scalar
def needed(y: Any, sight: Sight, p: Any, c: Any) -> Vector:
    """Torque on the wheels, over the largest, that turns the satellite as the line of sight turns.

    ``L x omega - I omega'``, with the acceleration of the line of sight.
    """
    gyro = cross(momentum(y, p), (y.omega1, y.omega2, y.omega3))
    a, scale = sight.acceleration, 1.0 / c.torque
    return limited(
        (
            scale * fma(-c.middle1, a[0], gyro[0]),
            scale * fma(-c.middle2, a[1], gyro[1]),
            scale * fma(-c.middle3, a[2], gyro[2]),
        ),
        _FAR,
    )


@scalar
def ahead(y: Any, aux: Any, sight: Sight, p: Any, c: Any) -> Pair:
    """Spin momenta about e1 and e2, over the capacity, in the middle of the pass.

    They are those of a satellite that then follows the line of sight, and whose e1 is at the angle
    from its rate at which it is now. The angular momentum is constant in space.
    """
    middle = seen_from_orbit((0.0, 1.0), (aux.target_sine, aux.target_cosine), c)
    L = rotate_inverse(body_of_pass(y, aux), momentum(y, p))
    w = sqrt(dot(middle.rate, middle.rate))
    e = scaled(1.0 / w, middle.rate)
    L1, L2 = dot(L, e), dot(L, cross(middle.direction, e))
    a, b, _ = sight.rate
    scale = 1.0 / sqrt(max(fma(a, a, b * b), 1e-60))
    cosine, sine = scale * a, scale * b
    l1 = fma(cosine, fma(-c.middle1, w, L1), -sine * L2)
    l2 = fma(sine, fma(-c.middle2, w, L1), cosine * L2)
    return limited_pair((l1 / c.capacity, l2 / c.capacity), _FAST)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Pointing error, slip, motion of the line of sight, spin momenta, torque to follow it."""
    sight = seen_from_body(y, aux, c)
    frame, scale = sides(sight), 1.0 / c.overhead_rate
    angle, off1, off2 = off_axis(sight.direction)
    off1, off2, share = frame.sign1 * off1, frame.sign2 * off2, 1.0 / (angle + c.bound)
    rate, change = scaled(scale, sight.rate), scaled(scale * scale, sight.acceleration)
    slip = (rate[0] - scale * y.omega1, rate[1] - scale * y.omega2, rate[2] - scale * y.omega3)
    return (
        off1,
        off2,
        share * off1,
        share * off2,
        *turn(limited(slip, _FAST), frame),
        *turn(limited(rate, 1.0), frame),
        *turn(limited(change, _FULL), frame),
        *turn(stored(y, p, c), frame),
        *turn(needed(y, sight, p, c), frame),
        *turn_pair(ahead(y, aux, sight, p, c), frame),
        within(to_go(aux, c), _FAR),
        frame.sign3 * within(across(aux, c), _FAR),
    )


SIGHT = Reduction(
    group="SO(3) x V4",
    frame="mirrored so that the line of sight turns about $e1$ and $e2$ in the positive sense.",
    symmetries=(ROTATION_IN_SPACE, HALF_TURN, MIRROR),
    features=(
        *(Entry(f"theta{k}", "rad", "reduced", -_ANGLE, _ANGLE) for k in "12"),
        *(Entry(f"theta{k} / (|theta| + bound)", "1", "reduced", -1.0, 1.0) for k in "12"),
        *(Entry(f"slip{k} / overhead_rate", "1", "reduced", -_FAST, _FAST) for k in "123"),
        *(Entry(f"sight_rate{k} / overhead_rate", "1", "reduced", -1.0, 1.0) for k in "123"),
        *(Entry(f"sight_rate{k}' / overhead_rate^2", "1", "reduced", -_FULL, _FULL) for k in "123"),
        *(Entry(f"l{k} / capacity", "1", "reduced", -_FULL, _FULL) for k in "123"),
        *(Entry(f"needed{k} / torque", "1", "reduced", -_FAR, _FAR) for k in "123"),
        *(Entry(f"ahead{k} / capacity", "1", "reduced", -_FAST, _FAST) for k in "12"),
        Entry("to go / altitude", "1", "orbit", -_FAR, _FAR),
        Entry("across / altitude", "1", "reduced", -_FAR, _FAR),
    ),
    observe=observe_reduced,
    Frame=HalfTurn,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    $theta$ is the rotation vector of the turn that leads $e3$ to the line of sight on the shortest
    way; slip is $omega_sight - omega$ and `needed` is $L x omega - I omega_sight'$; moments are the
    middles of their ranges. `ahead` is what wheels 1 and 2 will hold in the middle of the pass,
    where the satellite follows the line of sight and is turned about it as it is now. With $w h$
    the rate $omega_sight$ there, $h$ a unit vector, $s$ the line of sight there, and $(C, S)$ the
    first two components of $omega_sight$ now, over their norm: $ahead1 = C (L . h - I1 w) - S L .
    (s x h)$ and $ahead2 = S (L . h - I2 w) + C L . (s x h)$. Slip and `ahead` are limited to $+-5$,
    `needed` and distances to $+-10$, the rest to $+-2$. $S1$ and $S2$ are the signs of the first
    two components of $omega_sight$, and $S3 = S1 S2$; with them the vectors are multiplied, and the
    distance across with $S3$. The action $a$ acts as $(S1 a1, S2 a2, S3 a3)$.
    """,
)
"""Reduction of `WheelTrack`: turns of space, half turns and reflections that keep the camera."""


# Keep a camera on a target on the ground.


class Terms(NamedTuple):
    """Reward term of `WheelTrack`."""

    close: float


class Constants(NamedTuple):
    """Torque [N m], capacity, largest bias [N m s], periods and times [s], rates [rad/s].

    Radius of the Earth [altitudes], largest angles [rad], bound of the error, and the middles of
    the moments [kg m^2].
    """

    torque: float
    capacity: float
    bias: float
    dt: float
    lead: float
    orbit_rate: float
    overhead_rate: float
    ground: float
    target_angle: float
    start_angle: float
    bound: float
    middle1: float
    middle2: float
    middle3: float


class Auxiliary(NamedTuple):
    """Axes of the pass in space; angle from its middle, angle of the target; errors so far."""

    pass_w: float = 1.0
    pass_x: float = 0.0
    pass_y: float = 0.0
    pass_z: float = 0.0
    sine: float = 0.0
    cosine: float = 1.0
    target_sine: float = 0.0
    target_cosine: float = 1.0
    error_sum: float = 0.0
    n_errors: float = 0.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """At rest with the camera near the target, which comes nearer; any orbit, any roll.

    The camera is first turned down the axis z of the pass, then to the target on the shortest way.
    """
    frame = randoms.quaternion(stream, 1 << 20)
    lead = c.lead * fma(0.5, randoms.uniform(stream, 1 << 21), 0.5)
    side = fma(2.0, randoms.uniform(stream, (1 << 21) + 1), -1.0)
    place, target = sincos(-c.orbit_rate * lead), sincos(c.target_angle * side)
    X, Y, Z = seen_from_orbit(place, target, c).direction
    down = compose(normalize((1.0 - Z, Y, -X, 0.0)), (0.0, 1.0, 0.0, 0.0))
    roll, half = randoms.direction(stream, 1 << 22), 0.5 * c.start_angle
    off = randoms.in_disk(stream, 1 << 23)
    camera = compose((roll[0], 0.0, 0.0, roll[1]), half_turn((half * off[0], half * off[1], 0.0)))
    q = normalize(compose(frame, compose(down, camera)))
    return State(*q, 0.0, 0.0, 0.0, *biased(stream, p, c)), Auxiliary(*frame, *place, *target)


@scalar
def flown(aux: Auxiliary, angle: float) -> Pair:
    """Sine and cosine of the angle from the middle of the pass, after a turn of the orbit [rad]."""
    s, cosine = sincos(angle)
    x, y = cosine * aux.sine + s * aux.cosine, cosine * aux.cosine - s * aux.sine
    unit = fma(-0.5, x * x + y * y, 1.5)  # rounding errors of many turns add up
    return unit * x, unit * y


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Flight of the satellite; then the pointing error, and its mean for success."""
    place, target = flown(aux, c.orbit_rate * dt), (aux.target_sine, aux.target_cosine)
    frame = (aux.pass_w, aux.pass_x, aux.pass_y, aux.pass_z)
    sight = seen_from_body(y, Auxiliary(*frame, *place, *target), c)
    error, _, _ = off_axis(sight.direction)
    error_sum, n_errors = aux.error_sum + error, aux.n_errors + 1.0
    after = Auxiliary(*frame, *place, *target, error_sum, n_errors)
    impulse = dt * sqrt(u.u1 * u.u1 + u.u2 * u.u2 + u.u3 * u.u3)
    terms = Terms(close=1.0 / fma(20.0, error, 1.0))
    return after, terms, impulse, error_sum <= c.bound * n_errors, False


@scalar
def observe(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> Row:
    """Direction of the target and how it turns, omega, spin momenta, place in the pass."""
    sight, scale = seen_from_body(y, aux, c), 1.0 / c.overhead_rate
    omega = (scale * y.omega1, scale * y.omega2, scale * y.omega3)
    return (
        *limited(sight.direction, 1.0),
        *limited(scaled(scale, sight.rate), 1.0),
        *limited(omega, _FAST),
        *stored(y, p, c),
        within(to_go(aux, c), _FAR),
        within(across(aux, c), _FAR),
    )


@dataclass(frozen=True)
class WheelTrack(BiasedWheelTask):
    """Keep the camera of a satellite on a point of the ground as the satellite flies over it.

    The camera looks along $e3$. The line of sight turns slowly as the target comes nearer, quickly
    where it is nearest, and slowly again; how the satellite turns about it is free.

    Why it is hard: as the satellite flies over its target, the momentum $A omega$ that following
    takes is more than one wheel can hold. Two wheels share it, and what they held before, if the
    satellite has turned about the line of sight in time: whoever only looks at the present error is
    left behind with a full wheel.

    Physics:
        The satellite turns by three wheels as in `WheelReorient`.

        The Earth is a sphere of radius $r_E$ = 6371 km that does not turn, its gravitational
        parameter $mu$ = 3.986004418e14 m^3/s^2, the orbit a circle of radius $r = r_E + altitude$.
        The axes of the pass are $x$ across, $y$ along the flight in the middle of the pass and $z$
        up there; in them the satellite is at $r (0, sin(phi), cos(phi))$ with $phi' = n = sqrt(mu /
        r^3)$, and the target at $r_E (sin(beta), 0, cos(beta))$. So the target is at
        $d = (r_E sin(beta), -r sin(phi), r_E cos(beta) - r cos(phi))$ from the satellite, and the
        line of sight $d / |d|$ turns at $omega_sight = d x d' / |d|^2$, its derivative in space
        being $omega_sight' = (d x d'' - 2 (d . d') omega_sight) / |d|^2$. The largest rate is
        $overhead_rate = n r / altitude$, 0.0152 rad/s: that in the middle of the pass where $beta =
        0$. The pointing error is the angle between $e3$ and $d$. The target is followed even where
        it is below the horizon.

        Observed are, in body axes, the line of sight, its rate and that of the satellite, both over
        `overhead_rate`, and the spin momenta; and in altitudes the distance $-r phi$ along the
        orbit to the middle of the pass, $phi$ from $-pi$ to $pi$, and that of the target from the
        track on the ground, $r_E beta$, positive on the right.

    Rewards:
        `close` = $1 / (1 + 20 error)$ with the pointing error after the step [rad].

    Starting State:
        At rest in space. The orbit is uniform: the axes of the pass are those of a rotation that is
        uniform on $SO(3)$. The time to the middle of the pass is uniform from half of `lead` to
        `lead`, $r_E beta$ uniform between $+-across$. The camera is off the line of sight by a turn
        about $e1$ and $e2$ that is uniform in a disk of `start_angle`; the turn about the line of
        sight is uniform. The spin momenta of the wheels are uniform in a ball of radius `bias`.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): the mean pointing
        error of all steps so far, without that of the start, is at most `bound`.

    Reference:
        `look_ahead` turns the satellite about the line of sight so that no wheel will be full, by
        dynamic programming over the pass ahead. `feedforward` does not: it adds to the torque that
        follows the line of sight what closes the pointing error, and stops turning about it. `pd`
        is feedback of the pointing error and of the angular velocity alone. See
        `rigid_envs.systems.gyrostat.pointing.LookAhead`.

    Source:
        Wie, *Space Vehicle Dynamics and Control*, chapter 7; the orbit: Vallado, *Fundamentals of
        Astrodynamics and Applications*, chapters 1 and 11.
    """

    rotation: str = "none"
    J1: Range = physical(1e-4, "moment of the wheel along e1", "kg m^2")
    J2: Range = physical(1e-4, "moment of the wheel along e2", "kg m^2")
    J3: Range = physical(1e-4, "moment of the wheel along e3", "kg m^2")
    torque: float = setting(1e-3, Number("largest torque of each motor", "N m", 1e-9, 1e6))
    capacity: float = setting(
        0.03, Number("largest spin momentum of each wheel", "N m s", 1e-9, 1e6)
    )
    bias: float = setting(
        0.015, Number("radius of the ball of spin momenta at the start", "N m s", 0.0, 1e6)
    )
    altitude: float = setting(5e5, Number("altitude of the orbit", "m", 1e5, 1e8))
    lead: float = setting(
        200.0, Number("largest time at the start to the middle of the pass", "s", 0.0, 1e3)
    )
    across: float = setting(
        4e5, Number("largest distance of the target from the track on the ground", "m", 0.0, 1e7)
    )
    start_angle: float = setting(
        0.3, Number("largest pointing error at the start", "rad", 0.0, math.pi / 2)
    )
    bound: float = setting(
        0.05, Number("largest mean pointing error of a success", "rad", 1e-6, 4.0)
    )
    weight_close: float = setting(1.0, Number("weight of closeness", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=GYROSTAT,
        Action=WheelTorques,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        start=start,
        clip=clip_to_box,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = SIGHT
    counters: ClassVar = ("n_errors",)

    @property
    def ground(self) -> float:
        """Radius of the Earth over the altitude."""
        return EARTH / self.altitude

    @property
    def orbit_rate(self) -> float:
        """Angular velocity of the satellite about the Earth [rad/s]: Kepler's third law."""
        radius = EARTH + self.altitude
        return math.sqrt(ATTRACTION / (radius * radius * radius))

    @property
    def overhead_rate(self) -> float:
        """Rate of the line of sight as the satellite flies over its target [rad/s], the largest."""
        return self.orbit_rate * (self.ground + 1.0)

    @property
    def target_angle(self) -> float:
        """Largest angle of the target from the plane of the orbit, at the Earth's centre [rad]."""
        return self.across / EARTH

    def features(self) -> tuple[Entry, ...]:
        """Line of sight and its rate, angular velocity, spin momenta, place in the pass."""
        return (
            *(Entry(f"sight{k}", "1", "body", -1.0, 1.0) for k in "123"),
            *(Entry(f"sight_rate{k} / overhead_rate", "1", "body", -1.0, 1.0) for k in "123"),
            *(Entry(f"omega{k} / overhead_rate", "1", "body", -_FAST, _FAST) for k in "123"),
            *(Entry(f"l{k} / capacity", "1", "body", -_FULL, _FULL) for k in "123"),
            Entry("to go / altitude", "1", "orbit", -_FAR, _FAR),
            Entry("across / altitude", "1", "orbit", -_FAR, _FAR),
        )

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """Directions, and what was counted."""
        return {
            **super().auxiliary_ranges(p, elapsed),
            ("pass_w", "pass_x", "pass_y", "pass_z"): UNIT,
            ("sine", "cosine"): UNIT,
            ("target_sine", "target_cosine"): UNIT,
            "error_sum": (0.0, math.inf),
        }
