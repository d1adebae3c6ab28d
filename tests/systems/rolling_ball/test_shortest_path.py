"""Shortest paths and elasticae: extremal, never beaten, symmetric; and rolled."""

import math
import sys
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize
from scipy.stats import qmc

from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball import elastica
from rigid_envs.systems.rolling_ball.controllers import three_rolls
from rigid_envs.systems.rolling_ball.shortest_path import ShortestPath, evenly, shortest_path
from tests.refusals import refuses
from tests.systems.measures import seeds

# Rolling along elasticae, against closed forms, another integrator and differences.


# first heading, a'(0), X, Y, length
WAVE = np.array([0.4, 1.0, 12.0, -7.0, 5.0])
LOOP = np.array([-2.0, 9.0, -20.0, 5.0, 6.0])
HOME = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


EXACTLY = (0.0, 0.0)  # the set is one pose


def traced(x, parts, n):
    out = np.empty((parts + 1, 8))
    elastica.trace(np.asarray(x, dtype=np.float64), n, out)
    return out


def pose(x, n):
    """Where a path leads to, with its first heading, shape (6,)."""
    end, axes = traced(x, 1, n)[-1], rotations.exp([0.0, 0.0, x[0]])
    q = rotations.multiply(rotations.multiply(axes, end[2:6]), rotations.conjugate(axes))
    return np.concatenate([q, rotations.rotate(axes, [*end[6:8], 0.0])[:2]])


