"""Keep a disk rolling on a circle."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, attitude, compose
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import atan2, fma, log, select, sincos
from rigid_envs.engine.episode import Episode, clip_to_interval
from rigid_envs.systems.rolling_disk import dynamics as rolling_disk
from rigid_envs.systems.rolling_disk.dynamics import ROLLING_DISK, Input, Parameters, State
from rigid_envs.systems.rolling_disk.symmetry import EXCHANGE, PHASE, REFLECTION, TURN
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.parts import held_for, limited
from rigid_envs.tasks.reduction import Reduction, Side, turn_one
from rigid_envs.tasks.symmetry import TRANSLATION
from rigid_envs.tasks.task import AuxiliaryRanges, Rolling

# Common functions of the rolling-disk tasks: rolling variables and bounds on rates.

TIGHT = 10.0  # bound of observed curvature times radius
_STEPS = 200  # number of steps in cos(theta) for the integration of rates


class RollingMotion(NamedTuple):
    """Lean, its rate, turn rate wn and roll rate w3 [rad/s], path curvature times radius."""

    sin_lean: float
    cos_lean: float
    lean_rate: float
    turn_rate: float
    roll_rate: float
    curvature: float


@scalar
def rolling(y: State) -> RollingMotion:
    """Rolling variables of a state.

    The path of the contact turns at phi' = wn / cos(lean), and its speed is the radius times psi' =
    w3 + wn tan(lean). (The lean is theta - pi / 2.)
    """
    n1, n2, s, c = rolling_disk.inclination(attitude(y))
    wn, wl = fma(n1, y.omega1, n2 * y.omega2), fma(n1, y.omega2, -n2 * y.omega1)
    psi_rate = y.omega3 - wn * c / s
    curvature = wn / s * psi_rate / max(psi_rate * psi_rate, 1e-9)
    return RollingMotion(
        sin_lean=-c,
        cos_lean=s,
        lean_rate=-wl,
        turn_rate=wn,
        roll_rate=y.omega3,
        curvature=min(max(curvature, -TIGHT), TIGHT),
    )


def threshold(mgr: float, I1: float, I3: float, rim: float) -> float:
    """Roll rate [rad/s] above which upright rolling is stable.

    ``I3 (I3 + m r^2) w3^2 = I1 m g r``: w3^2 = g / (3 r) for a disk, g / (4 r) for a hoop.

    Args:
        mgr: m g radius [N m].
        I1: moment about a diameter [kg m^2].
        I3: moment about the axis [kg m^2].
        rim: m radius^2 [kg m^2].

    Source: Routh, *Advanced Rigid Dynamics*, section 244.
    """
    return math.sqrt(mgr * I1 / (I3 * (I3 + rim)))


def fastest_disk(
    parameters: tuple[Range, Range, Range, Range, Range], speed: float, turn: float, torque: float
) -> float:
    """Bound on the rate [rad/s] until the lean is 60 degrees, as in `RollingDisk.rate_and_growth`.

    Under any lean torque, wn and w3 depend on theta alone. With c = cos(theta), ``d(wn
    sin(theta))/dc = -(I3 / I1) w3`` and ``dw3/dc = -m r^2 / (I3 + m r^2) wn / sin(theta)``: both
    are integrated from upright in the sense in which both grow. The remaining energy, plus the work
    of the torque over 120 degrees, bounds the lean rate.

    Args:
        parameters: m, radius, I1, I3 and g, numbers or ranges.
        speed: largest w3 at the start / `threshold`.
        turn: largest wn and wl at the start [rad/s].
        torque: largest lean torque [N m].

    Source: Routh, *Advanced Rigid Dynamics*, section 244.
    """
    low = [span(value)[0] for value in parameters]
    m, radius, I1, I3, g = (span(value)[1] for value in parameters)
    rim, least = m * radius**2, low[0] * low[1] ** 2
    w3 = speed * threshold(m * g * radius, I1, low[3], least)
    across, h = turn, 0.5 * math.sqrt(3.0) / _STEPS
    for k in range(1, _STEPS + 1):
        sine = math.sqrt(1.0 - (h * k) ** 2)
        w3 += h * rim / (low[3] + rim) * across / sine**2
        across += h * I3 / low[2] * w3
    wn = across / sine
    energy = m * g * radius + I1 * wn**2 + (I3 + rim) * w3**2 + 8.0 * math.pi / 6.0 * torque
    wl = math.sqrt(energy / (low[2] + least) + turn**2)
    return w3 + math.sqrt(wn**2 + wl**2) / sine + math.sqrt(g / low[1])


# Reduced coordinates of a rolling disk and the circle that it is to roll on.

_FAST = 50.0  # rad/s; bound of the observed rates
_LEAN = 1.6  # rad
_WRONG = 20.0  # bound of the relative error
_LOG = 17.0  # bound of its logarithm
_GYRO = 20.0  # rad^2/s^2; bound of the gyroscopic moment
# I3 / I1 and m r^2 / (I3 + m r^2) of a uniform disk: those of the wheel may be drawn and hidden
_RATIO, _RIM_RATIO = 2.0, 2.0 / 3.0
_NEAR = 0.03  # rad; limit of the lean that is missing, on its finer scale


@scalar
def side(aux: Any) -> float:
    """-1 where the commanded circle is on the right, else 1."""
    return select(aux.goal_curvature < 0.0, -1.0, 1.0)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Lean, rates and errors from steady rolling, on a circle to the left and forwards.

    Without steering torque wn and w3 follow the lean; see `DiskRoll`. One step of Newton's method
    leads to the lean at which the curvature is the commanded one, and to wn and w3 there.
    """
    motion = rolling(y)
    mirrored = side(aux)
    turned = mirrored * select(motion.roll_rate < 0.0, -1.0, 1.0)
    lean = mirrored * atan2(motion.sin_lean, motion.cos_lean)
    wn, w3 = turned * motion.turn_rate, abs(motion.roll_rate)
    k, goal = mirrored * motion.curvature, mirrored * aux.goal_curvature
    inverse = 1.0 / motion.cos_lean
    tan = mirrored * motion.sin_lean * inverse
    spin = fma(wn, tan, w3)  # psi'
    wn_slope, w3_slope = fma(_RATIO, w3, wn * tan), _RIM_RATIO * wn
    spin_slope = w3_slope + wn_slope * tan + wn * inverse * inverse
    k_slope = (wn_slope * inverse - k * spin_slope) / max(spin, 0.1) + k * tan
    missing = min(max((goal - k) / max(k_slope, 0.5), -0.5), 0.5)
    wrong = (k - goal) / goal
    size = log(1.0 + min(abs(wrong), _WRONG) / c.tolerance)
    steady = (wn + wn_slope * missing) * (w3 + w3_slope * missing)
    return (
        lean,
        min(max(mirrored * motion.lean_rate, -_FAST), _FAST),
        min(max(wn, -_FAST), _FAST),
        min(w3, _FAST),
        k,
        goal,
        min(max(wrong, -_WRONG), _WRONG),
        select(wrong < 0.0, -size, size),
        missing,
        min(max(missing * (1.0 / _NEAR), -1.0), 1.0),
        lean + missing,
        min(max(steady, -_GYRO), _GYRO),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Side:
    """The side on which the commanded circle is."""
    return Side(side(aux))


CIRCLE = Reduction(
    group="E(2) x O(2) x Z2",
    frame=(
        "mirrored so that the commanded circle is on the left, and seen so that the disk rolls "
        "forwards."
    ),
    symmetries=(TRANSLATION, TURN, PHASE, REFLECTION, EXCHANGE),
    features=(
        Entry("lean", "rad", "goal on the left", -_LEAN, _LEAN),
        Entry("theta'", "rad/s", "goal on the left", -_FAST, _FAST),
        Entry("wn", "rad/s", "goal on the left, forwards", -_FAST, _FAST),
        Entry("w3", "rad/s", "forwards", 0.0, _FAST),
        Entry("curvature * radius", "1", "goal on the left", -TIGHT, TIGHT),
        Entry("goal curvature * radius", "1", "goal on the left", 0.0, 2.0),
        Entry("relative error e", "1", "of the curvature", -_WRONG, _WRONG),
        Entry("log(1 + e / tolerance)", "1", "with the sign of e", -_LOG, _LOG),
        Entry("missing lean", "rad", "uniform disk", -0.5, 0.5),
        Entry("missing lean", "1", f"uniform disk, in {_NEAR:g} rad, limited", -1.0, 1.0),
        Entry("steady lean", "rad", "uniform disk", -_LEAN - 0.5, _LEAN + 0.5),
        Entry("steady wn w3", "rad^2/s^2", "uniform disk", -_GYRO, _GYRO),
    ),
    observe=observe_reduced,
    Frame=Side,
    frame_of=frame_of,
    turn=turn_one,
    formulas="""
        With the sign $s$ of the commanded curvature, and $t = s$ times the sign of $w3$: lean,
        $theta'$, both curvatures and the action are multiplied by $s$, $w_n$ and $w3$ by $t$. Of
        what is multiplied, with lean $x$, curvature $k$ and its goal $k*$: $e = (k - k*) / k*$, and
        the logarithm is that of $|e| <= 20$.

        With $a = 2 w3 + w_n tan x$ and $b = 2 w_n / 3$, the changes of $w_n$ and $w3$ with the lean
        of a uniform disk, $psi' = w3 + w_n tan x$, and $c = (a / cos x - k (b + a tan x + w_n /
        cos^2 x)) / max(psi', 0.1) + k tan x$: the missing lean is $d = (k* - k) / max(c, 0.5)$
        within $+-0.5$, the steady lean $x + d$, and the steady $w_n w3$ $(w_n + a d) (w3 + b d)$.
    """,
)
"""Reduction of `DiskRoll`: motions of the plane, turns of the disk, two reflections."""


# Keep a slow disk rolling on a commanded circle.

_FALLEN = 0.5 * math.sqrt(3.0)  # sine of a lean of 60 degrees


class Action(NamedTuple):
    """Torque about the direction of travel, as a fraction of the maximum."""

    tau_lean: float


class Terms(NamedTuple):
    """Reward terms of `DiskRoll`."""

    circle: float
    upright: float
    effort: float


class Constants(NamedTuple):
    """Torque [N m], success (relative error, time [s]), circles, start (lean [rad], rates).

    Curvatures are those times the radius; `start_rate` is in rad/s, `start_speed` and
    `start_spread` are fractions of the threshold.
    """

    torque: float
    tolerance: float
    hold: float
    goal_curvature: float
    goal_spread: float
    start_lean: float
    start_rate: float
    start_speed: float
    start_spread: float


class Auxiliary(NamedTuple):
    """Control periods for which the error has been small; commanded curvature times radius."""

    held: float = 0.0
    goal_curvature: float = 1.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """Near upright, below the speed of stable rolling; commanded curvature uniform."""
    lean = c.start_lean * (2.0 * randoms.uniform(stream, 0) - 1.0)
    wn = c.start_rate * (2.0 * randoms.uniform(stream, 1) - 1.0)
    wl = c.start_rate * (2.0 * randoms.uniform(stream, 2) - 1.0)
    share = fma(c.start_spread, randoms.uniform(stream, 3), c.start_speed)
    w3 = share * math.sqrt(p.m * p.g * p.radius * p.I1 / (p.I3 * p.I3_contact))
    side = select(randoms.uniform(stream, 4) < 0.5, -1.0, 1.0)
    goal = side * fma(c.goal_spread, randoms.uniform(stream, 5), c.goal_curvature)
    heading, phase = randoms.direction(stream, 1 << 20), randoms.direction(stream, 1 << 21)
    sine, cosine = sincos(0.25 * math.pi + 0.5 * lean)
    turned = compose((heading[0], 0.0, 0.0, heading[1]), (cosine, sine, 0.0, 0.0))
    q = compose(turned, (phase[0], 0.0, 0.0, phase[1]))
    n1, n2 = 2.0 * phase[0] * phase[1], phase[0] * phase[0] - phase[1] * phase[1]
    omega, contact = (fma(n1, wn, -n2 * wl), fma(n2, wn, n1 * wl), w3), (0.0, 0.0)
    return State(*q, *omega, *contact), Auxiliary(held=0.0, goal_curvature=goal)


@scalar
def actuate(
    a: Action, y: State, aux: Auxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Torque about the direction of travel."""
    return y, Input(tau_steer=0.0, tau_lean=c.torque * a.tau_lean, tau_drive=0.0)


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Reward terms, torque impulse as cost, success after the hold time, end at a fall."""
    motion = rolling(y)
    wrong = abs(motion.curvature - aux.goal_curvature) / abs(aux.goal_curvature)
    held, success = held_for(wrong <= c.tolerance, aux, c, dt)
    fallen = abs(motion.sin_lean) > _FALLEN
    effort = u.tau_lean / c.torque
    success = success & (abs(motion.sin_lean) <= _FALLEN)
    terms = Terms(
        circle=1.0 / (1.0 + 10.0 * wrong), upright=motion.cos_lean, effort=-effort * effort
    )
    return Auxiliary(held, aux.goal_curvature), terms, dt * abs(u.tau_lean), success, fallen


@scalar
def observe(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> Row:
    """Lean and its rate, turn and roll rate, actual and commanded curvature."""
    motion = rolling(y)
    return (
        atan2(motion.sin_lean, motion.cos_lean),
        *limited((motion.lean_rate, motion.turn_rate, motion.roll_rate), _FAST),
        motion.curvature,
        aux.goal_curvature,
    )


@dataclass(frozen=True)
class DiskRoll(Rolling):
    """Keep a disk rolling below its stable speed, on a circle of commanded curvature.

    A disk rolls at 0.5 to 0.95 of the speed above which upright rolling is stable. It is to roll on
    a circle whose curvature is drawn in every episode; the centre of the circle is free. The only
    control is a torque about the direction of travel.

    Why it is hard: the torque does not act on turn rate and roll rate; both follow from the lean,
    as for a bicycle that is steered by leaning. So the disk must reach the lean of the commanded
    circle and hold it against gravity.

    Physics:
        With the turn rate $w_n$ about the radius that points up, the roll rate $w3$ about the axis
        and $theta = pi / 2 + lean$, $d(w_n sin(theta)) = (I3 / I1) w3 sin(theta) dtheta$ and $dw3 =
        m r^2 / (I3 + m r^2) w_n dtheta$ under any lean torque. Without torque the energy is
        conserved.

        Upright rolling is stable where $I3 (I3 + m r^2) w3^2 > I1 m g r$: a disk above $w3^2 = g /
        (3 r)$, a hoop above $g / (4 r)$. Below, a small lean grows, and without control the disk
        falls or reels.

        $theta$ is the angle between $e3$ and the vertical $e_z$, $n = (e_z - cos(theta) e3) /
        sin(theta)$ and $l = e3 x n$; so $w_n = n . omega$, $theta' = -l . omega$, $w3 = e3 .
        omega$. The contact moves along $l$ at $r psi'$, $psi' = w3 + w_n tan(lean)$, and its path
        turns at $phi' = w_n / cos(lean)$. Its curvature times the radius is $phi' psi' /
        max(psi'^2, 1e-9)$, limited to $+-10$: positive where the centre of the circle is to the
        left of $l$, and 0 where the disk spins on the spot.

    Rewards:
        `circle` = $1 / (1 + 10 e)$ with $e$ the relative error of the curvature of the contact's
        path, $e = |k - k*| / |k*|$ with the commanded $k*$, `upright` = $cos(lean)$, the reward for
        not falling, and `effort` = $-(tau / torque)^2$.

    Starting State:
        Lean uniform within `start_lean`, turn rate and lean rate each within `start_rate`, the roll
        rate between `start_speed` and `start_speed` + `start_spread` of the threshold. The
        commanded curvature times radius has either sign and a magnitude between `goal_curvature`
        and `goal_curvature` + `goal_spread`. Heading and phase are uniform, and
        the contact is at the origin.

    Episode End:
        Success (`info["is_success"]`): $e$ has been at most `tolerance` throughout the last `hold`
        seconds, and the disk has not fallen. The episode terminates when the disk has fallen, at a
        lean of more than 60 degrees.

    Reference:
        `lqr` is the linear-quadratic regulator of the lean about steady rolling on the commanded
        circle, with the torque of steady rolling as feedforward.

    Source:
        Routh, *Advanced Rigid Dynamics*, section 244; O'Reilly 1996, "The dynamics of rolling disks
        and sliding disks", doi:10.1007/BF01833295.
    """

    dt: float = 0.05
    n_substeps: int = 3
    m: Range = physical(1.0, "mass", "kg")
    radius: Range = physical(1.0, "radius of the rim", "m")
    I1: Range = physical(0.25, "moment about a diameter", "kg m^2")
    I3: Range = physical(0.5, "moment about the axis", "kg m^2")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    torque: float = setting(3.0, Number("largest lean torque", "N m", 1e-6, 1e6))
    goal_curvature: float = setting(0.1, Number("least curvature * radius", "1", 1e-3, 1.0))
    goal_spread: float = setting(0.15, Number("curvatures above the least", "1", 0.0, 1.0))
    start_lean: float = setting(0.1, Number("largest lean at the start", "rad", 0.0, 1.0))
    start_rate: float = setting(0.1, Number("largest turn and lean rate", "rad/s", 0.0, 1e3))
    start_speed: float = setting(0.5, Number("least roll rate / threshold", "1", 1e-3, 10.0))
    start_spread: float = setting(0.45, Number("roll rates above the least", "1", 0.0, 10.0))
    tolerance: float = setting(0.05, Number("largest relative error of a success", "1", 1e-6, 1.0))
    hold: float = setting(5.0, Number("time within tolerance", "s", 0.0, 1e4))
    weight_circle: float = setting(0.5, Number("weight of the circle term", "1", -1e3, 1e3))
    weight_upright: float = setting(0.5, Number("weight of the upright term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    system_type: ClassVar = RollingDisk
    episode: ClassVar = Episode(
        dynamics=ROLLING_DISK,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        start=start,
        clip=clip_to_interval,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = CIRCLE
    counters: ClassVar = ("held",)
    cost_unit: ClassVar = "torque impulse [N m s]"

    def actions(self) -> tuple[Entry, ...]:
        """Torque about the direction of travel."""
        return (Entry("tau_lean", "N m", "direction of travel", -self.torque, self.torque),)

    def features(self) -> tuple[Entry, ...]:
        """Lean and its rate, turn and roll rate, actual and commanded curvature."""
        return (
            Entry("lean", "rad", "theta - pi / 2", -0.5 * math.pi, 0.5 * math.pi),
            Entry("theta'", "rad/s", "direction of travel", -_FAST, _FAST),
            Entry("wn", "rad/s", "radius that points up", -_FAST, _FAST),
            Entry("w3", "rad/s", "axis", -_FAST, _FAST),
            Entry("curvature * radius", "1", "path of the contact", -TIGHT, TIGHT),
            Entry("goal curvature * radius", "1", "path of the contact", -2.0, 2.0),
        )

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """Commanded curvatures of a start, of either sign."""
        sizes = (self.goal_curvature, self.goal_curvature + self.goal_spread)
        return {**super().auxiliary_ranges(p, elapsed), ("goal_curvature",): sizes}

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates from the fastest start until the disk has fallen."""
        parameters = (self.m, self.radius, self.I1, self.I3, self.g)
        speed = self.start_speed + self.start_spread
        return fastest_disk(parameters, speed, self.start_rate, self.torque)


@dataclass(frozen=True)
class DiskRollRandom(DiskRoll):
    """Keep a wheel with random parameters rolling on a circle of commanded curvature.

    `DiskRoll` with mass, radius and moments that are drawn and not observed, from flat wheels ($I3
    = 2 I1$, the largest ratio of a rigid body) to thick ones. The threshold is 0.53 to 0.72 $sqrt(g
    / r)$, and the torque that holds a lean varies by a factor of 1.5. The actual curvature is
    observed, so a policy can hold the circle without the parameters; `observe_params` adds them to
    the observation.

    Reference:
        The regulator of `DiskRoll` for the middle of the ranges, without the drawn parameters.

        Exact: the threshold $I3 (I3 + m r^2) w3^2 = I1 m g r$ of each wheel.
    """

    n_substeps: int = 4
    m: Range = (0.85, 1.15)
    radius: Range = (0.95, 1.05)
    I1: Range = (0.3, 0.36)
    I3: Range = (0.5, 0.6)
