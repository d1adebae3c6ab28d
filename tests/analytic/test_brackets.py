import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.systems.rolling_ball import closed_forms as brackets
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.closed_forms import Dual
from rigid_envs.systems.upright_coin import closed_forms as upright_coin

EPS = np.finfo(np.float64).eps
RADIUS = 0.4
SIZE = 0.02  # of the largest loop
BALL_STATE = np.array([0.3, -0.2, 0.5, -0.1, 0.7, 0.5])  # with a unit quaternion
COIN_STATE = np.array([0.3, -0.2, 0.8, 2.0])


def ball_rate(bracketed):
    """Velocity (2,) and angular velocity (3,) in the world, of a rate of the ball's state."""
    w, v = BALL_STATE[2], BALL_STATE[3:]
    rate_w, rate_v = bracketed[2], bracketed[3:]
    # omega = 2 q' q^-1
    return bracketed[:2], 2.0 * (w * rate_v - rate_w * v - np.cross(rate_v, v))


def test_the_growth_vectors_of_ball_and_coin_are_the_known_ones():
    ball, coin = brackets.ball_fields(RADIUS), brackets.coin_fields(RADIUS)
    assert brackets.growth_vector(ball, BALL_STATE, 3) == (2, 3, 5)
    assert brackets.growth_vector(coin, COIN_STATE, 3) == (2, 3, 4)
    assert brackets.growth_vector(ball, BALL_STATE, 4) == (2, 3, 5, 5)
    assert brackets.degree_of_nonholonomy((2, 3, 5), 5) == 3
    assert brackets.degree_of_nonholonomy((2, 3, 4, 4), 4) == 3


@pytest.mark.parametrize("radius", [1e-3, 1.0, 1e3])
def test_growth_is_the_same_at_every_state_and_for_every_radius(radius):
    rng = np.random.default_rng(7)
    for _ in range(5):
        q = rng.normal(size=4)
        ball_state = np.concatenate([rng.normal(size=2), q / np.linalg.norm(q)])
        assert brackets.growth_vector(brackets.ball_fields(radius), ball_state, 3) == (2, 3, 5)
        coin_state = rng.normal(size=4)
        assert brackets.growth_vector(brackets.coin_fields(radius), coin_state, 3) == (2, 3, 4)


def test_brackets_of_the_ball_are_those_of_the_algebra_of_rotations():
    first = np.array([1.0, 0.0]), np.array([0.0, 1.0, 0.0]) / RADIUS
    second = np.array([0.0, 1.0]), np.array([-1.0, 0.0, 0.0]) / RADIUS

    # The fields R' = omega^ R are invariant: [f, g] has minus the cross product, and no velocity.
    def algebra(f, g):
        return np.zeros(2), -np.cross(f[1], g[1])

    pair = algebra(first, second)
    expected = [[first, second], [pair], [algebra(first, pair), algebra(second, pair)]]
    np.testing.assert_allclose(pair[1], (0.0, 0.0, -1.0 / RADIUS**2), rtol=4 * EPS)
    found = brackets.iterated_brackets(brackets.ball_fields(RADIUS), BALL_STATE, 3)
    for level, elements in zip(found, expected, strict=True):
        for value, (velocity, omega) in zip(level, elements, strict=True):
            moved, spun = ball_rate(value)
            np.testing.assert_allclose(moved, velocity, rtol=0, atol=0)
            np.testing.assert_allclose(spun, omega, rtol=0, atol=16 * EPS / RADIUS**3)


def test_brackets_of_the_coin_are_sideways_and_forwards():
    heading = COIN_STATE[2]
    side = RADIUS * np.array([-math.sin(heading), math.cos(heading), 0.0, 0.0])
    ahead = RADIUS * np.array([math.cos(heading), math.sin(heading), 0.0, 0.0])
    _, pair, triple = brackets.iterated_brackets(brackets.coin_fields(RADIUS), COIN_STATE, 3)
    np.testing.assert_allclose(pair, [side], rtol=4 * EPS)
    np.testing.assert_allclose(triple, [np.zeros(4), -ahead], rtol=4 * EPS)


def test_norms_are_lengths_of_brackets():
    one, two, three = brackets.bracket_norms(brackets.coin_fields(RADIUS), COIN_STATE, 3)
    np.testing.assert_allclose(one, (math.hypot(RADIUS, 1.0), 1.0), rtol=4 * EPS)
    np.testing.assert_allclose(two, (RADIUS,), rtol=4 * EPS)
    np.testing.assert_allclose(three, (0.0, RADIUS), rtol=4 * EPS)


def ball_flow(which, time):
    way = time * np.eye(2)[which]

    def flow(state):
        turn = Rotation.from_quat(rolling_ball.roll_straight(way, RADIUS), scalar_first=True)
        attitude = turn * Rotation.from_quat(state[2:], scalar_first=True)
        q = attitude.as_quat(scalar_first=True)
        return np.concatenate([state[:2] + way, math.copysign(1.0, q @ state[2:]) * q])

    return flow