def integrated(x):
    """The end of a path by an integrator of order eight, relative tolerance 1e-13."""

    def rate(_, y):
        _, _, X, Y, length = x
        s, c = math.sin(y[0]), math.cos(y[0])
        omega = length * np.array([-s, c, 0.0])
        spin = np.concatenate([[-omega @ y[3:6]], y[2] * omega + np.cross(omega, y[3:6])])
        return np.concatenate([[y[1], Y * c - X * s], 0.5 * spin, [length * c, length * s]])

    y = np.array([0.0, x[1], 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    return solve_ivp(rate, (0.0, 1.0), y, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


@pytest.mark.parametrize("x", [WAVE, LOOP])
def test_paths_are_elasticae_that_the_ball_rolls_along(x):
    # truncation falls below 1e-12 at 4000 steps; the reference is good to about 1e-12 itself
    np.testing.assert_allclose(traced(x, 1, 4000)[-1], integrated(x), rtol=0, atol=1e-11)


@pytest.mark.parametrize("x", [WAVE, LOOP])
def test_the_order_is_four(x):
    exact = traced(x, 1, 4000)[-1]
    error = [np.linalg.norm(traced(x, 1, n)[-1] - exact) for n in (32, 64, 128)]
    np.testing.assert_allclose(np.log2(np.divide(error[:-1], error[1:])), 4.0, atol=0.2)


def test_without_pull_and_turning_the_ball_rolls_straight():
    end = traced([0.0, 0.0, 0.0, 0.0, 7.0], 1, 50)[-1]
    np.testing.assert_allclose(end[6:8], [7.0, 0.0], atol=1e-14)
    # 250 products of quaternions, each rounded by 1.1e-16 in every entry
    np.testing.assert_allclose(end[2:6], rolling_ball.roll_straight([7.0, 0.0], 1.0), atol=1e-14)


@pytest.mark.parametrize("rho", [0.8, 0.05])
def test_without_pull_the_ball_rolls_round_a_circle(rho):
    end = traced([0.0, 2.0 * np.pi, 0.0, 0.0, 2.0 * np.pi * rho], 1, 2000)[-1]
    # it starts along x, at the lowest point of the circle
    around = rolling_ball.circle_holonomy(rho, 1.0, phase=-0.5 * np.pi)
    # 20 000 additions to a heading of up to 2 pi, each rounded by up to 4.4e-16
    np.testing.assert_allclose(end[6:8], 0.0, atol=1e-11)
    assert rotations.distance(end[2:6], around) < 1e-11
    circle = 2.0 * np.pi * rho, 0.0, 1.0 / rho, np.zeros(2)
    assert max(ShortestPath(HOME, np.append(around, [0.0, 0.0]), 1.0, *circle).missed()) < 1e-11


def test_a_path_in_parts_is_the_path():
    whole, parts = traced(LOOP, 1, 400), traced(LOOP, 8, 50)
    np.testing.assert_allclose(parts[-1], whole[-1], atol=1e-13)
    np.testing.assert_array_equal(parts[0], [0.0, LOOP[1], 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def linearised(x, target, n=10):
    m = np.empty((5, 6))
    missed = elastica.linearise(tuple(x), tuple(target), EXACTLY, n, m)
    np.testing.assert_array_equal(missed, np.max(np.abs(m[:, 5])))
    return m


@pytest.mark.parametrize("x", [WAVE, LOOP])
def test_derivatives_are_those_of_what_is_missed(x):
    target, step = pose(x, 10), 1e-5
    m = linearised(x, target)
    assert np.max(np.abs(m[:, 5])) < 1e-14
    for k in range(5):
        to, fro = (linearised(x + side * step * np.eye(5)[k], target)[:, 5] for side in (1, -1))
        # central differences: truncation step^2 times third derivatives of up to 10
        np.testing.assert_allclose((fro - to) / (2.0 * step), m[:, k], rtol=0, atol=2e-9)


@pytest.mark.parametrize("x", [WAVE, LOOP])
def test_newtons_method_finds_back_to_a_path(x):
    rows = x + 0.03 * np.random.default_rng(0).uniform(-1.0, 1.0, (20, 5))
    elastica.shoot_rows(rows, pose(x, 30), EXACTLY, 1.0, 30)
    # to 1e-12 of the pose, times the condition of the equations, below 100 here
    np.testing.assert_allclose(rows, np.broadcast_to(x, (20, 5)), atol=1e-10)


def test_where_newtons_method_finds_no_path_the_length_is_infinite():
    far = np.array([1.0, 0.0, 0.0, 0.0, 1e6, 0.0])
    rows = WAVE[None].copy()
    elastica.shoot_rows(rows, far, EXACTLY, 1.0, 10)
    assert np.isinf(rows[0, 4])


def test_starts_face_the_target():
    rng = np.random.default_rng(0)
    rows = np.column_stack([np.zeros(30), rng.uniform(-9, 9, (30, 3)), rng.uniform(1, 7, 30)])
    facing, target = rows.copy(), pose(LOOP, 50)
    elastica.face_rows(facing, target, 50)

    def misfit(heading, row):
        end = pose([heading, *row[1:]], 50)
        same = abs(end[:4] @ target[:4])
        return np.sum((end[4:] - target[4:]) ** 2) + 4.0 * (2.0 - 2.0 * same)

    for row, turned in zip(rows, facing, strict=True):
        grid = [misfit(heading, row) for heading in np.linspace(-np.pi, np.pi, 200)]
        assert misfit(turned[0], row) <= min(grid) + 1e-12
        np.testing.assert_array_equal(turned[1:], row[1:])


# Shortest paths: extremal, never beaten, symmetric; and rolled by an environment.


EXACT = 1e-10  # m and rad; 1e-12 is solved for, at truncation below that
FEW, ALL = 8, 100
MEANS = {
    FEW: 5.44436,
    ALL: 6.03282,
}  # of lengths; ten times as many starts find them too, see below
each_number = pytest.mark.parametrize("n", [FEW, pytest.param(ALL, marks=pytest.mark.long)])


@cache
def poses():
    """The hundred poses of the claims: a square of 4 x 4 radii, attitudes uniform on SO(3)."""
    rng = np.random.default_rng(2026)
    p, q = rng.uniform(-2.0, 2.0, (ALL, 2)), rng.normal(size=(ALL, 4))
    return np.concatenate([rotations.normalize(q), p], axis=1)


@cache
def planned(n):
    """Paths home from the first n of these poses."""
    return [shortest_path(pose, HOME) for pose in poses()[:n]]


def lengths(n):
    return np.array([path.length for path in planned(n)])


def random_pose(seed, way=2.0):
    rng = np.random.default_rng(seed)
    return np.concatenate([rotations.random_quaternion(rng), rng.uniform(-way, way, 2)])


def rolled(way, turn=(1.0, 0.0, 0.0, 0.0)):
    """The pose after a straight roll from home, turned some more."""
    return np.concatenate([rotations.multiply(turn, rolling_ball.roll_straight(way, 1.0)), way])


@each_number
def test_a_path_home_is_found_from_every_pose(n):
    assert np.max([path.missed() for path in planned(n)]) < EXACT


@each_number
def test_paths_are_as_short_as_is_known_and_no_shorter_than_possible(n):
    some = poses()[:n]
    distance, angle = np.linalg.norm(some[:, 4:], axis=1), rotations.angle(some[:, :4])
    assert (lengths(n) >= np.maximum(distance, angle)).all()
    np.testing.assert_allclose(np.mean(lengths(n)), MEANS[n], atol=1e-5)


@each_number
def test_no_three_rolls_are_shorter(n):
    rolls = three_rolls(poses()[:n], HOME)
    assert (lengths(n) <= np.sum(np.linalg.norm(rolls, axis=-1), axis=-1)).all()


@each_number
def test_the_maximum_principle_steers_along_every_path(n):
    for path in planned(n):
        ahead = np.stack([np.cos(path.headings(40)), np.sin(path.headings(40))], axis=-1)
        # truncation of the attitude, 1e-12, times a costate of up to 10
        np.testing.assert_allclose(path.steering(40), ahead, rtol=0, atol=1e-11)


def test_the_same_pose_has_the_same_path_to_the_last_bit():
    for pose, path in zip(poses()[:3], planned(FEW), strict=False):
        again = shortest_path(pose, HOME)
        np.testing.assert_array_equal(again.states(7), path.states(7))


@pytest.mark.parametrize("seed", seeds(1, 3))
def test_lengths_do_not_depend_on_where_and_how_the_plane_is_looked_at(seed):
    start, goal = random_pose(seed), random_pose(seed + 10)
    length = shortest_path(start, goal).length
    turn, shift = rotations.exp([0.0, 0.0, 2.0 + seed]), np.array([30.0, -7.0])

    def seen(pose):
        way = rotations.rotate(turn, [*pose[4:], 0.0])[:2]
        return np.concatenate([rotations.multiply(turn, pose[:4]), way + shift])

    def mirrored(pose):  # y to -y: turns about x and z change their sense
        return pose * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])

    marked = rotations.random_quaternion(np.random.default_rng(seed))  # other axes in the body
    start_marked, goal_marked = (
        np.concatenate([rotations.multiply(pose[:4], marked), pose[4:]]) for pose in (start, goal)
    )
    for other in (
        shortest_path(seen(start), seen(goal)),
        shortest_path(mirrored(start), mirrored(goal)),
        shortest_path(goal, start),
        shortest_path(start_marked, goal_marked),
    ):
        # solved for to 1e-12, times how fast the length changes with the pose, below 100
        np.testing.assert_allclose(other.length, length, rtol=0, atol=1e-10)


def test_paths_scale_with_the_radius():
    scale = np.array([1.0, 1.0, 1.0, 1.0, 0.3, 0.3])
    path, large = shortest_path(scale * random_pose(1), HOME, radius=0.3), random_pose(1)
    np.testing.assert_allclose(path.length, 0.3 * shortest_path(large, HOME).length, rtol=1e-11)
    assert max(path.missed()) < EXACT
    ahead = np.stack([np.cos(path.headings(9)), np.sin(path.headings(9))], axis=-1)
    np.testing.assert_allclose(path.steering(9), ahead, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    "way", [[0.3, 0.4], [2.0, -1.0], [1e-6, -2e-3], [0.0, 2.0 * math.pi], [-12.0 * math.pi, 0.0]]
)
def test_where_a_straight_roll_leads_it_is_the_path(way):
    path = shortest_path(HOME, rolled(np.array(way)))
    np.testing.assert_allclose(path.length, math.hypot(*way), rtol=1e-15)
    np.testing.assert_allclose(path.headings(5), math.atan2(way[1], way[0]))
    assert max(path.missed()) < EXACT


def test_nowhere_is_no_way():
    path = shortest_path(HOME, HOME)
    assert path.length == 0.0
    np.testing.assert_array_equal(path.states(3), np.tile(HOME, (4, 1)))
    assert not path.rolls(3).any()


@pytest.mark.parametrize("seed", seeds(2, 6))
def test_short_elasticae_are_their_own_shortest_paths(seed):
    rng = np.random.default_rng(seed)
    length, turning = rng.uniform(0.5, 2.0), rng.uniform(-1.0, 1.0)
    pull, heading = rng.uniform(-1.0, 1.0, 2), rng.uniform(-3.0, 3.0)
    given = ShortestPath(HOME, HOME, 1.0, length, heading, turning, pull)
    path = shortest_path(HOME, given.states(1)[-1])
    np.testing.assert_allclose(path.length, length, rtol=0, atol=1e-9)
    np.testing.assert_allclose(path.states(9), given.states(9), rtol=0, atol=1e-6)


@pytest.mark.parametrize("angle", [0.1, 2.0, math.pi])
def test_a_ball_is_twisted_in_place(angle):
    twist = np.concatenate([rotations.exp([0.0, 0.0, angle]), [0.0, 0.0]])
    path = shortest_path(HOME, twist)
    assert max(path.missed()) < EXACT
    # in any direction alike: longer than the round circle that encloses the area for small angles
    assert path.length > math.sqrt(4.0 * math.pi * angle) * (1.0 - angle / 4.0)
    turned = shortest_path(HOME, twist * np.array([1.0, 1.0, 1.0, -1.0, 1.0, 1.0]))
    np.testing.assert_allclose(turned.length, path.length, rtol=1e-10)


@pytest.mark.parametrize("size", [1e-1, 1e-2, 1e-3])
def test_small_displacements_are_found_paths_of_the_order_of_their_cube_root(size):
    rng = np.random.default_rng(3)
    goal = np.concatenate(
        [rotations.exp(size * rng.uniform(-1, 1, 3)), size * rng.uniform(-1, 1, 2)]
    )
    path = shortest_path(HOME, goal)
    assert max(path.missed()) < EXACT
    assert size <= path.length < 8.0 * size ** (1.0 / 3.0)


def ends(headings, length):
    """Position and turn after n equal straight rolls, rows of headings (..., n): (..., 6)."""
    part = length / headings.shape[-1]
    s, c = np.sin(0.5 * part), np.cos(0.5 * part)
    w, x, y, z = (np.full(headings.shape[:-1], k, dtype=headings.dtype) for k in (1, 0, 0, 0))
    for k in range(headings.shape[-1]):
        a, b = -s * np.sin(headings[..., k]), s * np.cos(headings[..., k])
        w, x, y, z = (
            c * w - a * x - b * y,
            c * x + a * w + b * z,
            c * y + b * w - a * z,
            c * z + a * y - b * x,
        )
    place = [part * np.sum(f(headings), axis=-1) for f in (np.cos, np.sin)]
    return np.stack([w, x, y, z, *place], axis=-1)


def optimised(goal, guess, length):
    """The length of the shortest polygon of equal sides that SLSQP finds from a guess."""

    def missed(v):
        end = ends(v[..., :-1], v[..., -1])
        w, x, y, z = goal[:4]
        back = np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])  # vector of q goal^-1
        return np.concatenate([end[..., :4] @ back.T, end[..., 4:] - goal[4:]], axis=-1)

    def jacobian(v):
        return missed(v + 1e-30j * np.eye(len(v))).imag.T / 1e-30

    found = minimize(
        lambda v: v[-1],
        np.append(guess, length),
        jac=lambda v: np.append(np.zeros(len(v) - 1), 1.0),
        constraints={"type": "eq", "fun": missed, "jac": jacobian},
        method="SLSQP",
        options={"maxiter": 300, "ftol": 1e-10},
    )
    exact = np.max(np.abs(missed(found.x))) < 1e-8
    return abs(found.x[-1]) if exact else np.inf


def best_polygon(goal, length, n_guesses, seed=0, n_sides=24):
    """The shortest of many: guesses are waves, arcs and loops at random."""
    rng, t = np.random.default_rng(seed), np.linspace(-0.5, 0.5, n_sides)
    found = []
    for _ in range(n_guesses):
        arc = rng.uniform(-np.pi, np.pi) + rng.normal(0.0, 4.0) * t
        wave = rng.normal(0.0, 1.0) * np.sin(rng.uniform(2.0, 12.0) * t + rng.uniform(0.0, 6.0))
        found.append(optimised(goal, arc + wave, length * rng.uniform(0.8, 1.2)))
    return min(found)


@pytest.mark.long
def test_no_polygon_is_shorter_from_hundreds_of_guesses():
    for k in range(0, 100, 4):
        path = shortest_path(HOME, poses()[k])
        best = best_polygon(poses()[k], path.length, n_guesses=200, seed=k)
        assert path.length * (1.0 - 1e-6) < best < path.length * 1.02


@pytest.mark.long
def test_ten_times_as_many_starts_find_nothing_shorter(monkeypatch):
    # the package has the function in the place of the module
    module = sys.modules["rigid_envs.systems.rolling_ball.shortest_path"]
    monkeypatch.setattr(module, "_N_STARTS", 10_000)
    more = np.array([shortest_path(pose, HOME).length for pose in poses()])
    np.testing.assert_allclose(lengths(ALL), more, rtol=1e-9)
    np.testing.assert_allclose([np.mean(more[:n]) for n in MEANS], list(MEANS.values()), atol=1e-5)


@pytest.mark.parametrize("n", [20, 100])
def test_polygons_along_paths_lead_home_exactly(n):
    for path in planned(FEW):
        rolls = path.rolls(n)
        assert rolls.shape == (n, 2)
        np.testing.assert_allclose(path.start[4:] + np.sum(rolls, axis=0), 0.0, atol=1e-11)
        turn = rolling_ball.roll_polygon(rolls, 1.0)
        assert rotations.angle(rotations.multiply(turn, path.start[:4])) < 1e-11
        sides = np.linalg.norm(rolls, axis=-1)
        # shorter polygons than the path there are not; the bend of a side shows in second order
        assert 0.0 < np.sum(sides) / path.length - 1.0 < 10.0 / n**2
        assert np.max(sides) < 1.5 * path.length / n


def test_as_few_rolls_as_a_reach_allows_lead_home():
    for path in planned(FEW):
        rolls, reach = path.rolls_within(math.pi / 8), math.pi / 8
        assert np.max(np.linalg.norm(rolls, axis=-1)) <= reach
        assert len(rolls) * reach >= path.length
        assert len(rolls) <= path.length / reach + 4  # sides are not all as long as the longest
        turn = rolling_ball.roll_polygon(rolls, 1.0)
        assert rotations.angle(rotations.multiply(turn, path.start[:4])) < 1e-11


def test_polygons_along_paths_park_every_ball_of_the_environment():
    tight = {"position_tolerance": 1e-5, "angle_tolerance": 1e-5}  # else it is parked before
    envs = RigidVectorEnv("rigid_envs.systems.rolling_ball.tasks:BallPark", FEW, **tight)
    envs.reset(seed=0, options={"state": poses()[:FEW]})
    rolls = np.stack([path.rolls(100) for path in planned(FEW)])
    sides = np.linalg.norm(rolls, axis=-1)
    reach = envs.task.roll_per_step * 1.0
    assert np.max(sides) <= reach
    np.testing.assert_allclose(np.sum(sides, axis=-1), lengths(FEW), rtol=0.01)
    cost = np.zeros(FEW)
    for k in range(100):
        _, _, terminated, _, infos = envs.step((rolls[:, k] / reach).astype(np.float32))
        cost += infos["cost"]
        assert terminated.any() == (k == 99)
    assert infos["is_success"].all()
    np.testing.assert_allclose(cost, lengths(FEW), rtol=0.01)


def test_a_path_that_coarse_polygons_lead_past_is_found():
    assert np.max(shortest_path(random_pose(1155), HOME).missed()) < EXACT


def test_guesses_are_spread_more_evenly_than_random_points():
    # in one dimension the golden section, whose 144 points leave gaps of two lengths
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    for gap in np.diff(np.sort(evenly(144, 1)[:, 0])):
        assert math.isclose(gap, golden**-10) or math.isclose(gap, golden**-11)
    for dimensions in (2, 3, 4, 5):
        points = evenly(144, dimensions)
        assert points.shape == (144, dimensions)
        # the mean of the squared wrap-around discrepancy (Hickernell) over random points
        random = (1.5**dimensions - (4.0 / 3.0) ** dimensions) / 144
        assert qmc.discrepancy(points, method="WD") < 0.5 * random


def test_what_has_no_path_or_too_few_sides_is_refused():
    with pytest.raises(ValueError, match=r"^(start|goal) has shape \(2, 6\); expected \(6,\)"):
        shortest_path(np.tile(HOME, (2, 1)), HOME)
    refuses("radius = -1", shortest_path, HOME, HOME, radius=-1.0)
    refuses(r"n = 0; expected an integer of at least 1", planned(FEW)[0].states, 0)
    with pytest.raises(ArithmeticError, match="n = 2 sides"):
        planned(FEW)[0].rolls(2)
