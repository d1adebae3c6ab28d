"""Steer a ball along with another one that rolls ahead: position and attitude together."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rigid_envs.kernels import episode, randoms, rolling_ball
from rigid_envs.kernels.actions import clip_to_disc, single
from rigid_envs.kernels.algebra import Row, compose, log_rotation
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import fma, select, sincos
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.kernels.turns import half_turn
from rigid_envs.systems import RollingBall
from rigid_envs.tasks.base import ROTATION, Array, Entry, Task
from rigid_envs.tasks.fields import Choice, Number, Range, physical, setting, span

__all__ = ["BallSteer"]

_FAR = 50.0  # radii; offsets are observed no further than this
_BENT = 5.0  # curvature times radius; observed no further than this
_EIGHT = 0.9089085575485415  # modulus of the closed elastica: K = 2 E
_MODULI = (0.6, 1.2)  # of the others: waves, loops, and beyond 1 the curls that never turn back
_EIGHTS = {"eight": 1.0, "both": 0.5, "elastica": 0.0}  # share of them
# constants after the weight
_RATE, _SPEED, _WAVENUMBER, _SHARE, _OFFSET, _ANGLE, _BOUND = range(1, 8)


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """The reference at the origin, upright, where its path is bent most; the ball near it.

    An elastica of modulus k and wavenumber w has there the curvature 2 k w, its force w^2 along it.
    """
    heading = randoms.direction(stream, 0)
    other = fma(_MODULI[1] - _MODULI[0], randoms.uniform(stream, 1 << 20), _MODULI[0])
    modulus = select(randoms.uniform(stream, (1 << 20) + 1) < c[_SHARE], _EIGHT, other)
    side = select(randoms.uniform(stream, (1 << 20) + 2) < 0.5, -1.0, 1.0)
    wavenumber = c[_WAVENUMBER] * p[1]
    force = wavenumber * wavenumber
    x, y = randoms.in_disc(stream, 1 << 21)
    turn = randoms.in_ball(stream, 1 << 22)
    half, far = 0.5 * c[_ANGLE], c[_OFFSET] * p[0]
    q = half_turn((half * turn[0], half * turn[1], half * turn[2]))
    path = (*heading, 2.0 * side * modulus * wavenumber, force * heading[0], force * heading[1])
    return (*q, far * x, far * y), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, *path, 0.0, 0.0)


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Velocity of the centre; the ball does not spin about the vertical."""
    return y, (c[_RATE] * p[0] * a[0], c[_RATE] * p[0] * a[1], 0.0)


@scalar
def leading(memo: Row, c: Row) -> Row:
    """The action that rolls the reference, rounded as actions are: it can be copied exactly."""
    return (single(c[_SPEED] * memo[6]), single(c[_SPEED] * memo[7]))


@scalar
def bend(memo: Row, way: float) -> Row:
    """Heading and curvature a way further along: half a change of curvature, a turn, another.

    Euler's elastica: ``heading' = curvature``, ``curvature' = heading x force``, force constant.
    """
    hx, hy, force_x, force_y = memo[6], memo[7], memo[9], memo[10]
    curvature = memo[8] + 0.5 * way * (hx * force_y - hy * force_x)
    s, cosine = sincos(way * curvature)
    hx, hy = cosine * hx - s * hy, s * hx + cosine * hy
    unit = fma(-0.5, hx * hx + hy * hy, 1.5)  # roundings of many turns add up
    hx, hy = unit * hx, unit * hy
    return (hx, hy, curvature + 0.5 * way * (hx * force_y - hy * force_x))


