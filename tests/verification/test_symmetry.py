"""Physics knows no preferred frame, hand, name of an axis or direction of time.

Turned, mirrored and reversed problems take the same steps: only roundings differ, and what the
motion makes of them. Renamed axes do not: the splitting treats e2 apart, so the truncation error
differs, and the step is taken so small (1/256 rad) that it is below the bar of 1e-10.
"""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.verification.measures import random_attitude, random_moments

T = np.linspace(0.0, 8.0, 41)
SEEDS = range(4)
BAR = 1e-10
MIRROR = np.diag([1.0, -1.0, 1.0])  # y -> -y, of the world and of the body


def rotation(q):
    return Rotation.from_quat(q, scalar_first=True)


def quaternion(turn):
    return turn.as_quat(scalar_first=True)


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=BAR)


def inputs(rng, n):
    """Inputs held over each interval of T."""
    return rng.uniform(-0.3, 0.3, (len(T) - 1, n))


def body_and_start(seed):
    rng = np.random.default_rng([20, seed])
    body = FreeBody(*random_moments(rng))
    return body, body.state(q=random_attitude(rng), omega_body=rng.normal(size=3)), rng


def top_and_start(seed):
    rng = np.random.default_rng([21, seed])
    top = HeavyTop(*random_moments(rng), m=0.7, ell=0.1)
    y = top.state(
        q=random_attitude(rng),
        omega_body=rng.normal(size=3),
        pivot=rng.normal(size=2),
        pivot_velocity=rng.normal(size=2),
    )
    return top, y, rng


def ball_and_start(seed):
    rng = np.random.default_rng([22, seed])
    ball = RollingBall(rng.uniform(0.3, 2.0))
    return ball, ball.state(q=random_attitude(rng), position=rng.normal(size=2)), rng


def about_vertical(angle):
    """Rotation about the vertical, of three components and of two."""
    turn = Rotation.from_rotvec((0.0, 0.0, angle))
    return turn, turn.as_matrix()[:2, :2]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_turned_world_turns_the_free_body(seed):
    body, y, rng = body_and_start(seed)
    u, turn = inputs(rng, 3), rotation(random_attitude(rng))
    turned = np.concatenate([quaternion(turn * rotation(y[:4])), y[4:]])
    one, two = body.simulate(y, T, u), body.simulate(turned, T, u)
    np.testing.assert_array_equal(one["omega_body"], two["omega_body"])  # never sees the world
    close(turn.as_matrix() @ one["R"], two["R"])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_world_turned_about_the_vertical_turns_the_top(seed):
    top, y, rng = top_and_start(seed)
    u, (turn, plane) = inputs(rng, 8), about_vertical(rng.uniform(0.0, 6.0))
    q = quaternion(turn * rotation(y[:4]))
    turned = np.concatenate([q, y[4:7], plane @ y[7:9], plane @ y[9:11]])
    v = np.hstack([u[:, :3], turn.apply(u[:, 3:6]), u[:, 6:8] @ plane.T])
    one, two = top.simulate(y, T, u), top.simulate(turned, T, v)
    close(one["omega_body"], two["omega_body"])
    close(turn.as_matrix() @ one["R"], two["R"])
    close(one["pivot"] @ plane.T, two["pivot"])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_world_turned_about_the_vertical_turns_the_ball(seed):
    ball, y, rng = ball_and_start(seed)
    u, (turn, plane) = inputs(rng, 3), about_vertical(rng.uniform(0.0, 6.0))
    turned = np.concatenate([quaternion(turn * rotation(y[:4])), plane @ y[4:]])
    v = np.hstack([u[:, :2] @ plane.T, u[:, 2:]])
    one, two = ball.simulate(y, T, u), ball.simulate(turned, T, v)
    close(turn.as_matrix() @ one["R"], two["R"])
    close(one["position"] @ plane.T, two["position"])


# In the mirror a rotation R becomes M R M, and vectors of rotation change the other signs.
FLIPPED_QUATERNION = np.array([1.0, -1.0, 1.0, -1.0])
AXIAL = np.array([-1.0, 1.0, -1.0])
POLAR = np.array([1.0, -1.0])


@pytest.mark.parametrize("seed", SEEDS)
def test_in_the_mirror_the_free_body_moves_as_it_should(seed):
    body, y, rng = body_and_start(seed)
    u = inputs(rng, 3)
    one = body.simulate(y, T, u)
    two = body.simulate(np.concatenate([FLIPPED_QUATERNION * y[:4], AXIAL * y[4:]]), T, AXIAL * u)
    close(AXIAL * one["omega_body"], two["omega_body"])
    close(MIRROR @ one["R"] @ MIRROR, two["R"])


@pytest.mark.parametrize("seed", SEEDS)
def test_in_the_mirror_the_top_moves_as_it_should(seed):
    top, y, rng = top_and_start(seed)
    u = inputs(rng, 8)
    signs = np.concatenate([FLIPPED_QUATERNION, AXIAL, POLAR, POLAR])
    one = top.simulate(y, T, u)
    two = top.simulate(signs * y, T, np.concatenate([AXIAL, AXIAL, POLAR]) * u)
    close(AXIAL * one["omega_body"], two["omega_body"])
    close(MIRROR @ one["R"] @ MIRROR, two["R"])
    close(POLAR * one["pivot"], two["pivot"])


