"""Roll a ball to a pose that is drawn in every episode."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.checks import Array
from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import algebra, randoms
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import cbrt, fma, select, sincos
from rigid_envs.engine.episode import Episode, clip_to_disk, single
from rigid_envs.systems.rolling_ball.dynamics import ROLLING_BALL, Input, Parameters, State
from rigid_envs.systems.rolling_ball.symmetry import BODY_AXES, REFLECTION, TURN
from rigid_envs.systems.rolling_ball.tasks import ball_park
from rigid_envs.systems.rolling_ball.tasks.shared import Action, RollsAsTold, actuate
from rigid_envs.tasks.fields import Entry, span
from rigid_envs.tasks.parts import limited_pair, single_matrix
from rigid_envs.tasks.reduction import Reduction, turned_back
from rigid_envs.tasks.symmetry import TRANSLATION
from rigid_envs.tasks.task import UNIT, AuxiliaryRanges

# Reduced coordinates of `BallParkGoal`: the pose relative to the goal, and rest at the goal.

_INSIDE = 1.0 - 1e-6  # of the tolerances: there the rounded goals are reached too

_FORMULAS = """
    Frame, entries and actions are those of `BallPark`, with $p$ the offset from the goal in radii
    and $theta$ the rotation vector from the attitude of the goal to that of the ball, of its exact
    pose. The ball rests where distance and angle are at most $1 - 1e-6$ of their tolerances.
