"""Park a coin."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, attitude, compose
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import atan2, cbrt, fma, select
from rigid_envs.engine.episode import Episode, NoAuxiliary, clip_to_square
from rigid_envs.systems.upright_coin.dynamics import UPRIGHT_COIN, Input, Parameters, State
from rigid_envs.systems.upright_coin.symmetry import ACROSS, ALONG
from rigid_envs.systems.upright_coin.system import UprightCoin
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.parts import limited_pair
from rigid_envs.tasks.reduction import Reduction
from rigid_envs.tasks.task import Rolling

# Common functions of the coin's task and of its reduced frame.

FAR = 50.0  # radii; bound of observed and penalised offsets


@scalar
def wrapped(angle: float) -> float:
    """The same angle in [-pi, pi], for one in [-60 pi, 60 pi]."""
    turns: float = np.floor(angle * (0.5 / math.pi) + 0.5)
    return angle - 2.0 * math.pi * turns


# Reduced coordinates of an upright coin relative to its goal.

_ROLL = 4.0  # rad; bound of the roll that is planned
_BEYOND = 10.0  # radii; bound of the missing length


class Signs(NamedTuple):
    """Signs by which roll rate and steer rate are multiplied."""

    roll: float
    steer: float


class Reach(NamedTuple):
    """Offset X, Y [radii], phase psi and mismatch ``X + psi`` [rad], and the signs of the frame.

    X is multiplied by the first sign and Y by the second, psi by that of X, phi by both.
    """

    X: float
    Y: float
    phase: float
    mismatch: float
    sign_x: float
    sign_y: float


@scalar
def reach(y: Any, p: Any) -> Reach:
    """What has to be rolled, and the signs with which the mismatch and Y are positive."""
    scale = 1.0 / p.radius
    X, Y = limited_pair((scale * y.X, scale * y.Y), FAR)
    phase = atan2(fma(y.x, y.z, -y.w * y.y), fma(y.w, y.x, y.y * y.z))
    mismatch = wrapped(X + phase)
    return Reach(
        X,
        Y,
        phase,
        mismatch,
        sign_x=select(mismatch < 0.0, -1.0, 1.0),
        sign_y=select(y.Y < 0.0, -1.0, 1.0),
    )


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Pose, and a plan of two straight rolls, the first of them along the present heading.

    Rolls by a and b, with the headings phi and phi_2, lead from the offset D to the goal with
    a + b = -psi = S if ``a = (S^2 - D^2) / (2 (S - D . u))``, u along the heading: the first point
    on the straight line from which the goal is -b away.
    """
    here = reach(y, p)
    turned = here.sign_x * here.sign_y
    X, Y = here.sign_x * here.X, abs(here.Y)
    phase, mismatch = here.sign_x * here.phase, abs(here.mismatch)
    cosine, sine = 2.0 * fma(y.w, y.x, -y.y * y.z), 2.0 * turned * fma(y.x, y.z, y.w * y.y)
    ahead, aside = fma(X, cosine, Y * sine), fma(Y, cosine, -X * sine)
    room, missing = -phase - ahead, fma(phase, phase, -fma(X, X, Y * Y))
    # a quotient that is bounded and changes its sign where S = D . u
    first = 0.5 * missing * room / max(room * room, 1e-4)
    root = min(math.sqrt(abs(missing)), _BEYOND)
    return (
        X,
        Y,
        math.sqrt(Y),
        cosine,
        sine,
        phase,
        mismatch,
        math.sqrt(mismatch),
        ahead,
        aside,
        min(max(room, -_BEYOND), _BEYOND),
        select(missing < 0.0, -root, root),
        min(max(first, -_ROLL), _ROLL),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Signs:
    """Signs of the mismatch, and of the mismatch times Y."""
    here = reach(y, p)
    return Signs(here.sign_x, here.sign_x * here.sign_y)


@scalar
def turn(a: Any, sign: Any) -> tuple[float, float]:
    """Roll rate and steer rate of the task."""
    return sign.roll * a[0], sign.steer * a[1]


_WIDE = 1.5 * FAR

COIN_POSE = Reduction(
    group="Z2 x Z2",
    frame="signs such that $Y$ and the mismatch between rolled offset and phase are not negative.",
    symmetries=(ALONG, ACROSS),
    features=(
        Entry("X / radius", "1", "reduced", -FAR, FAR),
        Entry("Y / radius", "1", "reduced", 0.0, FAR),
        Entry("sqrt Y", "1", "radii", 0.0, math.sqrt(FAR)),
        Entry("cos phi", "1", "reduced", -1.0, 1.0),
        Entry("sin phi", "1", "reduced", -1.0, 1.0),
        Entry("psi", "rad", "reduced", -math.pi, math.pi),
        Entry("m", "rad", "mismatch", 0.0, math.pi),
        Entry("sqrt m", "1", "mismatch", 0.0, math.sqrt(math.pi)),
        Entry("ahead", "1", "offset along the heading, radii", -_WIDE, _WIDE),
        Entry("aside", "1", "offset across the heading, radii", -_WIDE, _WIDE),
        Entry("-psi - ahead", "1", "limited", -_BEYOND, _BEYOND),
        Entry("sqrt(psi^2 - D^2)", "1", "signed root, limited", -_BEYOND, _BEYOND),
        Entry("first roll", "rad", "of two", -_ROLL, _ROLL),
    ),
    observe=observe_reduced,
    Frame=Signs,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        With $x$ and $y$ the offset in radii, limited to $+-50$, and $m = x + psi$ within half a
        turn: $a$ is the sign of $m$, $b$ that of $y$. $x$, $psi$, $m$ and the roll rate are
        multiplied by $a$; $y$ by $b$; $phi$ and the steer rate by $a b$.

        Of what is multiplied: $ahead$ is $x cos phi + y sin phi$, $aside$ $y cos phi - x sin phi$,
        and $D^2 = x^2 + y^2$. With $h = -psi - ahead$ and $e = psi^2 - D^2$, the signed root is
        $sign(e) sqrt(|e|)$ and the first roll $e h / (2 max(h^2, 0.0001))$, each within its bounds.
    """,
)
"""Reduction of `CoinPark`: reflections in the plane of the coin at the goal, and across it."""


# Park an upright coin: reach position, heading and roll phase by rolling and steering.

_SMOOTH = 1e-3  # smooths the roots at the origin
_UPRIGHT = math.sqrt(0.5)


class Action(NamedTuple):
    """Roll rate and steer rate, each as a fraction of its maximum."""

    roll_rate: float
    steer_rate: float


class Terms(NamedTuple):
    """Reward terms of `CoinPark`."""

    position: float
    heading: float
    side: float
    mismatch: float
    parked: float


class Constants(NamedTuple):
    """Largest rates [rad/s], tolerances [m, rad, rad], half side of the start square [m]."""

    largest_roll_rate: float
    largest_steer_rate: float
    position_tolerance: float
    heading_tolerance: float
    phase_tolerance: float
    start_half_width: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """Position uniform in a square, heading and phase uniform; q = Rz(phi) Rx(pi / 2) Rz(psi)."""
    X = c.start_half_width * (2.0 * randoms.uniform(stream, 0) - 1.0)
    Y = c.start_half_width * (2.0 * randoms.uniform(stream, 1) - 1.0)
    heading, phase = randoms.direction(stream, 1 << 20), randoms.direction(stream, 1 << 21)
    turned = compose((heading[0], 0.0, 0.0, heading[1]), (_UPRIGHT, _UPRIGHT, 0.0, 0.0))
    q = compose(turned, (phase[0], 0.0, 0.0, phase[1]))
    return State(*q, X, Y, 0.0, 0.0), ()


@scalar
def actuate(
    a: Action, y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Roll rate and steer rate, set at once; without torque the path is an arc."""
    steer_rate, roll_rate = c.largest_steer_rate * a.steer_rate, c.largest_roll_rate * a.roll_rate
    return State(*attitude(y), y.X, y.Y, steer_rate, roll_rate), Input(0.0, 0.0)


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """Cost by the order of the Lie bracket that generates each direction (see `CoinPark`)."""
    X, Y = y.X / p.radius, y.Y / p.radius
    total, difference = atan2(y.z, y.w), atan2(y.y, y.x)
    heading, phase = wrapped(total + difference), wrapped(total - difference)
    distance = math.sqrt(X * X + Y * Y)
    mismatch = wrapped(max(min(X, FAR), -FAR) + phase)
    near = distance * p.radius <= c.position_tolerance
    parked = near & (abs(heading) <= c.heading_tolerance) & (abs(phase) <= c.phase_tolerance)
    side = min(abs(Y), FAR)
    terms = Terms(
        position=-min(distance, FAR),
        heading=-abs(heading),
        side=-math.sqrt(math.sqrt(side * side + _SMOOTH * _SMOOTH)),
        mismatch=-cbrt(math.sqrt(mismatch * mismatch + _SMOOTH * _SMOOTH)),
        parked=select(parked, 1.0, 0.0),
    )
    return aux, terms, dt * p.radius * abs(y.roll_rate), parked, parked


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Constants) -> tuple[float, float]:
    """Position in radii."""
    return limited_pair((y.X / p.radius, y.Y / p.radius), FAR)


@dataclass(frozen=True)
class CoinPark(Rolling):
    """Park an upright coin: position at the origin, heading and roll phase 0.

    Four dimensions, two controls: the coin rolls and is steered, also on the spot, but it cannot
    slip sideways.

    Why it is hard: turning on the spot corrects the heading, and rolling then reaches the position,
    but the final phase follows from the length of the path. To change the phase, the path must have
    another length than the straight one.

    Physics:
        Both rates are set at once, so each step is an arc, exact to $4e-11$ rad, and those of the
        start do not matter. Mass, moments and $g$ have no effect on the motion, as the rates are
        given. $phi$ and $psi$ are within half a turn. Actions of 1 roll by `roll_per_step` and turn
        by `steer_per_step`. On the arc the coin needs the coefficient of friction $radius |phi'
        psi'| / g$; what the jumps of the rates would need is not counted.

        The two control vector fields and their Lie brackets span 2, 3 and 4 dimensions (growth
        vector $(2, 3, 4)$). At the goal steering and rolling are directly controlled, the lateral
        offset $y$ needs the bracket of the two, and the mismatch $x + psi$ between rolled offset
        and phase needs the bracket of that with steering. There is no drift: nothing moves while
        the action is 0.

    Rewards:
        Each direction has the root of the order of the bracket that generates it. With $p = (x, y)$
        the offset in radii and $m = x + psi$ within half a turn, `position` = $-|p|$, `heading` =
        $-|phi|$, `side` = $-sqrt(s)$ and `mismatch` = $-cbrt(t)$: orders 1, 1, 2 and 3, where $s =
        sqrt(y^2 + 0.001^2)$ and $t = sqrt(m^2 + 0.001^2)$ round the roots off at 0. $|p|$, $|x|$
        and $|y|$ are limited to 50 in all of them. `parked` = 1 in the step that parks the coin.

    Starting State:
        Position uniform in the square $|X|, |Y| <= start_half_width$, heading and phase uniform.

    Episode End:
        The episode terminates when the coin is parked: its offset is at most `position_tolerance`,
        its heading at most `heading_tolerance` and its phase, within half a turn, at most
        `phase_tolerance`. That step is the success (`info["is_success"]`).

    Reference:
        `two_rolls` takes two straight rolls by $a$ and $b$ with turns between them, $a u_1 + b u_2
        = D$ and $a + b = 2 pi k - psi$ with $D$ the offset in radii and $u$ the headings.

        Turning while rolling takes fewer steps.

    Source:
        Bloch, *Nonholonomic Mechanics and Control*, section 1.4; Murray & Sastry 1993,
        "Nonholonomic motion planning: steering using sinusoids", IEEE Transactions on Automatic
        Control 38.
    """

    m: Range = physical(1.0, "mass", "kg")
    radius: Range = physical(1.0, "radius of the rim", "m")
    I1: Range = physical(0.25, "moment about a diameter", "kg m^2")
    I3: Range = physical(0.5, "moment about the axis", "kg m^2")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    slope: float = setting(0.0, Number("slope of the plane: level", "rad", 0.0, 0.0))
    roll_per_step: float = setting(
        math.pi / 8, Number("largest roll per control period", "rad", 1e-3, math.pi / 2)
    )
    steer_per_step: float = setting(
        math.pi / 8, Number("largest turn per control period", "rad", 1e-3, math.pi / 2)
    )
    start_half_width: float = setting(2.0, Number("half side of the start square", "m", 0.0, 20.0))
    position_tolerance: float = setting(0.1, Number("largest offset when parked", "m", 1e-6, 10.0))
    heading_tolerance: float = setting(0.1, Number("largest heading when parked", "rad", 1e-6, 3.2))
    phase_tolerance: float = setting(0.15, Number("largest phase when parked", "rad", 1e-6, 3.2))
    weight_position: float = setting(0.01, Number("weight of -|p|", "1", -1e3, 1e3))
    weight_heading: float = setting(0.01, Number("weight of -|phi|", "1", -1e3, 1e3))
    weight_side: float = setting(0.02, Number("weight of -sqrt|y|", "1", -1e3, 1e3))
    weight_mismatch: float = setting(0.02, Number("weight of -cbrt|x + psi|", "1", -1e3, 1e3))
    weight_parked: float = setting(10.0, Number("weight of the step that parks", "1", -1e3, 1e3))

    system_type: ClassVar = UprightCoin
    episode: ClassVar = Episode(
        dynamics=UPRIGHT_COIN,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=clip_to_square,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = COIN_POSE
    cost_unit: ClassVar = "distance rolled [m]"

    @property
    def largest_roll_rate(self) -> float:
        """Roll rate at full action [rad/s]."""
        return self.roll_per_step / self.dt

    @property
    def largest_steer_rate(self) -> float:
        """Steer rate at full action [rad/s]."""
        return self.steer_per_step / self.dt

    def actions(self) -> tuple[Entry, ...]:
        """Roll rate psi' and steer rate phi'."""
        roll, steer = self.largest_roll_rate, self.largest_steer_rate
        return (
            Entry("psi'", "rad/s", "axis", -roll, roll),
            Entry("phi'", "rad/s", "world", -steer, steer),
        )

    def features(self) -> tuple[Entry, ...]:
        """Offset in radii."""
        return tuple(Entry(f"{k} / radius", "1", "world", -FAR, FAR) for k in "XY")

    def largest_rate(self, duration: float) -> float:
        """The larger of the two rates."""
        return max(self.roll_per_step, self.steer_per_step) / self.dt

    def lower_bound(self, y: Array) -> Array:
        """Lower bound on the path length [m]: max(distance, radius * abs(psi)) to the origin."""
        coin = UprightCoin()
        distance = np.hypot(*np.moveaxis(coin.contact(y), -1, 0))
        return np.asarray(np.maximum(distance, span(self.radius)[0] * np.abs(coin.phase(y))))
