"""Roll a ball with inertia to a pose."""

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Quaternion, Row, attitude, compose
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import cbrt, fma, select, sincos
from rigid_envs.engine.episode import Episode, NoAuxiliary, clip_to_disk
from rigid_envs.systems.dynamic_ball.dynamics import (
    DYNAMIC_BALL,
    LEVEL,
    Input,
    Parameters,
    State,
    level_step,
)
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.rolling_ball.symmetry import REFLECTION, TURN
from rigid_envs.systems.rolling_ball.tasks import ball_park
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.parts import limited_pair
from rigid_envs.tasks.reduction import Frame, Reduction, polar_seen, turn
from rigid_envs.tasks.task import Rolling

# Reduced coordinates of `BallParkDynamic`: velocity, and the pose in which the ball can stop.

_FAST = 50.0  # radii per second; bound of the observed velocity


@scalar
def _stopped(y: Any, p: Any, c: Any) -> tuple[float, float, Quaternion]:
    """Offset [radii] and attitude of the ball after it has braked along a straight line.

    From the speed v it rolls on by v^2 / 2 a, with the deceleration a of the largest force.
    """
    VX, VY = y.VX * p.inverse_radius, y.VY * p.inverse_radius
    speed = math.sqrt(fma(VX, VX, VY * VY))
    far = 0.5 * speed * p.radius / c.deceleration  # of the velocity: the time of braking, halved
    half_sine, cosine = sincos(0.5 * far * speed)
    s = half_sine / max(speed, 1e-12)
    rolled = (cosine, -s * VY, s * VX, 0.0)
    X, Y = fma(far, VX, y.X * p.inverse_radius), fma(far, VY, y.Y * p.inverse_radius)
    return X, Y, compose(rolled, attitude(y))


@scalar
def _frame(X: float, Y: float, q: Quaternion, p: Any) -> Frame:
    """That of the pose in which the ball stops; not mirrored on a turntable, which has a sense."""
    frame = ball_park.pose_frame(X, Y, q)
    return Frame(frame.cosine, frame.sine, select(p.turntable_rate == 0.0, frame.side, 1.0))


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The pose after braking, as `BallPark` shows a pose; present offset and velocity."""
    X, Y, q = _stopped(y, p, c)
    frame = _frame(X, Y, q, p)
    offset = polar_seen(frame, y.X * p.inverse_radius, y.Y * p.inverse_radius)
    fast, across = polar_seen(frame, y.VX * p.inverse_radius, y.VY * p.inverse_radius)
    return (
        *ball_park.pose_seen(frame, X, Y, q),
        *limited_pair(offset, ball_park.FAR),
        *limited_pair((fast, across), _FAST),
        min(math.sqrt(fma(fast, fast, across * across)), _FAST),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame of the pose after braking."""
    X, Y, q = _stopped(y, p, c)
    return _frame(X, Y, q, p)


