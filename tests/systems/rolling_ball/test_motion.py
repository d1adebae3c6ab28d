"""Motion of the rolling ball: closed forms against references, simulations against both."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.reference import cases, every
from tests.refusals import refuses
from tests.systems.measures import Refined

# Closed forms of a ball that rolls along curves, and brackets of its fields and the coin's.


EPS = np.finfo(np.float64).eps


def arrangement(case):
    return rolling_ball.ARRANGEMENTS[case["in"].get("variant", "fixed_plane")]


def matrices(turn):
    return Rotation.from_quat(turn, scalar_first=True).as_matrix()


def kinematic(command):
    return [c for c in cases("ball_kinematic") if c["in"]["command"] == command]


def check_ball(case, place, turn):
    given, out = case["in"], case["out"]
    expected = np.stack([out["x"], out["y"]], axis=-1)
    np.testing.assert_allclose(place, expected, rtol=0, atol=8 * EPS * np.max(np.abs(expected)))
    rotation = matrices(turn) @ matrices(given["q0"])
    expected = np.array(out["R"]).reshape(-1, 3, 3)
    # cond eps from the input, and a few roundings for each of up to six rolls.
    np.testing.assert_allclose(rotation, expected, rtol=0, atol=8 * EPS * case["cond"]["R"])


@every(kinematic("segments"))
def test_rolling_along_segments_agrees_with_the_reference(case):
    given = case["in"]
    centre, roll = arrangement(case)
    segments = np.array(given["segments"]) * np.array([roll, roll, 1.0, 1.0])
    way, turn = rolling_ball.roll_segments(case["t"], segments, given["a"])
    check_ball(case, centre / roll * way + given["pos0"], turn)


@every(kinematic("circle"))
def test_rolling_round_a_circle_with_spin_agrees_with_the_reference(case):
    given = case["in"]
    centre, roll = arrangement(case)
    place, turn = rolling_ball.roll_circle(
        case["t"],
        radius=given["a"],
        circle_radius=abs(roll) * given["r"],
        rate=given["rate"],
        phase=given.get("phase0", 0.0) + (np.pi if roll < 0.0 else 0.0),
        spin=given["spin"],
    )
    check_ball(case, centre / roll * place, turn)


@every([c for c in kinematic("circle") if "one_turn_R" in c["scalars"]])
def test_one_round_with_spin_agrees_with_the_reference(case):
    given, scalars = case["in"], case["scalars"]
    vector = rolling_ball.circle_rotation_vector(
        given["r"], given["a"], phase=given["phase0"], spin_per_rate=given["spin"] / given["rate"]
    )
    angle = scalars["one_turn_rotation_angle_unreduced"]
    np.testing.assert_allclose(np.linalg.norm(vector), angle, rtol=8 * EPS)
    turn = Rotation.from_rotvec(vector).as_matrix()
    np.testing.assert_allclose(turn, scalars["one_turn_R"], rtol=0, atol=4 * EPS * angle)


@every(kinematic("clothoid"))
def test_the_path_along_a_clothoid_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    place = rolling_ball.clothoid_path(
        case["t"], speed=given["speed"], heading_acceleration=given["k"]
    )
    expected = np.stack([out["x"], out["y"]], axis=-1)
    tolerance = 8 * EPS * max(case["cond"]["x"], case["cond"]["y"])
    np.testing.assert_allclose(place, expected, rtol=0, atol=tolerance)


@every(cases("ball_clothoid_complete"))
def test_the_complete_clothoid_tips_the_ball_as_in_the_reference(case):
    given = case["in"]
    angle = rolling_ball.complete_clothoid_angle(
        speed=given["speed"], heading_acceleration=given["k"], radius=given["a"]
    )
    np.testing.assert_allclose(math.cos(angle), case["out"]["final_R33"], rtol=8 * EPS)


@every(cases("ball_reach"))
def test_three_straight_rolls_reach_the_pose_of_the_reference(case):
    given, out = case["in"], case["out"]
    plan = np.array(out["plan_displacements"])
    length = np.sum(np.linalg.norm(plan, axis=-1))
    assert plan.shape == (3, 2)
    np.testing.assert_allclose(length, out["path_length"], rtol=8 * EPS)
    np.testing.assert_allclose(
        np.sum(plan, axis=0), given["target_xy"], rtol=0, atol=4 * EPS * length
    )
    # The plan is rounded where it is printed: length / radius is how much that turns the ball.
    turn = matrices(rolling_ball.roll_polygon(plan, given["a"]))
    tolerance = 4 * EPS * length / given["a"]
    np.testing.assert_allclose(turn, matrices(given["target_q"]), rtol=0, atol=tolerance)


@every(cases("ball_holonomy_circle"))
def test_a_circle_rolled_once_agrees_with_the_reference(case):
    turn = rolling_ball.circle_holonomy(case["in"]["r"], case["in"]["a"])
    # The angle, up to 42 radians, is rounded before it is reduced.
    tolerance = 4 * EPS * case["out"]["angle_unreduced"]
    expected = np.array(case["out"]["R_loop"]).reshape(3, 3)
    np.testing.assert_allclose(matrices(turn), expected, rtol=0, atol=tolerance)
    vector = rolling_ball.circle_rotation_vector(case["in"]["r"], case["in"]["a"])
    unreduced = case["out"]["rotation_vector_unreduced"]
    np.testing.assert_allclose(vector, unreduced, rtol=4 * EPS, atol=0)
    np.testing.assert_allclose(np.linalg.norm(vector), case["out"]["angle_unreduced"], rtol=4 * EPS)
    area = math.pi * (case["in"]["r"] / case["in"]["a"]) ** 2
    np.testing.assert_allclose(area, case["out"]["small_loop_area_over_a2"], rtol=4 * EPS)


@every(cases("ball_holonomy_rectangle"))
def test_a_rectangle_of_straight_rolls_agrees_with_the_reference(case):
    x, y = case["in"]["lx"], case["in"]["ly"]
    turn = rolling_ball.roll_polygon([(x, 0.0), (0.0, y), (-x, 0.0), (0.0, -y)], case["in"]["a"])
    expected = np.array(case["out"]["R_loop"]).reshape(3, 3)
    np.testing.assert_allclose(matrices(turn), expected, rtol=0, atol=8 * EPS)
    vector = Rotation.from_quat(turn, scalar_first=True).as_rotvec()
    # Half a turn has two vectors, and which of them is a matter of rounding.
    if np.linalg.norm(case["out"]["rotation_vector"]) > 3.14:
        vector = math.copysign(1.0, vector @ case["out"]["rotation_vector"]) * vector
    np.testing.assert_allclose(vector, case["out"]["rotation_vector"], rtol=0, atol=8 * EPS)


@pytest.mark.parametrize("circle_radius", [1e-12, 1e-6, 1e-3])
def test_a_small_loop_turns_the_ball_by_minus_its_area_about_the_vertical(circle_radius):
    w, x, y, z = rolling_ball.circle_holonomy(circle_radius, 0.5)
    rho = circle_radius / 0.5
    # The next order is rho^2 / 4 relative, and the axis leans by rho.
    assert 2.0 * math.atan2(z, w) == pytest.approx(-math.pi * rho**2, rel=rho**2 + 8 * EPS)
    assert math.hypot(x, y) == pytest.approx(rho * abs(z), rel=8 * EPS)


@pytest.mark.parametrize("rate", [0.7, -0.7])
@pytest.mark.parametrize("phase", [0.0, 2.2])
def test_one_round_of_rolling_is_the_holonomy_and_clockwise_its_inverse(rate, phase):
    place, turn = rolling_ball.roll_circle(
        [0.0, 2.0 * np.pi / abs(rate)], radius=0.4, circle_radius=0.9, rate=rate, phase=phase
    )
    loop = matrices(rolling_ball.circle_holonomy(0.9, 0.4, phase=phase))
    expected = loop if rate > 0.0 else loop.T
    np.testing.assert_allclose(place[1], place[0], rtol=0, atol=8 * EPS)
    np.testing.assert_allclose(matrices(turn[0]), np.eye(3), rtol=0, atol=8 * EPS)
    np.testing.assert_allclose(matrices(turn[1]), expected, rtol=0, atol=1e-14)


def test_ever_longer_clothoids_tip_the_ball_ever_closer_to_the_closed_form():
    speed, k, radius = 0.9, 0.7, 0.8
    angle = rolling_ball.complete_clothoid_angle(speed=speed, heading_acceleration=k, radius=radius)
    for end in (10.0, 40.0):
        t = np.linspace(-end, end, 200 * round(end) ** 2 // 10)
        way = rolling_ball.clothoid_path(t, speed=speed, heading_acceleration=k)
        _, x, y, z = turn = rolling_ball.roll_polygon(np.diff(way, axis=0), radius)
        # Beyond `end` the heading spins so fast that speed / (radius k end) is left at either side;
        # the polygon itself is 1e-3 off.
        rest = 2.0 * speed / (radius * k * end)
        assert matrices(turn)[2, 2] == pytest.approx(math.cos(angle), abs=rest)
        assert abs(z) < rest * math.hypot(x, y)


def test_straight_rolls_of_any_shape_are_taken():
    assert rolling_ball.roll_straight(np.zeros((5, 3, 2)), 1.0, twist=np.ones(3)).shape == (5, 3, 4)
    quarter = rolling_ball.roll_straight((0.5 * np.pi, 0.0), 1.0)  # along x: about +y
    np.testing.assert_allclose(matrices(quarter) @ (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), atol=2 * EPS)


RADIUS = 0.4
BALL_STATE = np.array([0.3, -0.2, 0.5, -0.1, 0.7, 0.5])  # with a unit quaternion
COIN_STATE = np.array([0.3, -0.2, 0.8, 2.0])


def ball_rate(bracketed):
    """Velocity (2,) and angular velocity (3,) in the world, of a rate of the ball's state."""
    w, v = BALL_STATE[2], BALL_STATE[3:]
    rate_w, rate_v = bracketed[2], bracketed[3:]
    # omega = 2 q' q^-1
    return bracketed[:2], 2.0 * (w * rate_v - rate_w * v - np.cross(rate_v, v))


