"""Roll a ball along a moving reference."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Choice, Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, Vector, attitude, compose, half_turn, log_rotation
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, select, sincos
from rigid_envs.engine.episode import Episode, clip_to_disk, single
from rigid_envs.systems.rolling_ball import dynamics as rolling_ball
from rigid_envs.systems.rolling_ball.dynamics import ROLLING_BALL, Input, Parameters, State
from rigid_envs.systems.rolling_ball.symmetry import BODY_AXES, REFLECTION, TURN
from rigid_envs.systems.rolling_ball.tasks.shared import Action, RollsAsTold, actuate
from rigid_envs.tasks.fields import Entry, Range, physical
from rigid_envs.tasks.parts import limited, limited_pair
from rigid_envs.tasks.reduction import Frame, Reduction, axial_seen, polar_seen, turn
from rigid_envs.tasks.symmetry import TRANSLATION
from rigid_envs.tasks.task import UNIT, AuxiliaryRanges

# Reduced coordinates of `BallSteer`: the error in the frame of the reference's path.

_FAR, _BENT = 50.0, 5.0  # radii, and curvature times radius; bounds of the observation


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """x-axis along the heading of the reference, mirrored so that its path bends to the left."""
    side = select(aux.curvature < 0.0, -1.0, 1.0)
    return Frame(aux.heading_X, aux.heading_Y, side)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Offset and rotation from the reference; curvature and force of its path."""
    frame, square = frame_of(y, aux, p, c), p.radius * p.radius
    inverse = (aux.reference_w, -aux.reference_x, -aux.reference_y, -aux.reference_z)
    theta = axial_seen(frame, log_rotation(compose(attitude(y), inverse)))
    X, Y = y.X - aux.reference_X, y.Y - aux.reference_Y
    return (
        *limited_pair(polar_seen(frame, X * p.inverse_radius, Y * p.inverse_radius), _FAR),
        *limited(theta, math.pi),
        min(abs(aux.curvature) * p.radius, _BENT),
        *limited_pair(polar_seen(frame, square * aux.force_X, square * aux.force_Y), _BENT),
    )


