"""Keep a slow disk rolling on a commanded circle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from rigid_envs.kernels import randoms
from rigid_envs.kernels.actions import clip_to_interval
from rigid_envs.kernels.algebra import Row, compose
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import atan2, fma, select, sincos
from rigid_envs.kernels.episode import Episode
from rigid_envs.kernels.rolling_disk import ROLLING_DISK, Input, Parameters, State
from rigid_envs.systems import RollingDisk
from rigid_envs.tasks.base import Array, AuxiliaryRanges, Entry
from rigid_envs.tasks.disks import TIGHT, fastest_disk, rolling
from rigid_envs.tasks.fields import Integer, Number, Range, physical, setting
from rigid_envs.tasks.ground import Rolling
from rigid_envs.tasks.reduced.disk_roll import CIRCLE

__all__ = ["DiskRoll", "DiskRollRandom"]

_FAST = 50.0  # rad/s; bound of the observed rates
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
    held = select(wrong <= c.tolerance, aux.held + 1.0, 0.0)
    fallen = abs(motion.sin_lean) > _FALLEN
    effort = u.tau_lean / c.torque
    success = (held * dt >= c.hold * (1.0 - 1e-9)) & (abs(motion.sin_lean) <= _FALLEN)
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
        min(max(motion.lean_rate, -_FAST), _FAST),
        min(max(motion.turn_rate, -_FAST), _FAST),
        min(max(motion.roll_rate, -_FAST), _FAST),
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
        With the turn rate wn about the radius that points up, the roll rate w3 about the axis and
        theta = pi / 2 + lean, ``d(wn sin(theta)) = (I3 / I1) w3 sin(theta) dtheta`` and ``dw3 = m
        r^2 / (I3 + m r^2) wn dtheta`` under any lean torque. Without torque the energy is
        conserved.

        Upright rolling is stable where ``I3 (I3 + m r^2) w3^2 > I1 m g r``: a disk above ``w3^2 = g
        / (3 r)``, a hoop above ``g / (4 r)``. Below, a small lean grows, and without control the
        disk falls or reels.

        theta is the angle between e3 and the vertical e_z, n = (e_z - cos(theta) e3) / sin(theta)
        and l = e3 x n; so ``wn = n . omega``, ``theta' = -l . omega``, ``w3 = e3 . omega``. The
        contact moves along l at r psi', ``psi' = w3 + wn tan(lean)``, and its path turns at ``phi'
        = wn / cos(lean)``. Its curvature times the radius is ``phi' psi' / max(psi'^2, 1e-9)``,
        limited to +-10: positive where the centre of the circle is to the left of l, and 0 where
        the disk spins on the spot.

    Rewards:
        ``circle`` = ``1 / (1 + 10 e)`` with e the relative error of the curvature of the contact's
        path, ``e = |k - k*| / |k*|`` with the commanded k*, ``upright`` = ``cos(lean)``, the reward
        for not falling, and ``effort`` = ``-(tau / torque)^2``.

    Starting State:
        Lean uniform within `start_lean`, turn rate and lean rate each within `start_rate`, the roll
        rate between `start_speed` and `start_speed` + `start_spread` of the threshold. The
        commanded curvature times radius has either sign and a magnitude between `goal_curvature`
        and `goal_curvature` + `goal_spread`. Heading and phase are uniform, and
        the contact is at the origin.

    Episode End:
        Success (`info["is_success"]`): e has been at most `tolerance` throughout the last `hold`
        seconds, and the disk has not fallen. The episode terminates when the disk has fallen, at a
        lean of more than 60 degrees.

    Reference:
        `lqr` is the linear-quadratic regulator of the lean about steady rolling on the commanded
        circle, with the torque of steady rolling as feedforward.

    Version History:
        v0: first version.

    Source:
        Routh, *Advanced Rigid Dynamics*, section 244; O'Reilly 1996, "The dynamics of rolling disks
        and sliding disks", doi:10.1007/BF01833295.
    """

    dt: float = setting(0.05, Number("control period", "s", 1e-4, 1.0))
    n_substeps: int = setting(3, Integer("integrator steps per control period", 1, 1000))
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

    `DiskRoll` with mass, radius and moments that are drawn and not observed, from flat wheels (I3 =
    2 I1, the largest ratio of a rigid body) to thick ones. The threshold is 0.53 to 0.72 sqrt(g /
    r), and the torque that holds a lean varies by a factor of 1.5. The actual curvature is
    observed, so a policy can hold the circle without the parameters; `observe_params` adds them to
    the observation.

    Reference:
        The regulator of `DiskRoll` for the middle of the ranges, without the drawn parameters.

        Exact: the threshold ``I3 (I3 + m r^2) w3^2 = I1 m g r`` of each wheel.
    """

    n_substeps: int = setting(4, Integer("integrator steps per control period", 1, 1000))
    m: Range = physical((0.85, 1.15), "mass", "kg")
    radius: Range = physical((0.95, 1.05), "radius of the rim", "m")
    I1: Range = physical((0.3, 0.36), "moment about a diameter", "kg m^2")
    I3: Range = physical((0.5, 0.6), "moment about the axis", "kg m^2")