"""


class _Frame(NamedTuple):
    """Frame of the pose; `away` is 0 at the goal, else 1."""

    cosine: float
    sine: float
    side: float
    away: float


@scalar
def _from_goal(y: Any, aux: Any, p: Any) -> tuple[float, float, algebra.Quaternion]:
    """Offset [radii] from the goal, and rotation from its attitude in world axes."""
    inverse = (aux.goal_w, -aux.goal_x, -aux.goal_y, -aux.goal_z)
    q = algebra.compose(algebra.attitude(y), inverse)
    return (y.X - aux.goal_X) * p.inverse_radius, (y.Y - aux.goal_Y) * p.inverse_radius, q


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> _Frame:
    """Frame of the pose, and whether the ball is at the goal."""
    X, Y, q = _from_goal(y, aux, p)
    frame = ball_park.pose_frame(X, Y, q)
    _, cosine = sincos(0.5 * _INSIDE * c.largest_angle)
    distance = p.radius * math.sqrt(fma(X, X, Y * Y))
    there = (distance <= _INSIDE * c.position_tolerance) & (abs(q[0]) >= cosine)
    return _Frame(frame.cosine, frame.sine, frame.side, away=select(there, 0.0, 1.0))


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float]:
    """World components of an action in the frame of the pose; none at the goal."""
    along, left = turned_back(frame, a[0], a[1])
    return single(frame.away * along), single(frame.away * left)


# Park a ball at a random pose: the goal environment of parking.


class Terms(NamedTuple):
    """Reward terms of `BallParkGoal`."""

    reached: float
    distance: float


class Constants(NamedTuple):
    """Largest rolling rate [rad/s], tolerances [m, rad], half side of the square of poses [m].

    And the middle of the radii [m].
    """

    largest_roll_rate: float
    position_tolerance: float
    largest_angle: float
    start_half_width: float
    middle_radius: float


class Auxiliary(NamedTuple):
    """Attitude and position [m] of the goal."""

    goal_w: float = 1.0
    goal_x: float = 0.0
    goal_y: float = 0.0
    goal_z: float = 0.0
    goal_X: float = 0.0
    goal_Y: float = 0.0


class Goal(NamedTuple):
    """An observed pose: position [m] and the entries of R, row by row."""

    X: float
    Y: float
    R11: float
    R12: float
    R13: float
    R21: float
    R22: float
    R23: float
    R31: float
    R32: float
    R33: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """Positions of ball and goal uniform in a square, both attitudes uniform on SO(3)."""
    side = 2.0 * c.start_half_width
    X, Y = side * (randoms.uniform(stream, 0) - 0.5), side * (randoms.uniform(stream, 1) - 0.5)
    goal_X = side * (randoms.uniform(stream, 2) - 0.5)
    goal_Y = side * (randoms.uniform(stream, 3) - 0.5)
    q, goal = randoms.quaternion(stream, 1 << 20), randoms.quaternion(stream, 1 << 21)
    return State(*q, X, Y), Auxiliary(*goal, goal_X, goal_Y)


@scalar
def desired_state(aux: Auxiliary) -> State:
    """The state of a ball at the goal."""
    return State(*aux)


@scalar
def pose(y: State) -> algebra.Row:
    """Entries of a `Goal` for the pose of y, rounded to float32 as in the observation."""
    X, Y = limited_pair((y.X, y.Y), ball_park.FAR)
    return (single(X), single(Y), *single_matrix(algebra.attitude(y)))


@scalar
def judge(achieved: Goal, desired: Goal, c: Constants) -> tuple[Terms, bool]:
    """Reached with distance and angle within tolerance; the angle of tr(R^T R') = 1 + 2 cos."""
    dx, dy = achieved.X - desired.X, achieved.Y - desired.Y
    turn = algebra.matrix_product(achieved[2:], desired[2:])
    trace = turn[0] + turn[4] + turn[8]
    near: bool = dx * dx + dy * dy <= c.position_tolerance * c.position_tolerance
    _, cosine = sincos(c.largest_angle)
    reached = near & (trace >= 1.0 + 2.0 * cosine)
    apart = State(*algebra.unit_quaternion(turn), dx, dy)
    distance, twist, mismatch, _ = ball_park.misplacement(apart, 1.0 / c.middle_radius)
    homogeneous = min(distance, ball_park.FAR) + twist + cbrt(min(mismatch, ball_park.FAR))
    return (
        Terms(reached=select(reached, 0.0, -1.0), distance=select(reached, 0.0, -homogeneous)),
        reached,
    )


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Whether the goal is reached, and the distance rolled."""
    terms, success = judge(Goal(*pose(y)), Goal(*pose(desired_state(aux))), c)
    rolled = dt * math.sqrt(u.VX * u.VX + u.VY * u.VY)
    return aux, terms, rolled, success, False


@scalar
def observe(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> algebra.Row:
    """Achieved and desired pose, and the position in radii."""
    return (*pose(y), *pose(desired_state(aux)), *ball_park.offset(y, p))


@scalar
def observe_reduced(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> algebra.Row:
    """Achieved and desired pose, and the pose relative to the goal."""
    X, Y, q = _from_goal(y, aux, p)
    return (
        *pose(y),
        *pose(desired_state(aux)),
        *ball_park.pose_seen(ball_park.pose_frame(X, Y, q), X, Y, q),
    )


GOAL_POSE = Reduction(
    group="E(2) x SO(3)",
    frame=(
        "$x$ along the offset from the goal, mirrored so that $theta_z$ of the rotation from the "
        "goal is not negative. At the goal the action has no effect: the ball rests."
    ),
    symmetries=(TRANSLATION, TURN, REFLECTION, BODY_AXES),
    features=ball_park.POSE,
    observe=observe_reduced,
    Frame=_Frame,
    frame_of=frame_of,
    turn=turn,
    formulas=_FORMULAS,
)
"""Reduction of `BallParkGoal`: motions of the plane, and the choice of the body axes."""


@dataclass(frozen=True)
class BallParkGoal(RollsAsTold):
    """Park the ball at a pose drawn in every episode; sparse reward.

    The ball of `BallPark`, as a goal environment: the observation is a dictionary, the goals are
    position and rotation matrix, and `compute_reward` gives the reward of any pair of goals. The
    rest of the observation does not depend on the desired goal, so hindsight relabelling with any
    other goal is exact.

    Why it is hard: five dimensions are reached with two velocities, by manoeuvres only, and the
    reward does not change before the goal. One in three million poses in the square is within
    tolerance of a goal.

    Physics:
        The ball rolls as in `BallPark`.

        Rolling is invariant under translation and under the choice of body axes. So the motion from
        pose to goal depends on their difference only: the displacement, and the rotation from one
        attitude to the other in world axes.

    Rewards:
        `reached` = 0 where the distance to the goal is at most `position_tolerance` and the angle
        between the attitudes at most `angle_tolerance`, else -1: the return is minus the number of
        steps away from the goal. The observed (float32) goals are compared, so recomputed rewards
        equal those of `step` bit for bit.

        With $R$ of the achieved and $R*$ of the desired goal, the angle is compared as $tr(R R*^T)
        >= 1 + 2 cos(min(angle_tolerance, pi))$.

        `distance` = 0 there too, else minus the homogeneous distance of `BallPark` from the goal,
        the sum of its terms position, twist and mismatch, is a dense term of the default weight 0.
        Of balls of several radii it is that of the middle of their range. As rounded matrices are
        not quite orthogonal, $theta$ is that of the longest row of $4 q q^T$, whose entries are
        sums of those of $R R*^T$, as a unit quaternion.

    Starting State:
        Positions of ball and goal uniform in the square $|X|, |Y| <= start_half_width$, both
        attitudes uniform on $SO(3)$.

    Episode End:
        The episode continues at the goal, where staying has the largest reward. Success
        (`info["is_success"]`) is given for every step; the success of an episode is that of its
        last step.

    Reference:
        `shortest_path` rolls from pose to goal as in `BallPark` and then rests; `three_rolls` takes
        three straight rolls.

    Source:
        Jurdjevic 1993, "The geometry of the plate-ball problem", doi:10.1007/BF00375605; three
        rolls: Hammersley 1983, "Oxford commemoration ball", LMS Lecture Notes 79; hindsight
        experience replay: Andrychowicz et al. 2017, arXiv:1707.01495; quaternion of a matrix:
        Shepperd 1978, doi:10.2514/3.55767b.
    """

    start_half_width: float = setting(
        2.0, Number("half side of the square of poses", "m", 0.0, 20.0)
    )
    position_tolerance: float = setting(
        0.1, Number("largest distance at the goal", "m", 1e-6, 10.0)
    )
    angle_tolerance: float = setting(0.15, Number("largest angle at the goal", "rad", 1e-3, 3.2))
    weight_reached: float = setting(
        1.0, Number("weight of -1 per step away from the goal", "1", -1e3, 1e3)
    )
    weight_distance: float = setting(
        0.0, Number("weight of minus the homogeneous distance", "1", -1e3, 1e3)
    )

    episode: ClassVar = Episode(
        dynamics=ROLLING_BALL,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        Goal=Goal,
        start=start,
        clip=clip_to_disk,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
        judge=judge,
    )
    reduction: ClassVar = GOAL_POSE

    @property
    def largest_angle(self) -> float:
        """Largest angle at the goal [rad]: `angle_tolerance`, at most pi."""
        return min(self.angle_tolerance, math.pi)

    @property
    def middle_radius(self) -> float:
        """Middle of the range of radii [m]."""
        return 0.5 * sum(span(self.radius))

    def features(self) -> tuple[Entry, ...]:
        """Achieved and desired pose, position in radii."""
        goal = (
            *(Entry(k, "m", "world", -ball_park.FAR, ball_park.FAR) for k in "XY"),
            *(Entry(f"R{i}{j}", "1", "body to world", -1.0, 1.0) for i in "123" for j in "123"),
        )
        return (*goal, *goal, *ball_park.OFFSET)

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """Goals are attitudes, anywhere where they are observed: the plane has no origin."""
        seen, names = (-ball_park.FAR, ball_park.FAR), ("goal_w", "goal_x", "goal_y", "goal_z")
        return {names: UNIT, "goal_X": seen, "goal_Y": seen}