ALONG_PATH = Reduction(
    group="E(2) x SO(3)",
    frame="$x$ along the heading of the reference, mirrored so that its path bends to the left.",
    symmetries=(TRANSLATION, TURN, REFLECTION, BODY_AXES),
    features=(
        *(Entry(f"{k} / radius", "1", "path", -_FAR, _FAR) for k in ("ahead", "left")),
        *(Entry(f"theta_{k}", "rad", "path", -math.pi, math.pi) for k in "xyz"),
        Entry("curvature * radius", "1", "path", 0.0, _BENT),
        *(Entry(f"force_{k} * radius^2", "1", "path", -_BENT, _BENT) for k in "xy"),
    ),
    observe=observe_reduced,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        The frame is as in `BallPark`, with $(c, s)$ the heading of the reference and the side $k$
        the sign of the curvature: offset and force are seen as horizontal vectors, $theta$ as
        there, and the curvature as its magnitude.
    """,
)
"""Reduction of `BallSteer`: only the error and the shape of the path ahead matter."""


# Track a rolling reference ball in position and attitude.

_EIGHT = 0.9089085575485415  # modulus of the closed elastica: K = 2 E
_MODULI = (0.6, 1.2)  # range of the other moduli; above 1 the heading turns in one sense only
_EIGHTS = {"eight": 1.0, "both": 0.5, "elastica": 0.0}  # probability of a figure eight


class Terms(NamedTuple):
    """Reward term of `BallSteer`."""

    close: float


class Constants(NamedTuple):
    """Rates [rad/s, 1], wavenumber [1/radius], probability, starts [radius, rad], error bound."""

    largest_roll_rate: float
    reference_speed: float
    wavenumber: float
    share_of_eights: float
    start_offset: float
    start_angle: float
    bound: float


class Auxiliary(NamedTuple):
    """Reference: pose [1, m], heading, curvature [1/m], force [1/m^2]; errors so far."""

    reference_w: float = 1.0
    reference_x: float = 0.0
    reference_y: float = 0.0
    reference_z: float = 0.0
    reference_X: float = 0.0
    reference_Y: float = 0.0
    heading_X: float = 1.0
    heading_Y: float = 0.0
    curvature: float = 0.0
    force_X: float = 0.0
    force_Y: float = 0.0
    error_sum: float = 0.0
    n_errors: float = 0.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """Reference at the origin, upright, at the largest curvature of its path; ball near it.

    There an elastica of modulus k and wavenumber w has the curvature 2 k w and a force w^2 along
    the heading.
    """
    heading = randoms.direction(stream, 0)
    other = fma(_MODULI[1] - _MODULI[0], randoms.uniform(stream, 1 << 20), _MODULI[0])
    modulus = select(randoms.uniform(stream, (1 << 20) + 1) < c.share_of_eights, _EIGHT, other)
    side = select(randoms.uniform(stream, (1 << 20) + 2) < 0.5, -1.0, 1.0)
    wavenumber = c.wavenumber * p.inverse_radius
    force = wavenumber * wavenumber
    X, Y = randoms.in_disk(stream, 1 << 21)
    turn = randoms.in_ball(stream, 1 << 22)
    half, far = 0.5 * c.start_angle, c.start_offset * p.radius
    q = half_turn((half * turn[0], half * turn[1], half * turn[2]))
    home = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    path = (*heading, 2.0 * side * modulus * wavenumber, force * heading[0], force * heading[1])
    return State(*q, far * X, far * Y), Auxiliary(*home, *path, 0.0, 0.0)


@scalar
def leading(aux: Auxiliary, c: Constants) -> Action:
    """Action of the reference, rounded to float32 as all actions: it can be copied exactly."""
    return Action(
        single(c.reference_speed * aux.heading_X), single(c.reference_speed * aux.heading_Y)
    )


@scalar
def bend(aux: Auxiliary, distance: float) -> Vector:
    """Heading and curvature of the path after a distance [m], by one leapfrog step.

    Euler's elastica: ``heading' = curvature``, ``curvature' = heading x force``, force constant.
    """
    hx, hy, force_x, force_y = aux.heading_X, aux.heading_Y, aux.force_X, aux.force_Y
    curvature = aux.curvature + 0.5 * distance * (hx * force_y - hy * force_x)
    s, cosine = sincos(distance * curvature)
    hx, hy = cosine * hx - s * hy, s * hx + cosine * hy
    unit = fma(-0.5, hx * hx + hy * hy, 1.5)  # rounding errors of many turns add up
    hx, hy = unit * hx, unit * hy
    return (hx, hy, curvature + 0.5 * distance * (hx * force_y - hy * force_x))


@scalar
def reference_of(aux: Auxiliary) -> State:
    """The state of the reference."""
    return State(*aux[:6])


@scalar
def offset(y: State, reference: State, p: Parameters) -> tuple[float, float, float, float, float]:
    """From reference to ball: position [radii], rotation vector of q q_reference^-1, world."""
    inverse = (reference.w, -reference.x, -reference.y, -reference.z)
    theta = log_rotation(compose(attitude(y), inverse))
    X, Y = (y.X - reference.X) * p.inverse_radius, (y.Y - reference.Y) * p.inverse_radius
    return (X, Y, theta[0], theta[1], theta[2])


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Step of the reference; then the pose error, and its mean for success."""
    before, velocity = actuate(leading(aux, c), reference_of(aux), aux, p, c)
    reference = rolling_ball.restore(rolling_ball.step(before, velocity, p, dt))
    path = bend(aux, dt * c.largest_roll_rate * c.reference_speed * p.radius)
    X, Y, a, b, d = offset(y, reference, p)
    error = math.sqrt(X * X + Y * Y + a * a + b * b + d * d)
    error_sum, n_errors = aux.error_sum + error, aux.n_errors + 1.0
    rolled = dt * math.sqrt(u.VX * u.VX + u.VY * u.VY)
    position = (reference.X, reference.Y)
    force = (aux.force_X, aux.force_Y)
    after = Auxiliary(*attitude(reference), *position, *path, *force, error_sum, n_errors)
    terms = Terms(close=1.0 / (1.0 + 5.0 * error))
    return after, terms, rolled, error_sum <= c.bound * n_errors, False


@scalar
def observe(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> Row:
    """Offset, the action of the reference, curvature and force of its path."""
    X, Y, a, b, d = offset(y, reference_of(aux), p)
    action = leading(aux, c)
    square = p.radius * p.radius
    return (
        *limited_pair((X, Y), _FAR),
        *limited((a, b, d), math.pi),
        *limited_pair((action.VX, action.VY), 1.0),
        *limited((p.radius * aux.curvature, square * aux.force_X, square * aux.force_Y), _BENT),
    )


@dataclass(frozen=True)
class BallSteer(RollsAsTold):
    """Track a reference ball, which rolls along an elastica, in position and attitude.

    Both balls have the same kinematics, so a ball that starts without offset and copies the
    velocity of the reference keeps the offset at exactly zero. From another start the offset must
    be brought to zero while both roll. Only the relative attitude matters, and it is observed; the
    attitude itself is not (`rotation`).

    Why it is hard: five errors, two controls. To first order the attitude error turns with the
    rolling reference, $theta' = d omega + omega_reference x theta$, which makes it controllable.
    But along a straight line $theta_y - p_x$ ($x$ along the line) is constant; only the curvature
    of the path allows it to be reduced.

    Physics:
        The ball rolls as in `BallPark`.

        The paths are Euler's elasticae, $heading'' = -w^2 sin(heading - axis)$ in arc length, with
        the `wavenumber` $w$ per radius; the shortest paths of a rolling ball between poses are
        elasticae. One is the closed elastica, a figure eight (modulus 0.909), which is $9.28 / w$
        radii long; the others have a modulus of 0.6 to 1.2, and above 1 their heading turns in one
        sense only. The reference, a ball of the same radius, rolls them as polygons, one side of
        length $l = reference_speed roll_per_step radius$ in each control period. It has a heading
        $h$, a unit vector; the curvature $kappa$ of its path; and the constant force $F$ of its
        path, $(wavenumber / radius)^2$ along the axis. In a period it rolls like the ball by its
        action, $reference_speed h$ rounded to float32, while $kappa$ grows by $l / 2 (h x F)$, $h$
        then turns by $l kappa$, and $kappa$ grows by $l / 2 (h x F)$ of the new $h$. Observed are
        its action in the coming period, and $kappa$ and $F$.

    Rewards:
        `close` = $1 / (1 + 5 error)$, with the pose error $sqrt(|p|^2 + |theta|^2)$: $p$ the offset
        in radii and $theta$ the rotation vector from the attitude of the reference to that of the
        ball. Its slope is largest at zero error and nowhere zero.

    Starting State:
        The reference is at the origin, upright, at the largest curvature of its path, with uniform
        heading $h$ and either sense of curvature: $F$ along $h$, and $kappa = +-2 k wavenumber /
        radius$ with the modulus $k$. `path` is "eight", $k = 0.9089$ where the elliptic integrals
        are $K(k) = 2 E(k)$, "elastica", $k$ uniform, or "both", each in half of the episodes. The
        offset of the ball from it is uniform in a disk of `start_offset` radii, its relative
        rotation vector uniform in a ball of `start_angle`.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): the mean pose error
        of all steps so far, without that of the start, is at most `bound`.

    Reference:
        `lqr` is the linear-quadratic regulator along the elastica of the reference, which uses its
        future path. `damping` does not: it adds to the action of the reference a gradient descent
        of the error, $w = -0.6 (p_x + 1.2 theta_y, p_y - 1.2 theta_x)$ in radii per second.

        Exact: zero error for the whole episode is feasible from zero offset, as the actions of the
        reference are rounded like all others and can be copied bit for bit.

    Source:
        Elasticae: Love, *Mathematical Theory of Elasticity*, section 262; as shortest paths:
        Arthurs & Walsh 1986; Jurdjevic 1993, "The geometry of the plate-ball problem",
        doi:10.1007/BF00375605; damping control: Jurdjevic & Quinn 1978,
        doi:10.1016/0022-0396(78)90135-3.
    """

    rotation: str = "none"
    radius: Range = physical(1.0, "radius of both balls", "m")
    reference_speed: float = setting(0.5, Number("speed of the reference / largest", "1", 0.0, 1.0))
    path: str = setting("both", Choice("path of the reference", tuple(_EIGHTS)))
    wavenumber: float = setting(0.6, Number("wavenumber of the paths", "1/radius", 0.01, 1.0))
    start_offset: float = setting(1.0, Number("largest offset at the start", "radius", 0.0, 10.0))
    start_angle: float = setting(1.0, Number("largest angle at the start", "rad", 0.0, math.pi / 2))
    bound: float = setting(0.3, Number("largest mean pose error of a success", "1", 1e-6, 10.0))
    weight_close: float = setting(1.0, Number("weight of closeness", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=ROLLING_BALL,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        start=start,
        clip=clip_to_disk,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = ALONG_PATH
    counters: ClassVar = ("n_errors",)

    @property
    def share_of_eights(self) -> float:
        """Probability that the reference rolls a figure eight [1]."""
        return _EIGHTS[self.path]

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

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """Reference anywhere, on an elastica: the plane has no origin."""
        side = self.reference_speed * self.roll_per_step * p["radius"]
        wavenumber = self.wavenumber / p["radius"]
        force = wavenumber * wavenumber
        curvature = 2.0 * _MODULI[1] * wavenumber + side * force * elapsed
        return {
            **super().auxiliary_ranges(p, elapsed),
            ("reference_w", "reference_x", "reference_y", "reference_z"): UNIT,
            ("reference_X", "reference_Y"): (0.0, math.inf),
            ("heading_X", "heading_Y"): UNIT,
            "curvature": (-curvature, curvature),
            ("force_X", "force_Y"): (force, force),
            "error_sum": (0.0, math.inf),
        }
