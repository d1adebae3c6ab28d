"""Roll a ball to a pose."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Quaternion, Row, Vector, attitude, log_rotation
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import cbrt, fma, select
from rigid_envs.engine.episode import Episode, NoAuxiliary, clip_to_disk
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball.dynamics import ROLLING_BALL, Input, Parameters, State
from rigid_envs.systems.rolling_ball.symmetry import REFLECTION, TURN
from rigid_envs.systems.rolling_ball.tasks.shared import Action, RollsAsTold, actuate
from rigid_envs.tasks.fields import Entry, Range, span
from rigid_envs.tasks.parts import limited_pair
from rigid_envs.tasks.reduction import Frame, Reduction, axial_seen, frame_along, polar_seen, turn

# Reduced coordinates of the pose of a ball relative to its goal: `BallPark` and its relatives.

FAR = 50.0  # radii; bound of observed and penalised offsets


OFFSET = tuple(Entry(f"{k} / radius", "1", "world", -FAR, FAR) for k in "XY")
"""Entries of `offset`."""


@scalar
def offset(y: Any, p: Any) -> tuple[float, float]:
    """Offset of the ball in radii, clipped."""
    return limited_pair((y.X * p.inverse_radius, y.Y * p.inverse_radius), FAR)


@scalar
def pose_frame(X: float, Y: float, q: Quaternion) -> Frame:
    """x-axis along the offset, mirrored so that the rotation vector has theta_z >= 0.

    Without offset it is along the direction of rolling that tips the ball further.
    """
    sign = select(q[0] < 0.0, -1.0, 1.0)
    return frame_along(X, Y, sign * q[2], -sign * q[1], sign * q[3] < 0.0)


@scalar
def pose_seen(frame: Frame, X: float, Y: float, q: Quaternion) -> Row:
    """Invariants of an offset [radii] and an attitude; see `POSE`."""
    distance = min(polar_seen(frame, X, Y)[0], FAR)
    theta: Vector = axial_seen(frame, log_rotation(q))
    w, x, y, z = q
    sine_square = fma(x, x, fma(y, y, z * z))
    s = math.sqrt(sine_square)
    ahead, beside = theta[0], theta[1] - distance
    return (
        distance,
        theta[0],
        theta[1],
        theta[2],
        math.sqrt(abs(theta[2])),
        fma(-2.0, sine_square, 1.0),
        2.0 * abs(w) * s,
        _signed_root(ahead),
        _signed_root(beside),
    )


@scalar
def _signed_root(x: float) -> float:
    root = math.sqrt(abs(x))
    return select(x < 0.0, -root, root)


POSE = (
    Entry("r", "1", "offset, radii", 0.0, FAR),
    Entry("theta_x", "rad", "reduced", -math.pi, math.pi),
    Entry("theta_y", "rad", "reduced", -math.pi, math.pi),
    Entry("theta_z", "rad", "reduced", 0.0, math.pi),
    Entry("sqrt theta_z", "1", "reduced", 0.0, math.sqrt(math.pi)),
    Entry("cos abs theta", "1", "", -1.0, 1.0),
    Entry("sin abs theta", "1", "", 0.0, 1.0),
    Entry("sqrt m_x", "1", "reduced, signed root", -2.0, 2.0),
    Entry("sqrt m_y", "1", "reduced, signed root", -8.0, 8.0),
)
"""Entries of `pose_seen`: offset r, rotation vector theta, mismatch m = (theta_x, theta_y - r)."""


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The pose relative to the goal at the origin."""
    X, Y, q = y.X * p.inverse_radius, y.Y * p.inverse_radius, attitude(y)
    return pose_seen(pose_frame(X, Y, q), X, Y, q)


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame of the pose relative to the goal at the origin."""
    return pose_frame(y.X, y.Y, attitude(y))


BALL_POSE = Reduction(
    group="O(2)",
    frame="$x$ along the offset from the goal, mirrored so that $theta_z >= 0$.",
    symmetries=(TURN, REFLECTION),
    features=POSE,
    observe=observe_reduced,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    With $p$ the offset and $theta$ the rotation vector of Rewards, the frame has the $x$-axis $(c,
    s) = p / |p|$. Where $p$ is 0 it is along $(theta_y, -theta_x)$, and where that is 0 too along
    the $x$-axis of the world. The side $k$ is the sign of $theta_z$. A horizontal vector $(v_x,
    v_y)$ is seen as $(c v_x + s v_y, k (c v_y - s v_x))$, and $theta$ as $(k (c theta_x + s
    theta_y), c theta_y - s theta_x, k theta_z)$. An action $(a, b)$ in the frame is $(c a - s k b,
    s a + c k b)$ in the world.

    $r$ is $min(|p|, 50)$, and $m = (theta_x, theta_y - r)$ in the frame, with signed roots
    $sign(m_x) sqrt(|m_x|)$, which are not rounded off.
    """,
)
"""Reduction of `BallPark`: O(2), turns about the vertical through the goal and reflections."""


