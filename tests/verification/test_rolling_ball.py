"""Rolling without slip: at every instant, over every step, and round closed loops."""

import itertools
import math
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics.laws import EPS, matrices
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.reference import cases
from tests.verification.measures import orders, random_attitude

FLOATS = st.floats(-3.0, 3.0)
RADII = st.floats(0.1, 10.0)


def rotation(y):
    return Rotation.from_quat(y[..., :4], scalar_first=True)


@given(RADII, st.integers(0, 10**6), st.tuples(FLOATS, FLOATS, FLOATS))
def test_the_contact_point_is_at_rest_at_every_instant(radius, seed, u):
    ball = RollingBall(radius)
    y = ball.state(q=random_attitude(np.random.default_rng(seed)))
    rate = ball.rhs(y, u)
    # Angular velocity from q' itself: (0, omega) = 2 q' conj(q), in world axes.
    w, v = y[0], y[1:4]
    omega = 2.0 * (w * rate[1:4] - rate[0] * v + np.cross(v, rate[1:4]))
    centre = np.array([rate[4], rate[5], 0.0])
    contact = centre + np.cross(omega, (0.0, 0.0, -radius))
    size = 1.0 + 3.0 * radius + 3.0 / radius
    np.testing.assert_allclose(contact, 0.0, rtol=0, atol=16 * EPS * size)
    assert omega[2] == pytest.approx(u[2], abs=16 * EPS * size)


@settings(max_examples=200)
@given(RADII, st.integers(0, 10**6), st.tuples(FLOATS, FLOATS, FLOATS), st.floats(0.01, 1.57))
def test_every_step_turns_the_ball_by_what_its_centre_has_rolled(radius, seed, u, turn):
    ball = RollingBall(radius)
    rate = max(float(np.linalg.norm(ball.omega_world(u))), 1e-3)
    y, dt = ball.state(q=random_attitude(np.random.default_rng(seed))), turn / rate
    after = ball.advance(y, u, dt)
    turned = (rotation(after) * rotation(y).inv()).as_rotvec()
    way = after[4:6] - y[4:6]
    # Roundings of the quaternions, of the logarithm and of the position, over the radius.
    atol = 16 * EPS * (1.0 + np.max(np.abs(way)) / radius)
    np.testing.assert_allclose(
        turned, (-way[1] / radius, way[0] / radius, u[2] * dt), rtol=0, atol=atol
    )


def test_a_million_random_rolls_keep_the_attitude_a_rotation():
    rng, ball = np.random.default_rng(1), RollingBall()
    velocity = rng.uniform(-1.0, 1.0, (1000, 1000, 3))  # a thousand balls, a thousand rolls each
    trajectory = ball.simulate(ball.state(), np.arange(1001) * 0.5, velocity)
    assert np.max(np.abs(np.linalg.norm(trajectory["q"], axis=-1) - 1.0)) <= 1e-14
    one = ball.simulate(ball.state(), np.arange(101) * 1e4, (0.3, 0.4, 0.1), max_step=1.0)
    assert np.max(np.abs(np.linalg.norm(one["q"], axis=-1) - 1.0)) <= 1e-14
    # A million equal turns of 0.51 rad: the angle of each is rounded the same way.
    expected = Rotation.from_rotvec(1e6 * np.array([-0.4, 0.3, 0.1])).as_matrix()
    np.testing.assert_allclose(one["R"][-1], expected, rtol=0, atol=1e6 * EPS)


SHARE = {"fixed_plane": 1.0, "top_plate": 0.5}  # of a commanded velocity that the centre gets


def commands(command):
    """Cases in which the plane stands still."""
    found = [c for c in cases("ball_kinematic") if c["in"]["command"] == command]
    return [c for c in found if c["in"].get("variant", "fixed_plane") in SHARE]


def check_case(case, trajectory, rows, truncation=0.0):
    out = case["out"]
    place = np.stack([out["x"], out["y"]], axis=-1)
    np.testing.assert_allclose(trajectory["position"][rows], place, rtol=0, atol=1e-13 + truncation)
    atol = 64 * EPS * case["cond"]["R"] + truncation
    expected = np.array(out["R"]).reshape(-1, 3, 3)
    np.testing.assert_allclose(trajectory["R"][rows], expected, rtol=0, atol=atol)