def test_growth_ends_with_the_degree_of_nonholonomy():
    ball = rolling_ball.ball_fields(RADIUS)
    for depth in range(1, 5):
        growth = rolling_ball.growth_vector(ball, BALL_STATE, depth)
        assert growth == (2, 3, 5, 5)[:depth]
    assert rolling_ball.degree_of_nonholonomy((2, 3, 5), 5) == 3
    assert rolling_ball.degree_of_nonholonomy((2, 3, 4, 4), 4) == 3


@pytest.mark.parametrize("radius", [1e-3, 1.0, 1e3])
def test_growth_is_the_same_at_every_state_and_for_every_radius(radius):
    rng = np.random.default_rng(7)
    for _ in range(5):
        q = rng.normal(size=4)
        ball_state = np.concatenate([rng.normal(size=2), q / np.linalg.norm(q)])
        assert rolling_ball.growth_vector(rolling_ball.ball_fields(radius), ball_state, 3) == (
            2,
            3,
            5,
        )
        coin_state = rng.normal(size=4)
        assert rolling_ball.growth_vector(rolling_ball.coin_fields(radius), coin_state, 3) == (
            2,
            3,
            4,
        )


def test_brackets_of_the_ball_are_those_of_the_algebra_of_rotations():
    first = np.array([1.0, 0.0]), np.array([0.0, 1.0, 0.0]) / RADIUS
    second = np.array([0.0, 1.0]), np.array([-1.0, 0.0, 0.0]) / RADIUS

    # The fields R' = omega^ R are invariant: [f, g] has minus the cross product, and no velocity.
    def algebra(f, g):
        return np.zeros(2), -np.cross(f[1], g[1])

    pair = algebra(first, second)
    expected = [[first, second], [pair], [algebra(first, pair), algebra(second, pair)]]
    np.testing.assert_allclose(pair[1], (0.0, 0.0, -1.0 / RADIUS**2), rtol=4 * EPS)
    found = rolling_ball.iterated_brackets(rolling_ball.ball_fields(RADIUS), BALL_STATE, 3)
    for level, elements in zip(found, expected, strict=True):
        for value, (velocity, omega) in zip(level, elements, strict=True):
            moved, spun = ball_rate(value)
            np.testing.assert_allclose(moved, velocity, rtol=0, atol=0)
            np.testing.assert_allclose(spun, omega, rtol=0, atol=16 * EPS / RADIUS**3)