@pytest.mark.parametrize("seed", SEEDS)
def test_in_the_mirror_the_ball_rolls_as_it_should(seed):
    ball, y, rng = ball_and_start(seed)
    u = inputs(rng, 3)
    one = ball.simulate(y, T, u)
    signs = np.concatenate([FLIPPED_QUATERNION, POLAR])
    two = ball.simulate(signs * y, T, np.array([1.0, -1.0, -1.0]) * u)
    close(MIRROR @ one["R"] @ MIRROR, two["R"])
    close(POLAR * one["position"], two["position"])


def relabelling(order):
    """Rotation matrix whose rows are the old axes in new order, the hand kept by a sign."""
    P = np.eye(3)[list(order)]
    return P * np.linalg.det(P)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("seed", SEEDS)
def test_names_of_the_axes_do_not_matter_to_the_free_body(order, seed):
    body, y, rng = body_and_start(seed)
    t, u, P = T[:11], inputs(rng, 3)[:10], relabelling(order)
    renamed = FreeBody(*body.moments[list(order)])
    # v_new = P v, so R_new = R P^T.
    q = quaternion(rotation(y[:4]) * Rotation.from_matrix(P.T))
    step = 1.0 / 256.0 / 4.0  # at most 4 rad/s
    one = body.simulate(y, t, u, max_step=step)
    two = renamed.simulate(np.concatenate([q, P @ y[4:]]), t, u @ P.T, max_step=step)
    assert np.max(np.linalg.norm(one["omega_body"], axis=-1)) < 4.0
    close(one["omega_body"] @ P.T, two["omega_body"])
    close(one["R"] @ P.T, two["R"])


@pytest.mark.parametrize("seed", SEEDS)
def test_names_of_the_transverse_axes_do_not_matter_to_the_top(seed):
    top, y, rng = top_and_start(seed)
    t, u = T[:11], inputs(rng, 8)[:10]
    P = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    renamed = HeavyTop(top.I2, top.I1, top.I3, top.m, top.g, top.ell)
    q = quaternion(rotation(y[:4]) * Rotation.from_matrix(P.T))
    step = 1.0 / 256.0 / 8.0
    one = top.simulate(y, t, u, max_step=step)
    v = np.hstack([u[:, :3] @ P.T, u[:, 3:]])
    two = renamed.simulate(np.concatenate([q, P @ y[4:7], y[7:]]), t, v, max_step=step)
    assert np.max(np.linalg.norm(one["omega_body"], axis=-1)) < 8.0
    close(one["omega_body"] @ P.T, two["omega_body"])
    close(one["R"] @ P.T, two["R"])


@pytest.mark.parametrize("seed", SEEDS)
def test_marks_on_the_ball_do_not_matter_to_its_rolling(seed):
    ball, y, rng = ball_and_start(seed)
    u, marks = inputs(rng, 3), rotation(random_attitude(rng))
    other = np.concatenate([quaternion(rotation(y[:4]) * marks), y[4:]])
    one, two = ball.simulate(y, T, u), ball.simulate(other, T, u)
    close(one["R"] @ marks.as_matrix(), two["R"])
    np.testing.assert_array_equal(one["position"], two["position"])


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("make", [body_and_start, top_and_start])
def test_with_all_velocities_reversed_the_motion_goes_back(make, seed):
    system, y, rng = make(seed)
    t, u = T[:21], inputs(rng, len(system.input_entries))[:20]
    forth = system.simulate(y, t, u, max_step=0.02)
    turned = forth.y[-1].copy()
    turned[4:7] *= -1.0
    turned[9:11] *= -1.0  # of the pivot, where there is one
    back = system.simulate(turned, t, u[::-1], max_step=0.02)  # forces stay as they were
    close(back["omega_body"][::-1], -forth["omega_body"])
    close(back["R"][::-1], forth["R"])


@pytest.mark.parametrize("seed", SEEDS)
def test_with_its_velocity_reversed_the_ball_rolls_back(seed):
    ball, y, rng = ball_and_start(seed)
    u = inputs(rng, 3)
    forth = ball.simulate(y, T, u)
    back = ball.simulate(forth.y[-1], T, -u[::-1])
    close(back["R"][::-1], forth["R"])
    close(back["position"][::-1], forth["position"])


@pytest.mark.parametrize("seed", SEEDS)
def test_heavier_and_harder_pushed_in_proportion_moves_the_same(seed):
    body, y, rng = body_and_start(seed)
    u = inputs(rng, 3)
    heavier = FreeBody(*(3.0 * body.moments))
    one, two = body.simulate(y, T, u), heavier.simulate(y, T, 3.0 * u)
    close(one.y, two.y)


@pytest.mark.parametrize("seed", SEEDS)
def test_twice_as_fast_takes_half_the_time(seed):
    body, y, rng = body_and_start(seed)
    u = inputs(rng, 3)
    faster = np.concatenate([y[:4], 2.0 * y[4:]])
    one = body.simulate(y, T, u, max_step=0.01)
    two = body.simulate(faster, 0.5 * T, 4.0 * u, max_step=0.005)
    close(2.0 * one["omega_body"], two["omega_body"])
    close(one["R"], two["R"])