def coin_flow(which, time):
    psi_rate, phi_rate = np.eye(2)[which]

    def flow(state):
        motion = upright_coin.roll_coin(
            time,
            radius=RADIUS,
            phi_rate=phi_rate,
            psi_rate=psi_rate,
            phi=state[2],
            psi=state[3],
            place=state[:2],
        )
        return np.array([*motion.place, motion.phi, motion.psi])

    return flow


def commutator(there, back, other_there, other_back):
    """Flows of a loop and of its way back."""

    def loop(state):
        return other_back(back(other_there(there(state))))

    def reverse(state):
        return back(other_back(there(other_there(state))))

    return loop, reverse


def extrapolated(shift, order):
    """Limit of shift(e) / e^order for e to 0, its first two errors taken out."""
    sizes = SIZE * np.array([1.0, 0.5, 0.25])
    values = np.array([shift(e) / e**order for e in sizes])
    return (values[0] - 6.0 * values[1] + 8.0 * values[2]) / 3.0


@pytest.mark.parametrize(
    ("flow", "fields", "state"),
    [
        (ball_flow, brackets.ball_fields(RADIUS), BALL_STATE),
        (coin_flow, brackets.coin_fields(RADIUS), COIN_STATE),
    ],
)
def test_small_loops_move_along_the_brackets(flow, fields, state):
    def loop(e):
        return commutator(flow(0, e), flow(0, -e), flow(1, e), flow(1, -e))

    def nested(which, e):
        there, back = loop(e)
        return commutator(flow(which, e), flow(which, -e), there, back)[0]

    _, pair, triple = brackets.iterated_brackets(fields, state, 3)
    # Of the series in e the third error is left, e e/2 e/4 of brackets three deeper: 1 / radius^5.
    left = SIZE**3 / 8.0 / RADIUS**5
    moved = extrapolated(lambda e: loop(e)[0](state) - state, 2)
    np.testing.assert_allclose(moved, pair[0], rtol=0, atol=left)
    for which in (0, 1):
        moved = extrapolated(lambda e, which=which: nested(which, e)(state) - state, 3)
        np.testing.assert_allclose(moved, triple[which], rtol=0, atol=left / RADIUS)


def test_brackets_are_antisymmetric_and_obey_jacobi():
    def f(s):
        return np.array([s[1] * s[2], np.sin(s[0]), s[0] / (1.0 + s[1] * s[1])])

    def g(s):
        return np.array([np.cos(s[2]), s[0] * s[0], 1.0 - s[1]])

    def h(s):
        return np.array([s[2], 2.0 / s[0], s[0] * s[1]])

    at = np.array([0.7, -0.4, 1.2])
    together = brackets.bracket(f, g)(at) + brackets.bracket(g, f)(at)
    np.testing.assert_array_equal(together, 0.0)
    cyclic = [
        brackets.bracket(a, brackets.bracket(b, c))(at)
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
    growth = brackets.growth_vector((along, across), (0.2, 0.4, -1.0), 3)
    assert growth == (2, 2, 2)
    with pytest.raises(ValueError, match="cannot be steered everywhere"):
        brackets.degree_of_nonholonomy(growth, 3)


@pytest.mark.parametrize(
    ("function", "first", "second"),
    [
        (lambda x: 2.0 + x * 3.0 - x, lambda x: 2.0, lambda x: 0.0),
        (lambda x: 1.0 - 2.0 / x, lambda x: 2.0 / x**2, lambda x: -4.0 / x**3),
        (
            lambda x: x / (1.0 + x * x),
            lambda x: (1.0 - x**2) / (1.0 + x**2) ** 2,
            lambda x: 2.0 * x * (x**2 - 3.0) / (1.0 + x**2) ** 3,
        ),
        (
            lambda x: np.sin(x) * np.cos(2.0 * x),
            lambda x: 0.5 * (3.0 * np.cos(3.0 * x) - np.cos(x)),
            lambda x: 0.5 * (np.sin(x) - 9.0 * np.sin(3.0 * x)),
        ),
    ],
)
def test_dual_numbers_differentiate_once_and_nested_twice(function, first, second):
    x = 0.7
    once = function(Dual(x, 1.0))
    twice = function(Dual(Dual(x, 1.0), Dual(1.0, 0.0)))
    assert once.value == pytest.approx(function(x), rel=4 * EPS)
    assert once.slope == pytest.approx(first(x), rel=16 * EPS)
    assert twice.slope.slope == pytest.approx(second(x), rel=16 * EPS)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: brackets.ball_fields(0.0), "^radius = 0.0; expected"),
        (lambda: brackets.coin_fields(-1.0), "^radius = -1.0; expected"),
        (
            lambda: brackets.growth_vector(brackets.coin_fields(1.0), np.zeros((2, 4)), 2),
            r"state has shape \(2, 4\)",
        ),
        (
            lambda: brackets.growth_vector(brackets.coin_fields(1.0), np.zeros(4), 0),
            "^depth = 0; expected an integer",
        ),
        (
            lambda: brackets.growth_vector(brackets.coin_fields(1.0), np.full(4, np.nan), 1),
            r"^state\[0\] = nan; expected",
        ),
    ],
)
def test_bad_input_is_refused_by_name(call, message):
    with pytest.raises(ValueError, match=message):
        call()