DYNAMIC_POSE = Reduction(
    group="O(2)",
    frame=(
        "that of `BallPark` for the pose in which the ball stops if it brakes at once; on a "
        "turntable it is not mirrored."
    ),
    symmetries=(TURN, REFLECTION),
    features=(
        *ball_park.POSE,
        *(Entry(f"{k} / radius", "1", "reduced", -ball_park.FAR, ball_park.FAR) for k in "XY"),
        *(Entry(f"V{k} / radius", "1/s", "reduced", -_FAST, _FAST) for k in "XY"),
        Entry("abs V / radius", "1/s", "", 0.0, _FAST),
    ),
    observe=observe_reduced,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        The ball would roll on by $d = |V| V / (2 a)$, $a = F / (m (1 + beta))$ with the largest
        force $F$. Frame, the entries 0 to 8 and the action are those of `BallPark` for the offset
        $(X, Y) + d$ and the attitude after the rotation by $|d| / radius$ about $e_z x d$, also on
        a turntable; there the side $k$ is 1, and $theta_z$ from $-pi$. The other entries are the
        present offset and velocity, seen as horizontal vectors, and the speed, each within its
        bounds.
    """,
)
"""Reduction of `BallParkDynamic`; the first entries are those of the pose after braking."""


# Park a ball that has inertia and is driven by a force: it must come to rest at the goal.


class Action(NamedTuple):
    """Force at the centre, as a fraction of the maximum."""

    FX: float
    FY: float


class Terms(NamedTuple):
    """Reward terms of `BallParkDynamic`."""

    position: float
    twist: float
    mismatch: float
    angle: float
    parked: float
    off: float


class Constants(NamedTuple):
    """Largest force [N], tolerances [m, rad, m/s], start square, edge [m], deceleration [m/s^2]."""

    force: float
    position_tolerance: float
    angle_tolerance: float
    speed_tolerance: float
    start_half_width: float
    edge: float
    deceleration: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """At rest: position uniform in a square, attitude uniform on SO(3)."""
    half = c.start_half_width
    X = half * (2.0 * randoms.uniform(stream, 0) - 1.0)
    Y = half * (2.0 * randoms.uniform(stream, 1) - 1.0)
    q = randoms.quaternion(stream, 2)
    return State(*q, X, Y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), ()


@scalar
def actuate(
    a: Action, y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Horizontal force at the centre; the plate stays level."""
    return y, Input(c.force * a.FX, c.force * a.FY, 0.0, 0.0)


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """The terms of `BallPark`; parking requires rest, and the plate ends at the edge."""
    distance, twist, mismatch, angle = ball_park.misplacement(y, p.inverse_radius)
    speed = math.sqrt(y.VX * y.VX + y.VY * y.VY)
    there = (distance * p.radius <= c.position_tolerance) & (angle <= c.angle_tolerance)
    parked = there & (speed <= c.speed_tolerance)
    off = distance * p.radius > c.edge
    terms = Terms(
        position=-min(distance, ball_park.FAR),
        twist=-twist,
        mismatch=-cbrt(min(mismatch, ball_park.FAR)),
        angle=-angle,
        parked=select(parked, 1.0, 0.0),
        off=select(off, -1.0, 0.0),
    )
    impulse = dt * math.sqrt(u.FX * u.FX + u.FY * u.FY)
    return aux, terms, impulse, parked, parked | off


@scalar
def observe(
    y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[float, float, float, float]:
    """Position in radii, velocity in radii per second."""
    velocity = y.VX * p.inverse_radius, y.VY * p.inverse_radius
    return (*ball_park.offset(y, p), *limited_pair(velocity, _FAST))


def speed_bound(push: float, reach: float, gyration: float = 0.0) -> float:
    """Upper bound on the speed [m/s] of a ball that starts from rest inside a disk.

    Where |r| <= D and |a| <= a_max, ``d(r . v)/dt = v^2 + r . v' >= v^2 - a_max D - kappa D v``: a
    fast ball soon leaves the disk. In units of D and a_max, with w = v - kappa, it takes at least
    the time w - 1 to accelerate from w = 1 on, and ``(w^3 - 1) / 3 - (w - 1) <= w + 1 + 2 kappa``
    follows.

    Args:
        push: largest acceleration that does not depend on the velocity [m/s^2].
        reach: radius D of the disk [m].
        gyration: rate kappa at which the velocity also turns [rad/s].
    """
    return 2.6 * math.sqrt(push * reach) + 1.5 * abs(gyration) * reach


@dataclass(frozen=True)
class DynamicBallTask(Rolling):
    """A task of a ball that has inertia."""

    m: Range = physical(1.0, "mass", "kg")
    radius: Range = physical(1.0, "radius of the ball", "m")
    beta: Range = setting(
        0.4, Number("inertia ratio I / (m radius^2)", "1", 1e-3, 2.0 / 3.0, drawn=True)
    )
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    turntable_rate: Range = setting(
        0.0, Number("rate of the surface about its normal", "rad/s", -10.0, 10.0, drawn=True)
    )

    system_type: ClassVar = DynamicBall


@dataclass(frozen=True)
class BallParkDynamic(DynamicBallTask):
    """Park a ball that has inertia: a force drives it, and it must come to rest at the goal.

    A horizontal force at the centre rolls the ball on a level plate without slipping. Position and
    attitude follow from the velocity as in `BallPark`: five dimensions, reached by manoeuvres only.
    The velocity adds two dimensions of drift, which must be brought to zero.

    Why it is hard: every curve takes force, every error persists until the ball is braked, and the
    goal counts only at rest. The plate ends `margin` outside the corners of the start square.

    Physics:
        The rotational inertia adds to the mass, $m (1 + beta) v' = F$, so that a solid sphere
        accelerates at 5/7 of $F / m$. Without force it rolls on along a straight line: its
        velocity, its energy and its spin about the vertical, which is 0, are conserved. On a level
        plate $g$ has no effect on the motion, which needs the coefficient of friction $beta / (1 +
        beta) |F| / (m g)$. On a turntable (`turntable_rate` $Omega$) the velocity also turns, at
        the rate $beta / (1 + beta) Omega$.

        The attitude follows by rolling: growth vector $(2, 3, 5)$ of the velocity fields, with one
        integrator between force and velocity.

    Rewards:
        The cost of `BallPark`, with the orders of the Lie brackets: its terms `position`, `twist`,
        `mismatch` and `angle`, whose default weight is 0. `parked` = 1 in the step that parks the
        ball, and `off` = -1 in the step that leaves the plate, which costs more than resting
        anywhere on it for the whole episode.

    Starting State:
        At rest: position uniform in the square $|X|, |Y| <= start_half_width$, attitude uniform on
        SO(3). The plate is level: tilt and its rate are 0, and no others are taken.

    Episode End:
        The episode terminates when the ball is parked: its offset is at most `position_tolerance`,
        the angle of its attitude at most `angle_tolerance` and its speed at most `speed_tolerance`.
        That step is the success (`info["is_success"]`). It also terminates when the ball leaves the
        plate: its distance from the origin is more than $sqrt(2) start_half_width + margin$, which
        is `margin` beyond the corners of the start square.

    Reference:
        `three_rolls` plans three straight rolls, each with full force forward and then backward
        during whole control periods. It tracks them by $F = m (1 + beta) (a + k^2 (position - X) +
        2 k (velocity - V))$ with $k = 2 / s$.

        The length of the bound is $max(distance, radius angle)$, as for `BallPark`. The ball need
        not stop at the corners of its path, as it does with `three_rolls`.

    Source:
        Neimark & Fufaev, *Dynamics of Nonholonomic Systems*, chapter III; Jurdjevic 1993, "The
        geometry of the plate-ball problem", doi:10.1007/BF00375605; three rolls: Hammersley 1983,
        "Oxford commemoration ball", LMS Lecture Notes 79.
    """

    dt: float = 0.2
    n_substeps: int = 6
    force: float = setting(4.0, Number("largest force at the centre", "N", 1e-6, 1e6))
    start_half_width: float = setting(2.0, Number("half side of the start square", "m", 0.0, 20.0))
    margin: float = setting(7.0, Number("plate beyond the start square's corners", "m", 0.1, 1e3))
    position_tolerance: float = setting(0.1, Number("largest offset when parked", "m", 1e-6, 10.0))
    angle_tolerance: float = setting(0.15, Number("largest angle when parked", "rad", 1e-6, 3.2))
    speed_tolerance: float = setting(0.05, Number("largest speed when parked", "m/s", 1e-6, 10.0))
    weight_position: float = setting(0.01, Number("weight of -|p|", "1", -1e3, 1e3))
    weight_twist: float = setting(0.02, Number("weight of -sqrt|theta_z|", "1", -1e3, 1e3))
    weight_mismatch: float = setting(0.02, Number("weight of -cbrt|m|", "1", -1e3, 1e3))
    weight_angle: float = setting(0.0, Number("weight of -|theta|", "1", -1e3, 1e3))
    weight_parked: float = setting(10.0, Number("weight of the step that parks", "1", -1e3, 1e3))
    weight_off: float = setting(20.0, Number("weight of leaving the plate", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=DYNAMIC_BALL,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=clip_to_disk,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
        advance=level_step,
        contact=LEVEL,
    )
    reduction: ClassVar = DYNAMIC_POSE
    cost_unit: ClassVar = "impulse of the force [N s]"
    fixed_components: ClassVar = ("tilt", "tilt_rate")

    @property
    def edge(self) -> float:
        """Radius of the plate [m]."""
        return math.sqrt(2.0) * self.start_half_width + self.margin

    @property
    def deceleration(self) -> float:
        """Deceleration by the largest force, for the middle of the ranges of m and beta [m/s^2]."""
        return self.force / (sum(span(self.m)) / 2 * (1.0 + sum(span(self.beta)) / 2))

    def actions(self) -> tuple[Entry, ...]:
        """Horizontal force, in a disk."""
        return tuple(Entry(f"F{k}", "N", "world, disk", -self.force, self.force) for k in "XY")

    def features(self) -> tuple[Entry, ...]:
        """Offset in radii, velocity in radii per second."""
        return (
            *ball_park.OFFSET,
            *(Entry(f"V{k} / radius", "1/s", "world", -_FAST, _FAST) for k in "XY"),
        )

    def observations(self) -> tuple[Entry, ...]:
        """Those of the frame; on a turntable, which is not mirrored, theta_z has both signs."""
        entries = super().observations()
        if self.reduced is None or span(self.turntable_rate) == (0.0, 0.0):
            return entries
        return tuple(
            replace(entry, low=-entry.high) if entry.symbol == "theta_z" else entry
            for entry in entries
        )

    def largest_rate(self, duration: float) -> float:
        """Rolling rate at the bound on the speed on this plate."""
        beta, turntable = span(self.beta), max(abs(rate) for rate in span(self.turntable_rate))
        push = self.force / (span(self.m)[0] * (1.0 + beta[0]))
        gyration = turntable * beta[1] / (1.0 + beta[1])
        speed = speed_bound(push, self.edge, gyration) + push * self.dt
        return (speed + turntable * self.edge) / span(self.radius)[0]