def test_brackets_of_the_coin_are_sideways_and_forwards():
    heading = COIN_STATE[2]
    side = RADIUS * np.array([-math.sin(heading), math.cos(heading), 0.0, 0.0])
    ahead = RADIUS * np.array([math.cos(heading), math.sin(heading), 0.0, 0.0])
    _, pair, triple = rolling_ball.iterated_brackets(
        rolling_ball.coin_fields(RADIUS), COIN_STATE, 3
    )
    np.testing.assert_allclose(pair, [side], rtol=4 * EPS)
    np.testing.assert_allclose(triple, [np.zeros(4), -ahead], rtol=4 * EPS)


def test_norms_are_lengths_of_brackets():
    one, two, three = rolling_ball.bracket_norms(rolling_ball.coin_fields(RADIUS), COIN_STATE, 3)
    np.testing.assert_allclose(one, (math.hypot(RADIUS, 1.0), 1.0), rtol=4 * EPS)
    np.testing.assert_allclose(two, (RADIUS,), rtol=4 * EPS)
    np.testing.assert_allclose(three, (0.0, RADIUS), rtol=4 * EPS)


def test_brackets_are_antisymmetric_and_obey_jacobi():
    def f(s):
        return np.array([s[1] * s[2], np.sin(s[0]), s[0] / (1.0 + s[1] * s[1])])

    def g(s):
        return np.array([np.cos(s[2]), s[0] * s[0], 1.0 - s[1]])

    def h(s):
        return np.array([s[2], 2.0 / s[0], s[0] * s[1]])

    at = np.array([0.7, -0.4, 1.2])
    by_hand = np.cos(1.2) / 1.16 + 2.0 * 0.7**3 * 0.4 / 1.16**2 + np.sin(0.7)
    assert rolling_ball.bracket(g, f)(at)[2] == pytest.approx(by_hand, rel=1e-14)
    together = rolling_ball.bracket(f, g)(at) + rolling_ball.bracket(g, f)(at)
    np.testing.assert_array_equal(together, 0.0)
    cyclic = [
        rolling_ball.bracket(a, rolling_ball.bracket(b, c))(at)
        for a, b, c in ((f, g, h), (g, h, f), (h, f, g))
    ]
    # Three sums of some ten terms of the size of ten.
    np.testing.assert_allclose(np.sum(cyclic, axis=0), 0.0, rtol=0, atol=1000 * EPS)


