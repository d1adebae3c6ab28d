"""Twist a thrown racket so that it is caught with the commanded face up."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import (
    SUZUKI,
    Quaternion,
    Row,
    Vector,
    attitude,
    compose,
    log_rotation,
    matrix,
    normalize,
)
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import atan2, fma, select
from rigid_envs.engine.episode import Episode, clip_to_box
from rigid_envs.systems.free_body import saddle
from rigid_envs.systems.free_body.dynamics import free_rotation, rotor
from rigid_envs.systems.free_body.symmetry import HALF_TURN_1, HALF_TURN_2, ROTATION_IN_SPACE
from rigid_envs.systems.free_body.tasks import shared
from rigid_envs.systems.thrown_body.dynamics import THROWN_BODY, Input, Parameters, State
from rigid_envs.systems.thrown_body.system import ThrownBody
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.reduction import Reduction
from rigid_envs.tasks.task import UNIT, AuxiliaryRanges

# What is seen of a racket in flight: its attitude from that of the catch, rates, time left.


@scalar
def from_catch(y: Any, aux: Any) -> Quaternion:
    """Attitude as it is seen from that of the catch."""
    return compose((aux.goal_w, -aux.goal_x, -aux.goal_y, -aux.goal_z), attitude(y))


@scalar
def time_left(aux: Any, c: Any) -> float:
    """Time left over the longest."""
    left: float = min(max(aux.time_left / c.longest, 0.0), 1.0)
    return left


@scalar
def observe(y: State, aux: Any, p: Any, c: Any) -> Row:
    """Attitude from that of the catch, angular velocity and time left."""
    return (*matrix(from_catch(y, aux)), *shared.observed_rates(y, 1.0), time_left(aux, c))


# Reduced coordinates: half turns of racket and catch make omega2 and the growing coordinate of the
# saddle positive. The moments are the middles of their ranges.

_SMALL = 0.2  # rad/s; half of the shares of the coordinates of the saddle
_STEPS = 12  # of the free motion until the catch
_LONG = 2.0**150  # of a quaternion that is not normalised
_ANGLE = 3.142  # pi, and what rounding may add to it [rad]


@scalar
def sides(w: Vector, c: Any) -> shared.HalfTurn:
    """Half turns that make omega2 and d = omega1 - ratio omega3 positive."""
    s2 = select(w[1] < 0.0, -1.0, 1.0)
    s1 = select(saddle.place_at(w[0], s2 * w[2], c).d < 0.0, -1.0, 1.0)
    return shared.HalfTurn(s1, s2, s1 * s2)


@scalar
def miss(q: Quaternion, w: Vector, left: float, c: Any) -> Vector:
    """Rotation vector from the attitude of the catch to that which free motion leads to [rad]."""
    ratios, h = rotor(c.middle1, c.middle2, c.middle3), left * (1.0 / _STEPS)
    for k in range(5 * _STEPS):
        q, w = free_rotation(q, w, ratios, h * SUZUKI[k % 5])
        long = abs(q[0]) + abs(q[1]) + abs(q[2]) + abs(q[3]) > _LONG
        s = select(long, 1.0 / _LONG, 1.0)  # exact: of long steps it would overflow
        q = (s * q[0], s * q[1], s * q[2], s * q[3])
    return log_rotation(normalize(q))


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Rates, time left, what is missed without torque, coordinates of the saddle."""
    w = shared.observed_rates(y, 1.0)
    frame = sides(w, c)
    e1, e2, e3 = shared.turn(miss(from_catch(y, aux), w, max(aux.time_left, 0.0), c), frame)
    w1, w2, w3 = shared.turn(w, frame)
    at = saddle.place_at(w1, w3, c)
    return (
        w1,
        w2,
        w3,
        time_left(aux, c),
        e1,
        e2,
        e3,
        saddle.near(e1, c.tolerance),
        saddle.near(e2, c.tolerance),
        saddle.near(e3, c.tolerance),
        saddle.near(at.d, _SMALL),
        saddle.near(at.s, _SMALL),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> shared.HalfTurn:
    """Half turns after which the racket is seen."""
    return sides(shared.observed_rates(y, 1.0), c)


CATCH = Reduction(
    group="SO(3) x V4",
    frame="half turns such that $omega2$ and the growing coordinate of the saddle are above 0.",
    symmetries=(ROTATION_IN_SPACE, HALF_TURN_1, HALF_TURN_2),
    features=(
        *(Entry(f"omega{k}", "rad/s", "reduced", -shared.FASTEST, shared.FASTEST) for k in "123"),
        Entry("time left / longest", "1", "none", 0.0, 1.0),
        *(Entry(f"miss{k}", "rad", "reduced", -_ANGLE, _ANGLE) for k in "123"),
        *(Entry(f"near miss{k}", "1", "x / (x + tolerance)", -1.0, 1.0) for k in "123"),
        *(Entry(f"near {k}", "1", "x / (x + 0.2 rad/s)", -1.0, 1.0) for k in "ds"),
    ),
    observe=observe_reduced,
    Frame=shared.HalfTurn,
    frame_of=frame_of,
    turn=shared.turn,
    formulas="""
    With $r$ of `IntermediateAxis`, $S2$ is the sign of $omega2$, $S1$ that of $omega1 - S2 r
    omega3$, and $S3 = S1 S2$; rates are limited to $+-20$ rad/s. The miss $e$ is the rotation
    vector of $R_goal^T R$ at the catch without torque until then. It is found in 12 equal steps of
    fourth order, within 0.002 rad at the start and better with less time left.

    From here on the entries of $omega$ and $e$ are those times $S1$, $S2$ and $S3$. Entries:
    $omega$; the time left over the longest; $e$; the shares of the entries of $e$ with the half
    `tolerance`, and of $d, s = omega1 -+ r omega3$ with the half 0.2 rad/s. The action acts as $(S1
    a1, S2 a2, S3 a3)$.
    """,
)
"""Reduction of `RacketCatch`: SO(3), turns in space, times the half turns about the three axes."""


# Twist a thrown racket by weak torque, so that it is caught with the commanded face up.

_MILLI = 1e3  # costs are a few thousandths of a N m s


class Terms(NamedTuple):
    """Reward terms of `RacketCatch`."""

    catch: float
    impulse: float


class Constants(NamedTuple):
    """Torque [N m], tolerance [rad], start: flight times [s], turns, spread [rad/s], chance.

    And the control period [s], the longest time until a catch [s], middles of moments [kg m^2].
    """

    torque: float
    tolerance: float
    least_flight_time: float
    largest_flight_time: float
    least_turns: float
    largest_turns: float
    start_spread: float
    twist_chance: float
    dt: float
    longest: float
    middle1: float
    middle2: float
    middle3: float


class Auxiliary(NamedTuple):
    """Time until the catch [s]; attitude in which the racket is to be caught."""

    time_left: float = 0.0
    goal_w: float = 1.0
    goal_x: float = 0.0
    goal_y: float = 0.0
    goal_z: float = 0.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """A level racket of any heading, thrown up so that it turns about once; the face drawn."""
    low, high = c.least_flight_time, c.largest_flight_time
    time = fma(high - low, randoms.uniform(stream, 1 << 20), low)
    low, high = c.least_turns, c.largest_turns
    spin = 2.0 * math.pi * fma(high - low, randoms.uniform(stream, 1 << 21), low) / time
    a, b, d = randoms.in_ball(stream, 0)
    omega = (c.start_spread * a, fma(c.start_spread, b, spin), c.start_spread * d)
    w, z = randoms.direction(stream, 1 << 22)
    twist = randoms.uniform(stream, 1 << 23) < c.twist_chance
    left = -c.dt * float(np.floor(1e-9 - time / c.dt))
    goal = compose((w, 0.0, 0.0, z), (select(twist, 0.0, 1.0), select(twist, 1.0, 0.0), 0.0, 0.0))
    flight = (0.0, 0.0, 0.0, 0.0, 0.0, 0.5 * p.g * time)
    return State(w, 0.0, 0.0, z, *omega, *flight), Auxiliary(left, *goal)


@scalar
def actuate(
    a: shared.BodyTorque, y: State, aux: Auxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Torque about the three body axes."""
    tau = (c.torque * a.tau1, c.torque * a.tau2, c.torque * a.tau3)
    return y, Input(*tau, 0.0, 0.0, 0.0)


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """What the catch is worth, torque impulse, the success test; the catch ends the episode."""
    w, x, y_, z = from_catch(y, aux)
    angle = 2.0 * atan2(math.sqrt(fma(x, x, fma(y_, y_, z * z))), abs(w))
    torque = math.sqrt(u.tau1 * u.tau1 + u.tau2 * u.tau2 + u.tau3 * u.tau3)
    left = aux.time_left - dt
    caught = left < 1e-9 * dt
    terms = Terms(
        catch=select(caught, 1.0 / (1.0 + 5.0 * angle), 0.0),
        impulse=-torque / (math.sqrt(3.0) * c.torque),
    )
    goal = (aux.goal_w, aux.goal_x, aux.goal_y, aux.goal_z)
    success = caught & (angle <= c.tolerance)
    return Auxiliary(left, *goal), terms, _MILLI * dt * torque, success, caught


@dataclass(frozen=True)
class RacketCatch(shared.OrderedBodyTask):
    """Twist a thrown racket by weak torque, so that it is caught with the commanded face up.

    A racket is thrown up so that it turns over about once in flight, about the axis $e2$ across its
    handle, in the plane of its face. This axis is the unstable one: a little later the racket has
    twisted by half a turn about its handle $e1$, or less, or more, and is caught with the other
    face up or on its edge. Nobody can throw so well that it does not twist. In flight a weak torque
    decides: the handle has to come back to the hand, with the commanded face up.

    What has to be done is little if it is done early: the coordinate of the instability grows by a
    factor of some hundreds in one turn. A twist by half a turn has to be finished at the catch, not
    before and not after it.

    Physics:
        $I1 < I2 < I3$ are the moments about the handle, across it, and normal to the face. The
        rotation is free but for the torque; the centre of mass flies along the parabola $Z = V t -
        g t^2 / 2$ and comes down to the hand at $T = 2 V / g$. Beside $e2$ a perturbation grows at
        the rate $lambda = omega2 sqrt((I2 - I1)(I3 - I2) / (I1 I3))$, here 0.89 $omega2$: by
        $exp(0.89 . 2 pi)$ = 270 in a turn. How far a free racket twists is known in closed form
        (`rigid_envs.systems.thrown_body.closed_forms.racket_twist`).

    Rewards:
        `catch` = $1 / (1 + 5 angle)$ at the catch, with the angle [rad] between the attitude of the
        racket and that in which it is to be caught, and 0 before. `impulse` = $-|tau| / (sqrt(3)
        torque)$, so that its sum is proportional to the impulse.

    Starting State:
        The racket is level, with its handle in a direction that is uniform, and goes up at $g T /
        2$ from the height 0. $T$ is uniform in `flight_time`. $omega$ is $2 pi n / T$ about $e2$,
        with $n$ uniform in `turns`, plus a perturbation uniform in a ball of radius `start_spread`.
        The attitude of the catch is that of the start, with the probability `twist_chance` after
        half a turn about the handle.

    Episode End:
        The racket is caught at the end of the control period in which it comes down to the hand.
        The time left is $T$ at the start, rounded up to a multiple of `dt`; every step subtracts
        `dt`, until less than $1e-9 dt$ is left. Success (`info["is_success"]`): the angle is at
        most `tolerance` then.

    Reference:
        `shot` looks for the least change of $omega$ now from which the free motion is caught within
        the tolerance, and makes as much of it as the torque can: see
        `rigid_envs.systems.thrown_body.controllers.CatchShot`. `dead_centre` does the same with a
        hundredth of the tolerance.

    Source:
        Ashbaugh, Chicone & Cushman 1991, doi:10.1007/BF01049489.
    """

    dt: float = 0.02
    n_substeps: int = 4
    rotation: str = "none"
    I1: Range = physical(0.0012, "moment about the handle", "kg m^2")
    I2: Range = physical(0.0164, "moment across the handle", "kg m^2")
    I3: Range = physical(0.0175, "moment normal to the face", "kg m^2")
    m: Range = physical(0.33, "mass", "kg")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    torque: float = setting(0.02, Number("largest torque about each axis", "N m", 1e-9, 1e6))
    flight_time: Range = setting(
        (0.8, 1.2), Number("time from the throw to the catch", "s", 1e-3, 1e4, drawn=True)
    )
    turns: Range = setting(
        (0.95, 1.05), Number("turns about e2 in flight", "1", 0, 100, drawn=True)
    )
    start_spread: float = setting(
        0.3, Number("radius of the ball of perturbations at the start", "rad/s", 0.0, 1e3)
    )
    twist_chance: float = setting(
        0.5, Number("probability that the other face is commanded", "1", 0.0, 1.0)
    )
    tolerance: float = setting(
        0.15, Number("largest angle from the attitude of the catch", "rad", 1e-6, math.pi)
    )
    weight_catch: float = setting(10.0, Number("weight of the catch term", "1", -1e3, 1e3))
    weight_impulse: float = setting(0.2, Number("weight of the impulse term", "1", -1e3, 1e3))

    system_type: ClassVar = ThrownBody
    episode: ClassVar = Episode(
        dynamics=THROWN_BODY,
        Action=shared.BodyTorque,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        start=start,
        clip=clip_to_box,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = CATCH
    cost_unit: ClassVar[str] = "torque impulse [mN m s]"

    @property
    def least_flight_time(self) -> float:
        """Least time of flight [s]."""
        return span(self.flight_time)[0]

    @property
    def largest_flight_time(self) -> float:
        """Largest time of flight [s]."""
        return span(self.flight_time)[1]

    @property
    def longest(self) -> float:
        """Longest time from a throw to the end of the period of the catch [s]."""
        return self.dt * math.ceil(self.largest_flight_time / self.dt - 1e-9)

    @property
    def least_turns(self) -> float:
        """Least number of turns in flight."""
        return span(self.turns)[0]

    @property
    def largest_turns(self) -> float:
        """Largest number of turns in flight."""
        return span(self.turns)[1]

    def torques(self) -> tuple[float, float, float]:
        """The same about each axis."""
        return (self.torque,) * 3

    def features(self) -> tuple[Entry, ...]:
        """Attitude from that of the catch, angular velocity, time left."""
        bound = shared.FASTEST
        return (
            *(Entry(f"E{i}{j}", "1", "body to catch", -1.0, 1.0) for i in "123" for j in "123"),
            *(Entry(f"omega{k}", "rad/s", "body", -bound, bound) for k in "123"),
            Entry("time left / longest", "1", "none", 0.0, 1.0),
        )

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """The time left is at most the longest, and falls; the goal is a unit quaternion."""
        rounding = 1e-9 * self.longest
        left = (self.least_flight_time - self.dt * elapsed - rounding, self.longest)
        return {"time_left": left, ("goal_w", "goal_x", "goal_y", "goal_z"): UNIT}

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates after full torque during the whole flight, from the fastest throw."""
        spin = 2.0 * math.pi * self.largest_turns / self.least_flight_time
        flight = min(duration, self.longest)
        return self.spun_up_from(spin + self.start_spread, flight)