# Park a ball: reach a position and an attitude by rolling without slipping.

_SMOOTH = 1e-3  # smooths the roots at the origin


class Terms(NamedTuple):
    """Reward terms of `BallPark`."""

    position: float
    twist: float
    mismatch: float
    angle: float
    parked: float


class Constants(NamedTuple):
    """Largest rolling rate [rad/s], tolerances [m, rad], half side of the start square [m]."""

    largest_roll_rate: float
    position_tolerance: float
    angle_tolerance: float
    start_half_width: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """Position uniform in a square, attitude uniform on SO(3)."""
    half = c.start_half_width
    X = half * (2.0 * randoms.uniform(stream, 0) - 1.0)
    Y = half * (2.0 * randoms.uniform(stream, 1) - 1.0)
    return State(*randoms.quaternion(stream, 2), X + 0.0, Y + 0.0), ()  # -0.0 is 0.0


@scalar
def misplacement(y: Any, scale: float) -> tuple[float, float, float, float]:
    """Distance [radii], sqrt|theta_z|, |m| and |theta| of `BallPark`; `scale` is 1 / radius."""
    X, Y = y.X * scale, y.Y * scale
    theta = log_rotation(attitude(y))
    distance = math.sqrt(X * X + Y * Y)
    angle = math.sqrt(theta[0] * theta[0] + theta[1] * theta[1] + theta[2] * theta[2])
    a, b = theta[0] + Y, theta[1] - X
    mismatch = math.sqrt(a * a + b * b + _SMOOTH * _SMOOTH)
    twist = math.sqrt(math.sqrt(theta[2] * theta[2] + _SMOOTH * _SMOOTH))
    return distance, twist, mismatch, angle


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """The terms of `BallPark`, and whether the ball is parked."""
    distance, twist, mismatch, angle = misplacement(y, p.inverse_radius)
    parked = (distance * p.radius <= c.position_tolerance) & (angle <= c.angle_tolerance)
    rolled = dt * math.sqrt(u.VX * u.VX + u.VY * u.VY)
    terms = Terms(
        position=-min(distance, FAR),
        twist=-twist,
        mismatch=-cbrt(min(mismatch, FAR)),
        angle=-angle,
        parked=select(parked, 1.0, 0.0),
    )
    return aux, terms, rolled, parked, parked


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Constants) -> tuple[float, float]:
    """Position in radii."""
    return offset(y, p)


