"""Rolling along elasticae, against closed forms, another integrator and differences."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball import elastica

# first heading, a'(0), X, Y, length
WAVE = np.array([0.4, 1.0, 12.0, -7.0, 5.0])
LOOP = np.array([-2.0, 9.0, -20.0, 5.0, 6.0])
HOME = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


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


def test_without_pull_the_ball_rolls_round_a_circle():
    rho = 0.8
    end = traced([0.0, 2.0 * np.pi, 0.0, 0.0, 2.0 * np.pi * rho], 1, 2000)[-1]
    # it starts along x, at the lowest point of the circle
    around = rolling_ball.circle_holonomy(rho, 1.0, phase=-0.5 * np.pi)
    # 20 000 additions to a heading of up to 2 pi, each rounded by up to 4.4e-16
    np.testing.assert_allclose(end[6:8], 0.0, atol=1e-11)
    assert rotations.distance(end[2:6], around) < 1e-11


def test_a_path_in_parts_is_the_path():
    whole, parts = traced(LOOP, 1, 400), traced(LOOP, 8, 50)
    np.testing.assert_allclose(parts[-1], whole[-1], atol=1e-13)
    np.testing.assert_array_equal(parts[0], [0.0, LOOP[1], 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def linearised(x, target, n=10):
    m = np.empty((5, 6))
    missed = elastica.linearise(tuple(x), tuple(target), n, m)
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
    elastica.shoot_rows(rows, pose(x, 30), 30)
    # to 1e-12 of the pose, times the condition of the equations, below 100 here
    np.testing.assert_allclose(rows, np.broadcast_to(x, (20, 5)), atol=1e-10)


def test_where_newtons_method_finds_no_path_the_length_is_infinite():
    far = np.array([1.0, 0.0, 0.0, 0.0, 1e6, 0.0])
    rows = WAVE[None].copy()
    elastica.shoot_rows(rows, far, 10)
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