@pytest.mark.parametrize("case", commands("segments"), ids=itemgetter("id"))
def test_rolling_along_segments_agrees_with_the_reference(case):
    given_ = case["in"]
    share = SHARE[given_.get("variant", "fixed_plane")]
    segments, ball = np.array(given_["segments"]), RollingBall(given_["a"])
    ends = np.concatenate([[0.0], np.cumsum(segments[:, 3])])
    t = np.union1d(ends, case["t"])
    u = segments[np.searchsorted(ends, t[:-1], side="right") - 1, :3] * [share, share, 1.0]
    start = ball.state(q=given_["q0"], position=given_["pos0"])
    check_case(case, ball.simulate(start, t, u), np.searchsorted(t, case["t"]))


@pytest.mark.parametrize("case", commands("circle"), ids=itemgetter("id"))
def test_rolling_round_a_circle_agrees_with_the_reference(case):
    given_, ball = case["in"], RollingBall(case["in"]["a"])
    r, rate, phase = given_["r"], given_["rate"], given_.get("phase0", 0.0)
    t = np.concatenate([[0.0], case["t"]])

    def velocity(s):
        angle = phase + rate * s
        return (-r * rate * math.sin(angle), r * rate * math.cos(angle), given_["spin"])

    start = ball.state(q=given_["q0"], position=r * np.array([math.cos(phase), math.sin(phase)]))
    trajectory = ball.simulate(start, t, velocity, max_step=t[-1] / 20000)
    # Fourth order in 20 000 steps of 0.01 rad or less, at 1e-12; and their roundings.
    check_case(case, trajectory, slice(1, None), truncation=2e-11)


def circle(ball, r, n):
    """Rolled once round, counter-clockwise, as a polygon with n sides, from (r, 0)."""
    corners = r * np.exp(2j * np.pi * np.arange(n + 1) / n)
    way = np.diff(corners)
    t = np.arange(n + 1) * 1.0
    u = np.stack([way.real, way.imag, np.zeros(n)], axis=-1)
    return ball.simulate(ball.state(position=(r, 0.0)), t, u)


