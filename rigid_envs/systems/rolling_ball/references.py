"""Controllers bound to the tasks of a ball, what they read in observations, and bounds."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array, Bools
from rigid_envs.base.settings import refusal
from rigid_envs.control.planning import Conditions
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import TheoreticalLimit, _rows
from rigid_envs.scores.policies import Controller, Rows, Script, States, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, attitude, entries, goal_attitude
from rigid_envs.systems.rolling_ball import controllers
from rigid_envs.systems.rolling_ball.least_path import least_paths, rolls_along
from rigid_envs.systems.rolling_ball.path_bounds import are_bounds
from rigid_envs.systems.rolling_ball.shortest_path import shortest_path
from rigid_envs.systems.rolling_ball.tasks.ball_grid import BallGrid
from rigid_envs.systems.rolling_ball.tasks.ball_park import BallPark
from rigid_envs.systems.rolling_ball.tasks.ball_park_goal import BallParkGoal
from rigid_envs.systems.rolling_ball.tasks.ball_steer import BallSteer
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.fields import span
from rigid_envs.tasks.task import Task

# Theoretical limits of metrics: optima and bounds from each start, in closed form.


_HOME = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def _roll(envs: RigidVectorEnv) -> Array:
    """Least length [m] of a path of a ball from its pose to within tolerance of its goal."""
    task: Any = envs.task
    y, goal = envs.y, _goals(task, envs)
    distance = np.linalg.norm(y[:, 4:6] - goal[..., 4:], axis=-1) - task.position_tolerance
    angle = rotations.distance(y[:, :4], goal[..., :4]) - task.angle_tolerance
    return np.asarray(np.maximum(np.maximum(distance, _rows(envs, "radius") * angle), 0.0))


def least_rolls(envs: RigidVectorEnv, known: Array) -> tuple[Array, Array]:
    """Lengths [m] of the shortest paths found to within tolerance of the goals, and plans on them.

    Where a known path is shorter than all that are found, it stands.

    Args:
        envs: Rows that have just begun.
        known: Actions that lead there, shape (T, n, 2); zeros where nothing is known.

    Returns:
        Shape (n,), infinite where there is none, and actions along the paths, shape (T', n, 2).
    """
    task: Any = envs.task
    radii, step = _rows(envs, "radius"), task.roll_per_step
    tolerances = task.position_tolerance, task.angle_tolerance
    paths = least_paths(envs.y[:, :6], _goals(task, envs), radii, *tolerances, step * known)
    rolled = step * np.linalg.norm(known, axis=-1).sum(axis=0)
    rolled[rolled == 0.0] = np.inf
    found = np.isfinite(paths[:, 4]) & (paths[:, 4] <= rolled)
    n = np.ceil(np.where(found, paths[:, 4], step) / step).astype(int)
    actions = np.zeros((max(len(known), n.max()), len(n), 2))
    actions[: len(known)] = np.where(found[:, None], 0.0, known)
    for k in np.flatnonzero(found & (n > 0)):
        actions[: n[k], k] = rolls_along(paths[k], n[k]) / step
    return radii * np.minimum(paths[:, 4], rolled), actions


def are_least_rolls(envs: RigidVectorEnv, lengths: Array) -> Bools:
    """Whether it is proven that no path to within tolerance of the goals is shorter than a length.

    Args:
        envs: Rows that have just begun.
        lengths: Shape (n,) [m].
    """
    task: Any = envs.task
    radii = _rows(envs, "radius")
    targets = np.concatenate(
        controllers.difference(_goals(task, envs), envs.y[:, :6], radii), axis=-1
    )
    edges = task.position_tolerance / radii, float(task.angle_tolerance)
    return are_bounds(targets, *edges, lengths / radii)


def _zero(envs: RigidVectorEnv) -> Array:
    return np.zeros(envs.num_envs)


def _moves(envs: RigidVectorEnv) -> Array:
    """Fewest quarter rolls home; a ball that is home already rolls out and back."""
    task: Any = envs.task
    moves = controllers.QuarterRolls(task.system(), task.start_cells).moves(envs.y)
    return np.where(moves == 0, 2.0, moves)


def _rolled(envs: RigidVectorEnv) -> Array:
    return np.asarray(0.5 * np.pi * _rows(envs, "radius") * _moves(envs))


def _moved(envs: RigidVectorEnv) -> Array:
    return np.asarray(envs.task.dt * _moves(envs))


BALL_PATH = TheoreticalLimit("bound", "$max(distance, radius angle)$, less the tolerances", _roll)
BALL_STEER_ERROR = TheoreticalLimit("bound", "no error; feasible from no offset only", _zero)
GRID_PATH = TheoreticalLimit("exact", "the fewest moves, by breadth-first search", _rolled)
GRID_TIME = TheoreticalLimit("exact", "the fewest moves, by breadth-first search", _moved)


# Controllers for the tasks of a ball; of drawn mass and inertia they know the middle.

_REFERENCE = tuple(f"reference_{name}" for name in "wxyzXY")  # pose of the ball to be followed
_HEADING = ("heading_X", "heading_Y")  # of its path
_LONGEST = 30  # moves of an episode on the grid
_AHEAD, _ANEW = 200, 100  # steps that a follower looks ahead, and after which it looks again


def straight_rolls(task: Task, states: States, rows: Rows) -> Array:
    """Three straight rolls from where rows are to their goals, shape (n, 3, 2) [m]."""
    goals, radii = _goals(task, states)[rows], _radii(states)[rows]
    return np.asarray(controllers.three_rolls(states.y[rows, :6], goals, radius=radii))


def rolled(task: BallPark | BallParkGoal) -> Controller:
    """Three straight rolls at the largest speed."""

    def plan(states: States, rows: Rows) -> Array:
        reach = task.roll_per_step * _radii(states)[rows]
        return controllers.roll_along(straight_rolls(task, states, rows), reach).actions

    return Script(plan)


def along_shortest_path(task: BallPark | BallParkGoal) -> Controller:
    """The shortest path, an elastica, rolled as a polygon with one side per step."""

    def plan(states: States, rows: Rows) -> Array:
        goals, radii = _goals(task, states)[rows], _radii(states)[rows]
        reach = task.roll_per_step * radii
        each = [
            shortest_path(start, goal, radius=radius).rolls_within(most)
            for start, goal, radius, most in zip(states.y[rows], goals, radii, reach, strict=True)
        ]
        longest = max(map(len, each))
        rolls = np.stack([np.pad(sides, [(0, longest - len(sides)), (0, 0)]) for sides in each])
        return controllers.roll_along(rolls, reach).actions

    return Script(plan)


def damped(task: BallSteer) -> Controller:
    """Gradient descent of the pose error, without looking ahead."""
    controller = controllers.DampedFollower(system_of(task), task.roll_per_step / task.dt)

    def policy(states: States) -> Array:
        heading = states.auxiliary(*_HEADING)
        return controller(states.y, states.auxiliary(*_REFERENCE), _speed(task) * heading)

    return policy


def far_sighted(task: BallSteer) -> Controller:
    """Linear-quadratic regulator along the elastica that the reference is on."""
    controller = controllers.FarSightedFollower(
        system_of(task), task.roll_per_step / task.dt, task.dt
    )
    speed = _speed(task)

    def plan(states: States, rows: Rows) -> Array:
        heading = states.auxiliary(*_HEADING)[rows]
        force = states.auxiliary("force_X", "force_Y")[rows]
        path = heading, states.auxiliary("curvature")[rows], force
        return controller.regulator(
            speed * controllers.elastica_headings(*path, speed * task.dt, _AHEAD)
        ).gain

    def follow(states: States, gain: Array) -> Array:
        heading = speed * states.auxiliary(*_HEADING)
        return controller(states.y, states.auxiliary(*_REFERENCE), heading, gain)

    return Script(plan, follow, _ANEW)


def quarter_rolls(task: BallGrid) -> Controller:
    """Shortest path home, by breadth-first search."""
    return feedback(controllers.QuarterRolls(system_of(task), task.start_cells + _LONGEST))


def _goals(task: Task, states: States) -> Array:
    """Pose that every row is to be parked in, shape (N, 6)."""
    if task.n_goal:
        return states.auxiliary(*task.aux_names)
    return np.tile(_HOME, (len(states.y), 1))


def _radii(states: States) -> Array:
    """Radius of the ball of every row, shape (N,) [m]."""
    systems: Any = states.systems
    return np.array([ball.radius for ball in systems])


def _speed(task: BallSteer) -> float:
    """Speed of the reference [m/s]."""
    radius: float = system_of(task).radius
    return task.reference_speed * task.roll_per_step / task.dt * radius


# Decoders of the tasks of a ball: position, attitude, and what they are to become.
#
# Positions in radii are those of a ball of the middle radius: of what a controller makes of them,
# actions that are fractions of the largest, a radius that is drawn cancels.

_PLACE = ("X / radius", "Y / radius")


def ball_park(task: BallPark) -> Decoder:
    """Position and attitude."""
    ball = system_of(task)
    q, place = attitude(task), entries(task, *_PLACE)
    return lambda seen: Decoded(ball, ball.state(q=q(seen), position=ball.radius * place(seen)))


def ball_park_goal(task: BallParkGoal) -> Decoder:
    """Pose and goal from the goals, which are in metres."""
    low, high = span(task.radius)
    if low < high:
        raise refusal("radius", task.radius, "a number: goals are in metres, and it is not seen")
    ball = system_of(task)
    here, there = goal_attitude(task, "achieved_goal"), goal_attitude(task, "desired_goal")
    place = entries(task, "X", "Y", part="achieved_goal")
    end = entries(task, "X", "Y", part="desired_goal")

    def decode(seen: Array) -> Decoded:
        goal = np.concatenate([there(seen), end(seen)], axis=-1)
        return Decoded(
            ball,
            ball.state(q=here(seen), position=place(seen)),
            dict(zip(task.aux_names, goal.T, strict=True)),
        )

    return decode


def ball_steer(task: BallSteer) -> Decoder:
    """Pose relative to the reference, which is put upright at the origin, and its path ahead."""
    ball = system_of(task)
    place = entries(task, "dX / radius", "dY / radius")
    turn = entries(task, "theta_x", "theta_y", "theta_z")
    action = entries(task, "VX of the reference", "VY of the reference")
    curvature = entries(task, "curvature * radius")
    force = entries(task, "force_X * radius^2", "force_Y * radius^2")

    def decode(seen: Array) -> Decoded:
        y = ball.state(q=rotations.exp(turn(seen)), position=ball.radius * place(seen))
        home = np.tile(ball.state(), (len(seen), 1))
        speed = np.linalg.norm(action(seen), axis=-1, keepdims=True)
        heading = action(seen) / np.where(speed > 0.0, speed, 1.0)
        path = np.concatenate([home, heading, force(seen) / ball.radius**2], axis=-1)
        known = dict(zip(_PATH, path.T, strict=True))
        return Decoded(ball, y, {**known, "curvature": curvature(seen) / ball.radius})

    return decode


def ball_grid(task: BallGrid) -> Decoder:
    """Cell and attitude, the nearest of those that there are: noise does not lead off the grid."""
    ball = system_of(task)
    turn, place = attitude(task), entries(task, "X / cell", "Y / cell")
    side = 0.5 * np.pi * ball.radius

    def decode(seen: Array) -> Decoded:
        nearest = np.argmax(np.abs(turn(seen) @ controllers.attitudes().T), axis=-1)
        cells = np.rint(place(seen))
        return Decoded(ball, ball.state(q=controllers.attitudes()[nearest], position=side * cells))

    return decode


_PATH = (*_REFERENCE, *_HEADING, "force_X", "force_Y")
"""Parts of the auxiliary state of `BallSteer`."""


# What success asks of a motion, for planning.


def _offset(y: Array, goal: Array) -> tuple[Array, Array]:
    """Offset and rotation vector from a goal."""
    turn = rotations.multiply(y[:, :4], rotations.conjugate(goal[:, :4]))
    return y[:, 4:6] - goal[:, 4:], rotations.log(turn)


def _pose(y: Array, goal: Array | None, task: Any) -> list[Array]:
    """Offset and rotation vector from a goal, or from the origin, upright, over the tolerances."""
    place, turn = (y[:, 4:6], rotations.log(y[:, :4])) if goal is None else _offset(y, goal)
    return [place / task.position_tolerance, turn / task.angle_tolerance]


def _parked(core: Core) -> list[Array]:
    goal = core.auxiliary(*core.task.aux_names) if core.task.n_goal else None
    return _pose(core.y, goal, core.task)


def _beside(core: Core) -> list[Array]:
    """Pose error over the largest mean of it: so small in every step, it is so in the mean."""
    task: Any = core.task
    place, turn = _offset(core.y, core.auxiliary(*_REFERENCE))
    radius = core.parameters["radius"][:, None]
    return [np.concatenate([place / radius, turn], axis=-1) / task.bound]


_POSE = ("w", "x", "y", "z", "X", "Y")
PARKED, BESIDE = Conditions(_POSE, _parked), Conditions(_POSE, _beside)