@scalar
def offset(y: Row, memo: Row, p: Row) -> Row:
    """From reference to ball: position [radii], rotation vector of q q_reference^-1, world."""
    theta = log_rotation(compose((y[0], y[1], y[2], y[3]), (memo[0], -memo[1], -memo[2], -memo[3])))
    return ((y[4] - memo[4]) * p[1], (y[5] - memo[5]) * p[1], *theta)


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """The reference moves as the ball has; then how far one is from the other."""
    _, velocity = actuate(leading(memo, c), y, memo, p, c)
    reference = rolling_ball.restore(rolling_ball.step(memo[:6], velocity, p, dt))
    path = bend(memo, dt * c[_RATE] * c[_SPEED] * p[0])
    x, y_, a, b, d = offset(y, reference, p)
    error = math.sqrt(x * x + y_ * y_ + a * a + b * b + d * d)
    total, count = memo[11] + error, memo[12] + 1.0
    rolled = dt * math.sqrt(u[0] * u[0] + u[1] * u[1])
    memo = (*reference, *path, memo[9], memo[10], total, count)
    return memo, (1.0 / (1.0 + 5.0 * error),), rolled, total <= c[_BOUND] * count, False


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Offset, the action of the reference, curvature and force of its path."""
    x, y_, a, b, d = offset(y, memo, p)
    action = leading(memo, c)
    square = p[0] * p[0]
    return (
        min(max(x, -_FAR), _FAR),
        min(max(y_, -_FAR), _FAR),
        min(max(a, -math.pi), math.pi),
        min(max(b, -math.pi), math.pi),
        min(max(d, -math.pi), math.pi),
        min(max(action[0], -1.0), 1.0),
        min(max(action[1], -1.0), 1.0),
        min(max(p[0] * memo[8], -_BENT), _BENT),
        min(max(square * memo[9], -_BENT), _BENT),
        min(max(square * memo[10], -_BENT), _BENT),
    )


MEMO = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SHAPES = Shapes(*rolling_ball.SHAPES, (1.0,), MEMO, (0.0,) * 2, (0.0,) * 8)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        rolling_ball.step,
        rolling_ball.restore,
        rolling_ball.WEIGHTS,
        clip_to_disc,
        actuate,
        judge,
        observe,
        SHAPES,
        memory,
        first_block,
        last_block,
    )


@kernel
def reset(memory: Memory, rows: Array, mode: int) -> None:
    """`episode.reset` of this task."""
    episode.reset(rolling_ball.derive, start, observe, SHAPES, memory, rows, mode)


@dataclass(frozen=True)
class BallSteer(Task):
    """Follow another ball, which rolls along a path of its own, in position and attitude.

    Both balls roll alike, so whoever begins at no offset and copies the velocity of the reference
    stays at no offset, exactly. Who begins at an offset must find the way to none while both roll.
    Only the difference of the two attitudes matters, and it is observed; the attitude itself is not
    (`rotation`).

    Why it is hard: five errors, two controls. To first order the error of the attitude turns with
    the rolling reference, ``theta' = d omega + omega_reference x theta``, which is what makes it
    controllable; but along a straight line ``theta_y - p_x`` (x along the line) does not change at
    all, and only the bends of the path bring it down.

    Physics:
        Rolling without slipping, ``v = omega x radius e_z``, makes the horizontal angular velocity
        ``omega = (-VY, VX, 0) / radius`` in world axes. A step holds the velocity, and is the
        exact rotation by ``|v| dt / radius`` about the axis ``e_z x v``.

        The paths are elasticae of Euler, ``heading'' = -w^2 sin(heading - axis)`` along the way, w
        the `wavenumber`, those along which the shortest ways of a ball lead from pose to pose: the
        closed one, a figure eight (modulus 0.909), which is ``9.28 / w`` radii long, and others of
        modulus 0.6 to 1.2; above 1 they curl and never turn back. The reference rolls them as
        polygons, one side in each control period, at `reference_speed` of the largest speed.

    Rewards:
        ``close`` = ``1 / (1 + 5 error)``, with the pose error ``sqrt(|p|^2 + |theta|^2)``: p the
        offset in radii and theta the rotation vector from the attitude of the reference to that of
        the ball: steepest at no error, and not flat at any.

    Starting State:
        The reference at the origin, upright, where its path is bent most, heading anywhere and
        bent to either side; `path` is "eight", "elastica" (modulus uniform), or "both", each in
        half of the episodes. The ball is away from it by an offset uniform in a disk of
        `start_offset` radii and a rotation vector uniform in a ball of `start_angle`.

    Episode End:
        The episode does not end before its time. Success (`info["is_success"]`): the mean pose
        error since the start is at most `bound`.

    Reference:
        `lqr` is the linear-quadratic regulator along the elastica that the reference is on: it
        looks ahead. `damping` does not: it takes the action of the reference and a step down the
        slope of the error, ``w = -0.6 (p_x + 1.2 theta_y, p_y - 1.2 theta_x)`` in radii per second.

        Exact: the error 0 for ever is feasible from no offset, as the reference is rolled by
        actions that are rounded as any other and can be copied to the bit.

    Version History:
        v0: first version.

    Source:
        Elasticae: Love, *Mathematical Theory of Elasticity*, section 262; as shortest paths:
        Arthurs & Walsh 1986; Jurdjevic 1993, "The geometry of the plate-ball problem",
        doi:10.1007/BF00375605; damping control: Jurdjevic & Quinn 1978,
        doi:10.1016/0022-0396(78)90135-3.
    """

    rotation: str = setting("none", ROTATION)
    radius: Range = physical(1.0, "radius of both balls", "m")
    roll_per_step: float = setting(
        math.pi / 8, Number("largest roll per control period", "rad", 1e-3, math.pi / 2)
    )
    reference_speed: float = setting(0.5, Number("speed of the reference / largest", "1", 0.0, 1.0))
    path: str = setting("both", Choice("path of the reference", tuple(_EIGHTS)))
    wavenumber: float = setting(0.6, Number("wavenumber of the paths", "1/radius", 0.01, 1.0))
    start_offset: float = setting(1.0, Number("largest offset at the start", "radius", 0.0, 10.0))
    start_angle: float = setting(1.0, Number("largest angle at the start", "rad", 0.0, math.pi / 2))
    bound: float = setting(0.3, Number("largest mean pose error of a success", "1", 1e-6, 10.0))
    weight_close: float = setting(1.0, Number("weight of closeness", "1", -1e3, 1e3))

    system_type: ClassVar = RollingBall
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("close",)
    cost_unit: ClassVar = "distance rolled [m]"
    memo_names: ClassVar = (
        *("reference_w", "reference_x", "reference_y", "reference_z", "reference_X", "reference_Y"),
        *("heading_X", "heading_Y", "curvature", "force_X", "force_Y", "total", "count"),
    )

    def constants(self) -> tuple[float, ...]:
        """Weight, rates, path, starts, bound."""
        return (
            self.weight_close,
            self.roll_per_step / self.dt,
            self.reference_speed,
            self.wavenumber,
            _EIGHTS[self.path],
            self.start_offset,
            self.start_angle,
            self.bound,
        )

    def actions(self) -> tuple[Entry, ...]:
        """Velocity of the centre, in a disc."""
        speed = self.roll_per_step / self.dt * span(self.radius)[1]
        return tuple(Entry(f"V{k}", "m/s", "world, disc", -speed, speed) for k in "XY")

    def features(self) -> tuple[Entry, ...]:
        """Offset from the reference, its action, curvature and force of its path."""
        pi = math.pi
        return (
            *(Entry(f"d{k} / radius", "1", "world", -_FAR, _FAR) for k in "XY"),
            *(Entry(f"theta_{k}", "rad", "world", -pi, pi) for k in "xyz"),
            *(Entry(f"V{k} of the reference", "1", "world, as action", -1.0, 1.0) for k in "XY"),
            Entry("curvature * radius", "1", "path", -_BENT, _BENT),
            *(Entry(f"force_{k} * radius^2", "1", "world", -_BENT, _BENT) for k in "XY"),
        )

    def largest_rate(self) -> float:
        """Rolling rate at full speed."""
        return self.roll_per_step / self.dt
