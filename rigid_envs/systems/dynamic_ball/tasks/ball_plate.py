"""Hold a ball on a plate by tilting it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, log, select
from rigid_envs.engine.episode import Episode, clip_to_square
from rigid_envs.systems.dynamic_ball.dynamics import DYNAMIC_BALL, Input, Parameters, State
from rigid_envs.systems.dynamic_ball.symmetry import ACROSS_X, ACROSS_Y, HALF_TURN
from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import DynamicBallTask, speed_bound
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.parts import held_for, limited, limited_pair
from rigid_envs.tasks.reduction import Reduction
from rigid_envs.tasks.task import AuxiliaryRanges

# Reduced coordinates of a ball on a table and the point where it is to be.

_FAR, _FAST = 20.0, 20.0  # m, and m/s or rad/s; bounds of the observation
_WIDE = 2.0  # limits; bound of the observed tilt and tilt rate
_LOG = 17.0  # bound of the logarithm of offset over tolerance
_NEAR = 1.0  # m; an offset counts no further in the predicted one
_AHEAD = 3.5  # time of the prediction in that of the zero in the right half-plane


class _Signs(NamedTuple):
    """Signs by which X and Y are multiplied."""

    x: float
    y: float


@scalar
def predicted(y: Any, aux: Any, p: Any, c: Any) -> tuple[float, float]:
    """Offset [m] after the time T at constant tilt, of an offset that is limited in length.

    Near level, ``X'' = a alpha_y - radius alpha_y''`` with a = g / (1 + beta), and Y likewise with
    -alpha_x. The angles stop in the middle of the next period. With T = 3.5 sqrt(radius / a), 3.5
    times the time of the zero in the right half-plane, this is nearly parallel to the feedback of
    the linear-quadratic regulator: where it is 0, so is the best rate.
    """
    dx, dy = y.X - aux.point_X, y.Y - aux.point_Y
    near = 1.0 / max(math.sqrt(fma(dx, dx, dy * dy)) * (1.0 / _NEAR), 1.0)
    pull = p.g * p.share
    time = _AHEAD * math.sqrt(p.radius / pull)
    fall = 0.5 * time * time * pull
    return (
        near * dx
        + time * fma(p.radius, y.rate_y, y.VX)
        + fall * fma(0.5 * c.dt, y.rate_y, y.alpha_y),
        near * dy
        + time * fma(-p.radius, y.rate_x, y.VY)
        - fall * fma(0.5 * c.dt, y.rate_x, y.alpha_x),
    )


@scalar
def signs_of(x: float, y: float, p: Any) -> _Signs:
    """Both coordinates of (x, y) become positive; on a turntable, which has a sense, their sum."""
    together = select(x + y < 0.0, -1.0, 1.0)
    turning = p.turntable_rate != 0.0
    return _Signs(
        x=select(turning, together, select(x < 0.0, -1.0, 1.0)),
        y=select(turning, together, select(y < 0.0, -1.0, 1.0)),
    )


@scalar
def logarithmic(x: float, unit: float) -> float:
    """log(1 + abs(x) / unit) with the sign of x."""
    size = log(1.0 + min(abs(x), _FAR) / unit)
    return select(x < 0.0, -size, size)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The world's entries with signs such that the offset is positive, and what is predicted."""
    ahead_x, ahead_y = predicted(y, aux, p, c)
    dx, dy = y.X - aux.point_X, y.Y - aux.point_Y
    sign = signs_of(dx, dy, p)
    dx, dy = sign.x * dx, sign.y * dy
    tilt, rate = 1.0 / c.tilt_limit, 1.0 / c.tilt_rate
    return (
        *limited_pair((dx, dy), _FAR),
        logarithmic(dx, c.tolerance),
        logarithmic(dy, c.tolerance),
        *limited_pair((sign.x * y.X, sign.y * y.Y), _FAR),
        *limited((sign.x * y.VX, sign.y * y.VY, sign.x * sign.y * y.spin), _FAST),
        *limited_pair((sign.y * tilt * y.alpha_x, sign.x * tilt * y.alpha_y), _WIDE),
        *limited_pair((sign.y * rate * y.rate_x, sign.x * rate * y.rate_y), _WIDE),
        *limited_pair((sign.x * ahead_x, sign.y * ahead_y), _FAR),
        logarithmic(sign.x * ahead_x, c.tolerance),
        logarithmic(sign.y * ahead_y, c.tolerance),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> _Signs:
    """Signs of the offset."""
    return signs_of(y.X - aux.point_X, y.Y - aux.point_Y, p)


@scalar
def turn(a: Any, sign: Any) -> tuple[float, float]:
    """Rates of the angles of the table; that about x goes with Y."""
    return sign.y * a[0], sign.x * a[1]


_SIGNS, _LOGARITHM = "signs of the offset", "log(1 + abs / tolerance), signed"

TABLE = Reduction(
    group="Z2 x Z2",
    frame=(
        "signs such that the offset from the point is positive in both axes; on a turntable, such "
        "that its sum is."
    ),
    symmetries=(HALF_TURN, ACROSS_X, ACROSS_Y),
    features=(
        *(Entry(f"{k} - {k}*", "m", _SIGNS, -_FAR, _FAR) for k in "XY"),
        *(Entry(f"log of {k} - {k}*", "1", _LOGARITHM, -_LOG, _LOG) for k in "XY"),
        *(Entry(k, "m", _SIGNS, -_FAR, _FAR) for k in "XY"),
        *(Entry(f"V{k}", "m/s", _SIGNS, -_FAST, _FAST) for k in "XY"),
        Entry("spin", "rad/s", _SIGNS, -_FAST, _FAST),
        *(Entry(f"alpha_{k} / limit", "1", _SIGNS, -_WIDE, _WIDE) for k in "xy"),
        *(Entry(f"alpha_{k}' / limit", "1", _SIGNS, -_WIDE, _WIDE) for k in "xy"),
        *(Entry(f"predicted {k} - {k}*", "m", _SIGNS, -_FAR, _FAR) for k in "XY"),
        *(Entry(f"log of predicted {k} - {k}*", "1", _LOGARITHM, -_LOG, _LOG) for k in "XY"),
    ),
    observe=observe_reduced,
    Frame=_Signs,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        $S$ is the sign of $X - X*$, $T$ that of $Y - Y*$; on a turntable both are that of the sum.
        $X$, $VX$, $alpha_y$ and $alpha_y'$ are multiplied by $S$; $Y$, $VY$, $alpha_x$, $alpha_x'$
        by $T$; the spin by $S T$, and the action by $(T, S)$.

        With the offset $d$, $a = g / (1 + beta)$ and $t = 3.5 sqrt(radius / a)$, predicted is $d /
        max(|d|, 1) + t (VX + radius alpha_y', VY - radius alpha_x') + t^2 a / 2 (alpha_y + dt
        alpha_y' / 2, -alpha_x - dt alpha_x' / 2)$, with the radius, $beta$ and $g$ of the episode.
        The logarithm is that of an offset limited to 20.
    """,
)
"""Reduction of `BallPlate`: reflections in both axes; half a turn where the table turns."""


# Hold a ball at a commanded point of a table by tilting the table.


class Action(NamedTuple):
    """Commanded rates of the two angles, as fractions of the maximum."""

    rate_x: float
    rate_y: float


class Terms(NamedTuple):
    """Reward terms of `BallPlate`."""

    near: float
    effort: float


class Constants(NamedTuple):
    """Limits [rad, rad/s], period [s], success [m, s], starts [m, m/s], edge of the table [m]."""

    tilt_limit: float
    tilt_rate: float
    dt: float
    tolerance: float
    hold: float
    start_radius: float
    start_speed: float
    edge: float


class Auxiliary(NamedTuple):
    """Commanded point [m], and the number of steps for which the ball has been near it."""

    point_X: float = 0.0
    point_Y: float = 0.0
    held: float = 0.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """On a level table: ball and point uniform in one disk, velocity in another."""
    X, Y = randoms.in_disk(stream, 0)
    VX, VY = randoms.in_disk(stream, 1 << 20)
    point_X, point_Y = randoms.in_disk(stream, 1 << 21)
    r, v = c.start_radius, c.start_speed
    q = randoms.quaternion(stream, 1 << 22)
    ball = State(*q, r * X, r * Y, v * VX, v * VY, 0.0, 0.0, 0.0, 0.0, 0.0)
    return ball, Auxiliary(point_X=r * point_X, point_Y=r * point_Y, held=0.0)


@scalar
def reachable(rate: float, angle: float, now: float, c: Constants) -> float:
    """Commanded rate, limited so that the angle can stop within its limit.

    Rates change linearly over a period, also when the table stops in the next period. The final
    angle is then angle + (now + 2 rate) period / 2.
    """
    rest, per_period = angle + 0.5 * c.dt * now, 1.0 / c.dt
    low, high = (-c.tilt_limit - rest) * per_period, (c.tilt_limit - rest) * per_period
    return min(max(min(max(rate, low), high), -c.tilt_rate), c.tilt_rate)


@scalar
def actuate(
    a: Action, y: State, aux: Auxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Accelerations that bring the tilt rates to the commanded ones within the period."""
    rate_x = reachable(c.tilt_rate * a.rate_x, y.alpha_x, y.rate_x, c)
    rate_y = reachable(c.tilt_rate * a.rate_y, y.alpha_y, y.rate_y, c)
    per_period = 1.0 / c.dt
    a_x, a_y = (rate_x - y.rate_x) * per_period, (rate_y - y.rate_y) * per_period
    return y, Input(FX=0.0, FY=0.0, a_x=a_x, a_y=a_y)


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Reward terms, angle tilted as cost, success after the hold time, end at the edge."""
    dx, dy = y.X - aux.point_X, y.Y - aux.point_Y
    distance = math.sqrt(dx * dx + dy * dy)
    held, success = held_for(distance < c.tolerance, aux, c, dt)
    square = y.rate_x * y.rate_x + y.rate_y * y.rate_y
    effort = min(square * (0.5 / (c.tilt_rate * c.tilt_rate)), 1.0)
    terms = Terms(near=1.0 / (1.0 + 5.0 * distance), effort=-effort)
    off = y.X * y.X + y.Y * y.Y > c.edge * c.edge
    aux = Auxiliary(aux.point_X, aux.point_Y, held)
    return aux, terms, dt * math.sqrt(square), success, off


@scalar
def observe(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> Row:
    """Offset from the point, position, velocity, spin; tilt and rate divided by their limits."""
    dx, dy = y.X - aux.point_X, y.Y - aux.point_Y
    tilt, rate = 1.0 / c.tilt_limit, 1.0 / c.tilt_rate
    return (
        *limited_pair((dx, dy), _FAR),
        *limited_pair((y.X, y.Y), _FAR),
        *limited((y.VX, y.VY, y.spin), _FAST),
        *limited_pair((tilt * y.alpha_x, tilt * y.alpha_y), _WIDE),
        *limited_pair((rate * y.rate_x, rate * y.rate_y), _WIDE),
    )


@dataclass(frozen=True)
class BallPlate(DynamicBallTask):
    """Hold a ball at a commanded point of a table, drawn in every episode, by tilting the table.

    The ball rolls without slipping on a table that turns about the point $O$ of its surface by the
    angles $alpha_x$ and $alpha_y$. The action commands the rates of the two angles. The attitude of
    the ball does not matter here and is not observed (`rotation`).

    Why it is hard: there are two integrators between tilt and position, and tilting first moves the
    centre in the wrong direction. A small tilt limit makes stopping slow, and the table is small.

    Physics:
        Near level, in the axes of the table, $X'' = g alpha_y / (1 + beta) - radius alpha_y''$ and
        $Y'' = -g alpha_x / (1 + beta) + radius alpha_x''$. The full equations are simulated, with
        centrifugal and gyroscopic terms. The mass has no effect on the motion. The motor changes
        the rates of the angles linearly to the commanded ones within the control period, and brakes
        in time to stop at `tilt_limit`: for each angle, with the rate $omega$ at the beginning, the
        commanded rate is limited to $(+-tilt_limit - alpha) / dt - omega / 2$, then to
        $+-tilt_rate$, and the acceleration is the commanded rate less $omega$, over `dt`.

        Tilting moves the centre of the ball in the wrong direction by radius times angle: a zero of
        the transfer function in the right half-plane, at $sqrt(g / ((1 + beta) radius))$. On a
        turntable (`turntable_rate` $Omega$) a free ball does not roll along a straight line but
        round a circle, at $beta / (1 + beta) Omega$: 2/7 of the rate of the table for a solid
        sphere, 2/5 for a hollow one, whatever its size and speed.

    Rewards:
        `near` = $1 / (1 + 5 distance)$ with the distance to the point [m], and `effort` =
        $-min(|rates|^2 / (2 tilt_rate^2), 1)$ of the angles, which penalises unnecessary tilting.
        The rates are those at the end of the step; the cost is $dt |rates|$.

    Starting State:
        The table is level and at rest. Ball and point are uniform in a disk of `start_radius`, the
        velocity in one of `start_speed`; the ball does not spin about the normal, and its attitude
        is uniform on $SO(3)$.

    Episode End:
        Success (`info["is_success"]`): the distance to the point has been below `tolerance`
        throughout the last `hold` seconds: $n$ steps in succession, where $n dt >= hold$. The
        episode terminates when the ball passes the edge of the table: it is more than $start_radius
        + margin$ from $O$.

    Reference:
        `lqr` is the linear-quadratic regulator $rates = -K (offset, velocity, tilt, tilt rates)$ of
        the level table, with the offset limited to 1 m.

        Exact: a free ball on a turntable goes round at $beta / (1 + beta)$ of its rate. A ball at
        rest on its point stays there on a level table, without effort.

    Source:
        Neimark & Fufaev, *Dynamics of Nonholonomic Systems*, chapter III; turntable: Weltner 1979,
        doi:10.1119/1.11602; regulator: Anderson & Moore, *Optimal Control: Linear Quadratic
        Methods*, chapter 2.
    """

    n_substeps: int = 2
    rotation: str = "none"
    m: Range = physical(1.0, "mass, without effect on the motion", "kg")
    tilt_limit: float = setting(0.1, Number("largest tilt about each axis", "rad", 1e-3, 0.5))
    tilt_rate: float = setting(0.4, Number("largest rate of each tilt", "rad/s", 1e-3, 10.0))
    start_radius: float = setting(
        2.0, Number("radius of the disk of starts and points", "m", 0.0, 100.0)
    )
    start_speed: float = setting(0.5, Number("largest speed at the start", "m/s", 0.0, 10.0))
    margin: float = setting(2.0, Number("table beyond the start disk", "m", 0.1, 100.0))
    tolerance: float = setting(0.05, Number("largest distance of a success", "m", 1e-6, 10.0))
    hold: float = setting(2.0, Number("time within tolerance", "s", 0.0, 1e4))
    weight_near: float = setting(1.0, Number("weight of the distance term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=DYNAMIC_BALL,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        start=start,
        clip=clip_to_square,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = TABLE
    counters: ClassVar = ("held",)
    cost_unit: ClassVar = "angle tilted [rad]"

    @property
    def edge(self) -> float:
        """Radius of the table [m]."""
        return self.start_radius + self.margin

    def actions(self) -> tuple[Entry, ...]:
        """Commanded rates of the two angles."""
        rate = self.tilt_rate
        return tuple(Entry(f"alpha_{k}'", "rad/s", "plate", -rate, rate) for k in "xy")

    def features(self) -> tuple[Entry, ...]:
        """Offset from the point, position, velocity, spin, tilt and its rate."""
        return (
            *(Entry(f"{k} - {k}*", "m", "plate", -_FAR, _FAR) for k in "XY"),
            *(Entry(k, "m", "plate", -_FAR, _FAR) for k in "XY"),
            *(Entry(f"V{k}", "m/s", "plate", -_FAST, _FAST) for k in "XY"),
            Entry("spin", "rad/s", "plate normal", -_FAST, _FAST),
            *(Entry(f"alpha_{k} / limit", "1", "plate", -_WIDE, _WIDE) for k in "xy"),
            *(Entry(f"alpha_{k}' / limit", "1", "plate", -_WIDE, _WIDE) for k in "xy"),
        )

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """Points of the disk of starts."""
        inside = (0.0, self.start_radius)
        return {**super().auxiliary_ranges(p, elapsed), ("point_X", "point_Y"): inside}

    def largest_rate(self, duration: float) -> float:
        """Rates of table and ball at the bound on the speed within the edge."""
        beta, table = span(self.beta), max(abs(end) for end in span(self.turntable_rate))
        plate, edge = math.sqrt(2.0) * self.tilt_rate, self.edge
        push = math.sqrt(2.0) * span(self.g)[1] * self.tilt_limit + plate * plate * edge
        gyration = table * beta[1] / (1.0 + beta[1])
        speed = speed_bound(push / (1.0 + beta[0]), edge, gyration) + self.start_speed
        # the tilting table also moves the ball, by radius times its rate
        return 2.0 * plate + (speed + table * edge) / span(self.radius)[0]