def test_integrable_fields_never_grow():
    def along(s):
        return np.array([1.0, 0.0, s[1]])

    def across(s):
        return np.array([0.0, 1.0, s[0]])

    # Both keep z - x y: [along, across] = 0.
    growth = rolling_ball.growth_vector((along, across), (0.2, 0.4, -1.0), 3)
    assert growth == (2, 2, 2)
    refuses("cannot be steered everywhere", rolling_ball.degree_of_nonholonomy, growth, 3)


# The rolling ball along segments and curves, under a plate that moves and over a plane that moves.
#
# What the ball does is told by the velocity of its centre over the plane it rolls on: half of that
# of a plate above it, and minus that of a plane which moves below a centre at rest.


def command(given):
    """Velocity and spin that are commanded, of time."""
    spin = given.get("spin", 0.0)
    if given["command"] == "lissajous":
        A, B, n, m = (given[name] for name in ("A", "B", "n", "m"))
        return lambda t: (A * n * math.cos(n * t), B * m * math.cos(m * t), spin)
    speed, k = given["speed"], given["k"]

    def spiralling(t):
        heading = 0.5 * k * t * t
        return (speed * math.cos(heading), speed * math.sin(heading), spin)

    return spiralling


def commanded(ball, y, t, u, steps=2000):
    """The motion in so many steps and in twice as many."""
    coarse, fine = (ball.simulate(y, t, u, max_step=t[-1] / n) for n in (steps, 2 * steps))
    rate = max(float(np.linalg.norm(ball.omega_world(u(s)))) for s in np.linspace(0.0, t[-1], 101))
    return Refined(fine, coarse, 2.0 * steps, rate, rate * t[-1])


@every(kinematic("lissajous") + kinematic("clothoid"))
def test_rolling_along_curves_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    ball, velocity, (_, roll) = RollingBall(given["a"]), command(given), arrangement(case)
    start = ball.state(q=given["q0"], position=given.get("pos0", (0.0, 0.0)))
    t = np.concatenate([[0.0], case["t"]])
    motion = commanded(ball, start, t, lambda s: velocity(s) * np.array([roll, roll, 1.0]))
    found, place = motion.trajectory, np.stack([out["x"], out["y"]], axis=-1)
    atol = motion.tolerance("R", motion.turned, cond["R"])
    expected = np.reshape(out["R"], (-1, 3, 3))
    np.testing.assert_allclose(found["R"][1:], expected, rtol=0, atol=atol)
    atol = motion.tolerance("position", given["a"] * motion.turned, max(cond["x"], cond["y"]))
    np.testing.assert_allclose(found["position"][1:], place, rtol=0, atol=atol)