@dataclass(frozen=True)
class BallPark(RollsAsTold):
    """Park the ball: position at the origin and attitude upright, by rolling alone.

    A ball rolls on a plane without slipping. The action is the velocity of its centre. The ball
    cannot be turned about the vertical, nor about any axis without moving. It starts at a random
    pose and is to reach the origin with the attitude $R = 1$.

    The pose has five dimensions, and there are two controls. Rolling out and back along one line
    leaves the attitude unchanged; a closed path turns the ball according to the area that it
    encloses. So the straight path to the origin arrives with the wrong attitude, and parking takes
    a manoeuvre.

    Physics:
        The spin is 0, and a step is the exact rotation by $|v| dt / radius$ about $e_z x v$. An
        action of length 1 rolls a ball of any radius by `roll_per_step`.

        The two control vector fields and their Lie brackets span 2, 3 and 5 dimensions (growth
        vector $(2, 3, 5)$). A small counter-clockwise loop of area $A$ turns the ball by $-A /
        radius^2$ about the vertical: second order in the size of the loop. A tilt without
        displacement, or a displacement without rotation, takes two such loops: third order. There
        is no drift: nothing moves while the action is 0.

    Rewards:
        The cost is a homogeneous distance: each direction has the root of the order, 1, 2 or 3, of
        the Lie bracket that generates it. With $p$ the offset in radii, $theta = log R$ the
        rotation vector in world axes and $m = (theta_x + p_y, theta_y - p_x)$ the mismatch between
        rotation and rolled offset, `position` = $-min(|p|, 50)$, `twist` = $-sqrt(t)$ and
        `mismatch` = $-cbrt(min(s, 50))$, where $t = sqrt(theta_z^2 + 0.001^2)$ and $s = sqrt(|m|^2
        + 0.001^2)$ round the roots off at 0. `parked` = 1 in the step that parks the ball.

        The obvious alternative, negative distance, uses `weight_position` and `weight_angle` (of
        `angle` = $-|theta|$) in place of `weight_twist` and `weight_mismatch`, as in
        configs/ball_park_naive_ppo.yaml.

    Starting State:
        Position uniform in the square $|X|, |Y| <= start_half_width$, attitude uniform on $SO(3)$.

    Episode End:
        The episode terminates when the ball is parked: its offset is at most `position_tolerance`
        and the angle of its attitude at most `angle_tolerance`. That step is the success
        (`info["is_success"]`).

    Reference:
        `shortest_path` follows the shortest path, an elastica found by shooting, rolled as a
        polygon with one side per step. `three_rolls` takes three straight rolls; two are not enough
        for every pose.

        Paths that end at the edge of the tolerance may be shorter than those that end exactly at
        the goal.

    Source:
        Jurdjevic 1993, "The geometry of the plate-ball problem", doi:10.1007/BF00375605; shortest
        paths: Arthurs & Walsh 1986; three rolls: Hammersley 1983, "Oxford commemoration ball", LMS
        Lecture Notes 79.
    """

    start_half_width: float = setting(2.0, Number("half side of the start square", "m", 0.0, 20.0))
    position_tolerance: float = setting(0.1, Number("largest offset when parked", "m", 1e-6, 10.0))
    angle_tolerance: float = setting(0.15, Number("largest angle when parked", "rad", 1e-6, 3.2))
    weight_position: float = setting(0.01, Number("weight of -|p|", "1", -1e3, 1e3))
    weight_twist: float = setting(0.02, Number("weight of -sqrt|theta_z|", "1", -1e3, 1e3))
    weight_mismatch: float = setting(0.02, Number("weight of -cbrt|m|", "1", -1e3, 1e3))
    weight_angle: float = setting(0.0, Number("weight of -|theta|", "1", -1e3, 1e3))
    weight_parked: float = setting(10.0, Number("weight of the step that parks", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=ROLLING_BALL,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=clip_to_disk,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = BALL_POSE

    def features(self) -> tuple[Entry, ...]:
        """Offset in radii."""
        return OFFSET

    def lower_bound(self, y: Array) -> Array:
        """Lower bound on the path length [m]: max(distance, radius * angle) to the origin."""
        ball = self.system()
        distance = np.hypot(*np.moveaxis(ball.accessors["position"](y), -1, 0))
        angle = rotations.angle(ball.accessors["q"](y))
        return np.asarray(np.maximum(distance, span(self.radius)[0] * angle))


@dataclass(frozen=True)
class BallParkRandom(BallPark):
    """Park balls of different sizes: `BallPark` with a radius drawn in every episode.

    The radius is the only length in the kinematics. Positions are observed in radii and actions are
    rolling rates, so the same manoeuvre parks balls of all sizes. The start square and the
    tolerance do not scale; they stay in metres. A ball of 0.5 m starts up to 5.7 radii away and
    must park within 0.2 radii; a ball of 2 m starts at most 1.4 radii away and must park within
    0.05. The bounds of the action in m/s are those of the largest ball. With `observe_params` the
    radius is observed.

    Reference:
        The controllers of `BallPark`, which plan with the drawn radius.
    """

    radius: Range = (0.5, 2.0)


# Reorient a ball by a closed path: return to the start position with another attitude.


@dataclass(frozen=True)
class BallReorient(BallPark):
    """Turn the ball upright and return to the start position: pure holonomy.

    `BallPark` from position 0 and an attitude uniform on $SO(3)$. Rolling out and back along one
    line leaves the attitude unchanged; a closed path turns the ball according to the area that it
    encloses. A goal attitude other than upright would be the same task in other body axes.

    Why it is hard: rolling straight back undoes the rotation of rolling out. So the return path
    must differ from the outward path, and must enclose the right area with it.

    Physics:
        The ball rolls as in `BallPark`.

        A small counter-clockwise loop of area $A$ turns the ball by $-A / radius^2$ about the
        vertical (a circle of radius $rho$ by $-A / radius^2 (1 - 3 (rho / radius)^2 / 4)$ to the
        next order), second order in the size of the loop. A tilt is third order, from two loops of
        opposite sense, one beside the other.

    Starting State:
        Position 0 (uniform in a square where `start_half_width` is not 0), attitude uniform on
        SO(3).

    Reference:
        The controllers of `BallPark`.

        Over all attitudes the mean angle is $pi / 2 + 2 / pi$.

    Source:
        Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79; Jurdjevic 1993, "The
        geometry of the plate-ball problem", doi:10.1007/BF00375605; shortest paths: Arthurs & Walsh
        1986.
    """

    start_half_width: float = 0.0
