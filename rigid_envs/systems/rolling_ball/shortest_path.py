"""The shortest path of a rolling ball from one pose to another: an elastica, found by shooting."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, exact_array, integer
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import elastica
from rigid_envs.systems.rolling_ball.controllers import difference, rolled

_EXACT = 1e-12  # radii and rad
_N_STARTS = 2000  # from either end
_SWING = 14.0  # of headings per path [rad]; starts turn no faster
_N_KEPT = 16  # of the shortest paths found by coarse polygons
_FINER = (1.4, 2.0, 2.8, 4.0, 8.0)  # polygons, by and by: in one go some would not be found again
_N_CORRECTIONS = 20
_EXACTLY = (0.0, 0.0)  # the set of poses that paths lead to is one pose


@dataclass(frozen=True)
class ShortestPath:
    """A path of a ball whose centre runs along one of Euler's elasticae.

    With s the arc length [m] and a its heading, ' = d/ds, from a(0) = heading and a'(0) =
    turning,

        X' = cos a,   Y' = sin a,   a'' = pull_y cos a - pull_x sin a

    and the ball rolls: omega_world = (-sin a, cos a, 0) / radius per arc length.

    Attributes:
        start: state of `RollingBall` where it begins, shape (6,).
        goal: state where it ends, shape (6,).
        radius: of the ball [m].
        length: of the path [m].
        heading: first heading from world x [rad].
        turning: its rate there [rad/m].
        pull: constant vector on the plane, world, shape (2,) [1/m^2].
    """

    start: Array
    goal: Array
    radius: float
    length: float
    heading: float
    turning: float
    pull: Array

    def states(self, n: int) -> Array:
        """States after 0, 1 .. n equal parts of the path, shape (n + 1, 6)."""
        y, axes = self._trace(n), rotations.exp([0.0, 0.0, self.heading])
        turn = rotations.multiply(rotations.multiply(axes, y[:, 2:6]), rotations.conjugate(axes))
        displacement = rotations.rotate(axes, np.pad(y[:, 6:8], [(0, 0), (0, 1)]))[:, :2]
        q = rotations.multiply(turn, self.start[:4])
        return np.concatenate([q, self.start[4:] + self.radius * displacement], axis=1)

    def headings(self, n: int) -> Array:
        """Headings from world x, through whole turns, after equal parts, shape (n + 1,) [rad]."""
        return self.heading + self._trace(n)[:, 0]

    def rolls(self, n: int) -> Array:
        """Displacements of n straight rolls that lead to the goal, shape (n, 2) [m].

        The chords of n equal parts, changed by Newton's method with the smallest steps until they
        lead to the goal exactly, not only to order 1 / n^2.

        Raises:
            ArithmeticError: so few sides cannot be bent to lead to the goal.
        """
        turn, displacement = difference(self.start, self.goal, self.radius)
        rolls = np.diff(self.states(n)[:, 4:], axis=0) / self.radius
        for _ in range(_N_CORRECTIONS):
            total, change = rolled(rolls)
            angle = rotations.log(rotations.multiply(turn, rotations.conjugate(total)))
            missed = np.concatenate([displacement - np.sum(rolls, axis=0), angle])
            if np.max(np.abs(missed)) <= _EXACT:
                return self.radius * rolls
            jacobian = np.concatenate([np.broadcast_to(np.eye(2), (n, 2, 2)), change], axis=1)
            flat = np.moveaxis(jacobian, 0, 1).reshape(5, 2 * n)
            rolls = rolls + (np.linalg.pinv(flat) @ missed).reshape(n, 2)
        raise ArithmeticError(f"a polygon of n = {n} sides does not lead to the goal: take more")

    def rolls_within(self, reach: float) -> Array:
        """As few straight rolls as lead to the goal with none above `reach` [m], shape (n, 2)."""
        n = max(1, math.ceil(self.length / reach))
        while True:
            try:
                rolls = self.rolls(n)
            except ArithmeticError:
                rolls = np.full((1, 2), np.inf)
            if np.max(np.linalg.norm(rolls, axis=-1)) <= reach:
                return rolls
            n += 1

    def missed(self) -> tuple[float, float]:
        """Errors of the end of the path: distance [m] and angle [rad] to the goal."""
        end = self.states(1)[-1]
        angle = rotations.distance(end[:4], self.goal[:4])
        return math.dist(end[4:], self.goal[4:]), float(angle)

    def steering(self, n: int) -> Array:
        """Switching vector V of the maximum principle, after equal parts, shape (n + 1, 2).

        A shortest path has a costate (P, M): P on the plane is constant, M in space is carried
        along by the ball, R^T M constant. The Hamiltonian ``V . u``, with V = P + (M_y, -M_x) in
        units of the radius, is constant on it and the largest over all directions u where u is its
        heading. Scaled to 1: V = (cos a, sin a) all along, which fixes P = radius^2 pull and M(0).
        Here M is carried along by the attitudes of `states`: that V is (cos a, sin a) says that
        the path is extremal. Straight lines are the only paths with V = 0 besides, for another
        costate.

        Source: Jurdjevic 1993, "The geometry of the plate-ball problem", doi:10.1007/BF00375605.
        """
        force = self.radius**2 * self.pull
        ahead = np.array([math.cos(self.heading), math.sin(self.heading)])
        rest = force - ahead
        costate = np.array([rest[1], -rest[0], -self.radius * self.turning])
        turns = rotations.multiply(self.states(n)[:, :4], rotations.conjugate(self.start[:4]))
        carried = rotations.rotate(turns, costate)
        return force + np.stack([carried[:, 1], -carried[:, 0]], axis=-1)

    def _trace(self, n: int) -> Array:
        """(a - heading, a', q, position) of `kernels.elastica` after equal parts, (n + 1, 8)."""
        n = integer(n, "n", 1)
        c, s = math.cos(self.heading), math.sin(self.heading)
        along, across = self.length**2 * (np.array([[c, s], [-s, c]]) @ self.pull)
        turning, length = self.turning * self.length, self.length / self.radius
        x = np.array([self.heading, turning, along, across, length])
        y = np.empty((n + 1, 8))
        elastica.trace(x, math.ceil(sides(x) / n), y)
        return y


def shortest_path(
    start: npt.ArrayLike, goal: npt.ArrayLike, *, radius: float = 1.0
) -> ShortestPath:
    """The shortest path that rolls a ball from one pose to another, without slipping or spinning.

    Paths that can be shortest fulfil Pontryagin's maximum principle (see `ShortestPath.steering`):
    the centre runs along an elastica. Five numbers, the first heading and its rate, the pull and
    the length, are to solve the five equations of the goal. Newton's method is started from 2000
    elasticae from either end, always the same, that are spread evenly and turned to where they lead
    nearest; of all solutions the shortest is taken. (A straight roll, the one extremal that is
    abnormal too, is looked for first: where it leads to the goal nothing is shorter.)

    Newton's method cannot prove that there is no shorter solution.

    Args:
        start: state (w, x, y, z, X, Y) of `RollingBall`, shape (6,).
        goal: as `start`.
        radius: of the ball [m].

    Raises:
        ValueError: bad states, more than one, or a radius that is not positive.
        ArithmeticError: no path was found.

    Source: Arthurs & Walsh 1986, "On Hammersley's minimum problem for a rolling sphere",
    doi:10.1017/S0305004100064501; Jurdjevic 1993, doi:10.1007/BF00375605.
    """
    turn, displacement = difference(start, goal, radius)
    exact_array(start, "start", 6), exact_array(goal, "goal", 6)
    x = _straight(turn, displacement)
    if x is None:
        x = _search(
            np.concatenate([turn, displacement]), np.concatenate(difference(goal, start, radius))
        )
    length = radius * float(x[4])
    c, s = math.cos(x[0]), math.sin(x[0])
    bends = x[1:4] / (length or 1.0)  # nothing bends where the path is a point
    turning, pull = float(bends[0]), np.array([[c, -s], [s, c]]) @ bends[1:] / (length or 1.0)
    ends = np.array(start, dtype=np.float64), np.array(goal, dtype=np.float64)
    return ShortestPath(*ends, radius, length, float(x[0]), turning, pull)


def _straight(turn: Array, displacement: Array) -> Array | None:
    """The straight roll, if it leads to the goal, as a row of `kernels.elastica`."""
    total, _ = rolled(displacement[None])
    if rotations.distance(total, turn) > _EXACT:
        return None
    return np.array(
        [math.atan2(displacement[1], displacement[0]), 0.0, 0.0, 0.0, math.hypot(*displacement)]
    )


def _search(target: Array, back: Array) -> Array:
    """The shortest path found to a pose (turn, displacement), as a row of `kernels.elastica`.

    Or to the pose that leads back from it, turned round: what is hard to find from one end, because
    it bends much there, may be easy to find from the other.
    """
    there, here = _shortest(target), _shortest(back)
    x = there if there[4] <= here[4] else _turned_round(here)
    if np.isfinite(x[4]):
        elastica.shoot_rows(x[None], target, _EXACTLY, 1.0, sides(x))
    if np.isinf(x[4]):
        raise ArithmeticError(f"no path turns a ball by {target[:4]} over {target[4:]} radii")
    return x


def _turned_round(x: Array) -> Array:
    """The same path from its end to its beginning."""
    ends = np.empty((2, 8))
    elastica.trace(x, sides(x), ends)
    a, rate = ends[1, :2]
    c, s = math.cos(a), math.sin(a)
    return np.array([x[0] + a + math.pi, -rate, c * x[2] + s * x[3], c * x[3] - s * x[2], x[4]])


def _shortest(target: Array) -> Array:
    """The shortest of the paths found by Newton's method from all starts; infinite without any."""
    x = _starts(target)
    n = math.ceil(10 + math.hypot(*target[4:]))
    elastica.face_rows(x, target, n)
    elastica.shoot_rows(x, target, _EXACTLY, 1.0, n)
    _, different = np.unique(np.round(x[:, 4], 6), return_index=True)
    x = x[different[:_N_KEPT]]
    for finer in _FINER:
        elastica.shoot_rows(x, target, _EXACTLY, 1.0, math.ceil(finer * n))
    return np.asarray(x[np.argmin(x[:, 4])])


def _starts(target: Array) -> Array:
    """Initial guesses of the shooting method, from a lower bound of the length upwards."""
    theta, displacement = rotations.log(target[:4]), target[4:]
    distance, angle = math.hypot(*displacement), float(np.linalg.norm(theta))
    twist = math.sqrt(2.0 * math.pi * abs(theta[2]))  # a half circle: area length^2 / (2 pi)
    mismatch = math.cbrt(math.hypot(theta[0] + displacement[1], theta[1] - displacement[0]))
    least = max(distance, angle, twist)
    most = max(distance + min(5.0, 1.5 * twist + 7.0 * mismatch), 1.1 * least)
    u = evenly(_N_STARTS, 4)
    rate = 1.0 + (max(9.0, 1.2 * most) - 1.0) * u[:, 1]
    angle_of_pull = 2.0 * math.pi * u[:, 2]
    columns = (
        np.zeros(_N_STARTS),
        _SWING * (2.0 * u[:, 0] - 1.0),
        rate**2 * np.cos(angle_of_pull),
        rate**2 * np.sin(angle_of_pull),
        least * (most / least) ** u[:, 3],
    )
    return np.stack(columns, axis=-1)


def evenly(n: int, dimensions: int) -> Array:
    """Points of the unit cube, spread evenly: powers of the root of ``g^(d + 1) = g + 1``."""
    g = 1.5
    for _ in range(100):
        g = (1.0 + g) ** (1.0 / (dimensions + 1))
    powers = g ** np.arange(-1.0, -dimensions - 1.0, -1.0)
    return np.asarray((0.5 + np.arange(n)[:, None] * powers) % 1.0)


def sides(x: Array, density: float = 200.0) -> int:
    """Steps of fourth order that lead to the end of a path within 1e-12, above rounding.

    Measured, the error is below 2e-3 (rate / n)^4 with the rate of heading and ball over the path.

    Args:
        x: Row of `elastica`.
        density: Steps for a unit of the rate.
    """
    rate = math.sqrt(x[1] ** 2 + 4.0 * math.hypot(x[2], x[3]) + x[4] ** 2)
    return math.ceil(density * rate) + 1