@pytest.mark.parametrize("radius", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("r", [0.05, 0.4, 1.0, math.sqrt(3.0), 4.0])
def test_a_circle_rolled_once_has_the_closed_form_holonomy(r, radius):
    ball, rate = RollingBall(radius), 2.0 * math.pi

    def velocity(t):
        return (-r * rate * math.sin(rate * t), r * rate * math.cos(rate * t), 0.0)

    # At most 4000 steps of 0.02 rad: fourth order leaves 1e-10.
    end = ball.simulate(ball.state(position=(r, 0.0)), [0.0, 1.0], velocity, max_step=1.0 / 4000)
    holonomy = matrices(rolling_ball.circle_holonomy(r, radius))
    np.testing.assert_allclose(end["R"][-1], holonomy, rtol=0, atol=1e-10)
    np.testing.assert_allclose(end["position"][-1], (r, 0.0), rtol=0, atol=1e-11)


@pytest.mark.parametrize("case", cases("ball_holonomy_circle"), ids=itemgetter("id"))
def test_polygons_reach_the_reference_holonomy_of_the_circle(case):
    ball, r = RollingBall(case["in"]["a"]), case["in"]["r"]
    expected = np.array(case["out"]["R_loop"]).reshape(3, 3)
    errors = [
        np.max(np.abs(circle(ball, r, n)["R"][-1] - expected)) for n in (250, 500, 1000, 2000)
    ]
    np.testing.assert_allclose(orders(errors), 2.0, rtol=0, atol=0.02)  # of the polygon
    # Two polygons give the limit to n^-4 (Richardson).
    fine = (4.0 * circle(ball, r, 2000)["R"][-1] - circle(ball, r, 1000)["R"][-1]) / 3.0
    np.testing.assert_allclose(fine, expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("case", cases("ball_holonomy_rectangle"), ids=itemgetter("id"))
def test_a_rectangle_of_straight_rolls_has_the_reference_holonomy(case):
    x, y = case["in"]["lx"], case["in"]["ly"]
    ball, u = RollingBall(case["in"]["a"]), np.array([(x, 0, 0), (0, y, 0), (-x, 0, 0), (0, -y, 0)])
    end = ball.simulate(ball.state(), np.arange(5.0), u)
    expected = np.array(case["out"]["R_loop"]).reshape(3, 3)
    # Each side in a few exact turns: some tens of roundings.
    np.testing.assert_allclose(end["R"][-1], expected, rtol=0, atol=128 * EPS)
    np.testing.assert_allclose(end["position"][-1], 0.0, rtol=0, atol=16 * EPS * (x + y))


@pytest.mark.parametrize("radius", [0.5, 2.0])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_small_loop_turns_the_ball_by_minus_its_area_over_the_radius_squared(radius, sense):
    ball, errors = RollingBall(radius), []
    for side in (0.08, 0.04, 0.02, 0.01):
        s = side * radius
        u = s * np.array([(1, 0, 0), (0, sense, 0), (-1, 0, 0), (0, -sense, 0)])
        turn = rotation(ball.simulate(ball.state(), np.arange(5.0), u).y[-1]).as_rotvec()
        errors.append(np.linalg.norm(turn - (0.0, 0.0, -sense * s**2 / radius**2)))
        # The law is the leading term: its error is of third order in the side.
        assert errors[-1] <= 2.0 * side**3
    np.testing.assert_allclose(orders(errors), 3.0, rtol=0, atol=0.1)


def bracket(f, g, y, h=1e-2):
    """Lie bracket [f, g] = Dg f - Df g; central differences are exact for quadratic fields."""
    along_f = (g(y + h * f(y)) - g(y - h * f(y))) / (2.0 * h)
    along_g = (f(y + h * g(y)) - f(y - h * g(y))) / (2.0 * h)
    return along_f - along_g


def test_the_growth_vector_is_two_three_five():
    ball = RollingBall(0.7)
    y = ball.state(q=random_attitude(np.random.default_rng(2)), position=(0.3, -0.4))

    def field(u):
        jacobian, _ = ball.linearize(y, u)  # rhs is linear in q and does not depend on X, Y
        return lambda z: jacobian @ z + np.array([0.0, 0.0, 0.0, 0.0, *u[:2]])

    x1, x2 = field((1.0, 0.0, 0.0)), field((0.0, 1.0, 0.0))
    np.testing.assert_allclose(x1(y), ball.rhs(y, (1.0, 0.0, 0.0)), rtol=0, atol=4 * EPS)

    def x12(z):
        return bracket(x1, x2, z)

    distribution = [x1(y), x2(y)]
    first = [*distribution, x12(y)]
    second = [*first, bracket(x1, x12, y), bracket(x2, x12, y)]
    third = [
        bracket(one, lambda z, two=two: bracket(two, x12, z), y)
        for one, two in itertools.product((x1, x2), repeat=2)
    ]
    ranks = [
        int(np.linalg.matrix_rank(np.array(fields), tol=1e-6))
        for fields in (distribution, first, second, second + third)
    ]
    assert ranks == [2, 3, 5, 5]
    # [X1, X2] spins the ball about the vertical by -1 / r^2, without moving it.
    spin = ball.rhs(y, (0.0, 0.0, 1.0))
    np.testing.assert_allclose(x12(y), -spin / 0.7**2, rtol=0, atol=1e-12)


def test_brackets_of_order_n_are_reached_by_loops_whose_size_is_an_nth_root():
    ball = RollingBall()

    def rolled(moves):
        u = np.array([(x, y, 0.0) for x, y in moves])
        return ball.simulate(ball.state(), np.arange(len(moves) + 1.0), u).y[-1]

    def loop(s):
        return [(s, 0.0), (0.0, s), (-s, 0.0), (0.0, -s)]

    def nested(s):
        back = [(-x, -y) for x, y in reversed(loop(s))]
        return [*loop(s), (s, 0.0), *back, (-s, 0.0)]

    sizes = (0.08, 0.04, 0.02, 0.01)
    twists = [abs(rotation(rolled(loop(s))).as_rotvec()[2]) for s in sizes]
    np.testing.assert_allclose(orders(twists), 2.0, rtol=0, atol=0.02)
    # The mismatch between what was rolled and what is turned, about a horizontal axis.
    ends = [rolled(nested(s)) for s in sizes]
    np.testing.assert_allclose([end[4:6] for end in ends], 0.0, rtol=0, atol=4 * EPS)
    tilts = [np.linalg.norm(rotation(end).as_rotvec()[:2]) for end in ends]
    np.testing.assert_allclose(orders(tilts), 3.0, rtol=0, atol=0.1)


def test_held_velocities_are_rolled_exactly_whatever_the_step():
    ball, u, q = RollingBall(0.6), (0.5, -0.3, 0.8), random_attitude(np.random.default_rng(3))
    expected = Rotation.from_rotvec(3.0 * ball.omega_world(u)) * Rotation.from_quat(
        q, scalar_first=True
    )
    for steps in (3, 7, 100):
        end = ball.advance(ball.state(q=q), u, 3.0, steps)
        np.testing.assert_allclose(
            rotation(end).as_matrix(), expected.as_matrix(), rtol=0, atol=4 * EPS * (8 + steps)
        )
        np.testing.assert_allclose(end[4:], (1.5, -0.9), rtol=0, atol=EPS * (4 + steps))
