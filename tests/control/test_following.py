"""Following a ball that rolls ahead: Lyapunov and Riccati functions along closed loops."""

import numpy as np
import pytest
from scipy.special import ellipj

from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import (
    DampedFollower,
    FarSightedFollower,
    elastica_headings,
    pose_error,
)
from rigid_envs.systems.rolling_ball.system import RollingBall

BALL = RollingBall(0.7)
RATE = 4.0
SPEED = 0.5 * RATE * 0.7


def starts(n, offset, angle, seed=0):
    """Balls near the origin, and a reference there, upright."""
    rng = np.random.default_rng(seed)
    q = rotations.exp(angle * rng.uniform(-1.0, 1.0, (n, 3)))
    return BALL.state(q=q, position=offset * rng.uniform(-1.0, 1.0, (n, 2)))


def circle(n_steps, dt, n, curvature=1.0):
    """Velocities of a reference on a polygon round a circle, shape (n_steps, n, 2)."""
    heading = SPEED * dt * curvature * np.arange(n_steps)[:, None] + np.arange(n)
    return SPEED * np.stack([np.cos(heading), np.sin(heading)], axis=-1)


def rolled(y, velocity, dt):
    return BALL.advance(y, np.concatenate([velocity, 0.0 * velocity[..., :1]], axis=-1), dt)


def simulate_closed_loop(act, y, velocities, dt):
    """States of ball and reference, and actions, over all periods."""
    reference, found = np.broadcast_to(BALL.state(), y.shape), []
    for k, velocity in enumerate(velocities):
        action = act(k, y, reference, velocity)
        found.append((y, reference, action))
        y, reference = rolled(y, RATE * 0.7 * action, dt), rolled(reference, velocity, dt)
    return [np.stack(part) for part in zip(*found, strict=True)]


@pytest.fixture(scope="module")
def damped():
    follower, dt = DampedFollower(BALL, RATE), 0.01
    return follower, simulate_closed_loop(
        lambda k, *now: follower(*now), starts(50, 0.7, 0.8), circle(2000, dt, 50), dt
    )


def test_the_lyapunov_function_of_damping_does_not_grow(damped):
    follower, (y, reference, _) = damped
    V = follower.lyapunov(y, reference)
    # Held for dt, a correction w goes on after the slope has changed: by |w|^2 dt / 2 and the like.
    assert np.max(np.diff(V, axis=0)) < 1e-4 * np.max(V)
    assert np.max(V[-1]) < 1e-3 * np.max(V[0])


def test_it_falls_as_fast_as_its_equation_says(damped):
    follower, (y, reference, action) = damped
    V = follower.lyapunov(y, reference)
    relative = RATE * action - circle(2000, 0.01, 50) / 0.7
    free = np.linalg.norm(action, axis=-1) < 1.0 - 1e-6  # s = 1
    fall = np.sum(relative**2, axis=-1) / 0.6
    found = -np.diff(V, axis=0) / 0.01
    # of first order in dt, relative to the largest fall of V
    np.testing.assert_allclose(
        found[free[:-1]], fall[:-1][free[:-1]], rtol=0, atol=0.03 * np.max(fall)
    )


@pytest.mark.parametrize("curvature", [0.0, 1.0])
def test_along_a_straight_line_one_error_stays_and_bends_take_it_away(curvature):
    follower, dt, start = DampedFollower(BALL, RATE), 0.02, starts(20, 0.05, 0.05)
    way = circle(1500, dt, 20, curvature)
    y, reference, _ = simulate_closed_loop(lambda k, *now: follower(*now), start, way, dt)
    error = pose_error(BALL, y, reference)
    size = np.linalg.norm(error, axis=-1)
    across = np.stack([error[..., 3], -error[..., 2]], axis=-1) - error[..., :2]
    stays = np.sum(across * way / SPEED, axis=-1)
    if curvature == 0.0:  # to first order in the error
        assert (np.abs(stays[-1] - stays[0]) < size[0] ** 2).all()
        assert (np.abs(stays[0]) > 5.0 * size[0] ** 2).sum() > 5
    else:
        assert (size[-1] < 1e-3 * size[0]).all()


@pytest.fixture(scope="module")
def ahead():
    follower, velocities = FarSightedFollower(BALL, RATE, 0.1), circle(200, 0.1, 30)
    return follower, velocities, follower.regulator(velocities)


def test_the_riccati_value_is_the_cost_of_small_errors(ahead):
    follower, velocities, regulator = ahead
    size = 1e-4
    y, reference, action = simulate_closed_loop(
        lambda k, *now: follower(*now, regulator.gain[k]), starts(30, size, size), velocities, 0.1
    )
    error, w = pose_error(BALL, y, reference), RATE * action - velocities / 0.7
    cost = np.sum(error**2, axis=-1) + 0.03 * np.sum(w**2, axis=-1)
    to_go = np.cumsum(cost[::-1], axis=0)[::-1]
    value = np.einsum("...i,...ij,...j", error, regulator.riccati, error)
    # the linearised error is off by its square, in parts of itself; at the end rounding is left
    big = value > 1e-4 * value[0]
    np.testing.assert_allclose(to_go[big], value[big], rtol=100 * size)
    assert (np.diff(value, axis=0)[big[:-1]] < 0.0).all()


def test_the_regulator_brings_in_errors_of_a_radius_and_a_radian(ahead):
    follower, velocities, regulator = ahead
    y, reference, _ = simulate_closed_loop(
        lambda k, *now: follower(*now, regulator.gain[k]), starts(30, 0.7, 0.57), velocities, 0.1
    )
    size = np.linalg.norm(pose_error(BALL, y, reference), axis=-1)
    assert (size[150] < 1e-3 * size[0]).all()


def test_no_other_linear_feedback_costs_less(ahead):
    """Perturbed gains cost more, to second order: the first variation vanishes."""
    follower, velocities, regulator = ahead
    F, G = follower._steps(velocities)
    rng = np.random.default_rng(3)
    change = rng.standard_normal((200, 1, 2, 5))

    def cost(gain):
        P = np.eye(5)
        for f, g, K in zip(F[::-1], G[::-1], gain[::-1], strict=True):
            A = f - g @ K
            P = np.eye(5) + 0.03 * np.swapaxes(K, -1, -2) @ K + np.swapaxes(A, -1, -2) @ P @ A
        return np.trace(P, axis1=-2, axis2=-1)

    best = cost(regulator.gain)
    np.testing.assert_allclose(best, np.trace(regulator.riccati[0], axis1=-2, axis2=-1), rtol=1e-12)
    for size in (1e-2, -1e-2, 1e-3):
        assert (cost(regulator.gain + size * change) > best).all()


def test_the_linearised_step_is_that_of_the_balls():
    follower = FarSightedFollower(BALL, RATE, 0.1)
    velocity = np.array([1.0, 0.6])
    (F,), (G,) = follower._steps(velocity[None])
    h = 1e-6
    for k in range(7):
        change = h * np.eye(7)[k]
        y = BALL.state(q=rotations.exp(change[2:5]), position=0.7 * change[:2])
        after = rolled(y, velocity + 0.7 * change[5:], 0.1)
        error = pose_error(BALL, after, rolled(BALL.state(), velocity, 0.1)) / h
        # differences: truncation h, rounding 1e-16 / h
        np.testing.assert_allclose(error, np.hstack([F, G])[:, k], rtol=0, atol=1e-5)


def test_the_pose_error_is_that_of_rolling_there():
    way = np.array([0.2, -0.3])
    y = BALL.state(q=rolling_ball.roll_straight(way, 0.7), position=way)
    expected = np.concatenate([way, [0.3, 0.2, 0.0]]) / 0.7
    np.testing.assert_allclose(pose_error(BALL, y, BALL.state()), expected, rtol=1e-14)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_no_velocity_is_larger_than_the_largest_and_the_correction_keeps_its_direction(share):
    follower = DampedFollower(BALL, RATE)
    y = starts(200, 10.0, 1.0)
    velocity = share * RATE * 0.7 * np.array([0.6, 0.8])
    action = follower(y, BALL.state(), velocity)
    assert np.max(np.linalg.norm(action, axis=-1)) <= 1.0 + 1e-12
    p, theta = np.split(pose_error(BALL, y, BALL.state()), [2], axis=-1)
    wanted = -p - 1.2 * np.stack([theta[:, 1], -theta[:, 0]], axis=-1)
    added = action - share * np.array([0.6, 0.8])
    inner = np.sum(wanted * added, axis=-1)
    assert (inner >= -1e-12).all()
    np.testing.assert_allclose(
        inner, np.linalg.norm(wanted, axis=-1) * np.linalg.norm(added, axis=-1), atol=1e-9
    )
    # as far as to the edge of the disk
    assert np.sum(np.linalg.norm(action, axis=-1) > 1.0 - 1e-9) > 50


def test_each_row_of_a_batch_is_followed_as_alone(ahead):
    follower, velocities, regulator = ahead
    y, reference = starts(30, 0.5, 0.5), starts(30, 0.1, 0.1, seed=1)
    actions = follower(y, reference, velocities[0], regulator.gain[0])
    damped = DampedFollower(BALL, RATE)(y, reference, velocities[0])
    for k in range(0, 30, 7):
        alone = follower.regulator(velocities[:, k])
        now = y[k], reference[k], velocities[0, k]
        np.testing.assert_allclose(follower(*now, alone.gain[0]), actions[k], rtol=1e-12)
        np.testing.assert_allclose(DampedFollower(BALL, RATE)(*now), damped[k], rtol=1e-12)


def test_headings_ahead_are_those_of_the_elastica_to_second_order():
    k, w = 0.8, 1.3  # modulus, wavenumber [1/m]
    heading, force = np.array([0.6, 0.8]), w**2 * np.array([0.6, 0.8])
    errors = []
    for n in (100, 200):
        way = 5.0 / n
        found = elastica_headings(heading, np.array(2.0 * k * w), force, way, n)
        sn, _, dn, _ = ellipj(w * way * np.arange(n), k**2)
        # heading - axis = 2 arcsin(k sn)
        across = heading[0] * found[:, 1] - heading[1] * found[:, 0]
        errors.append(np.max(np.abs(across - 2.0 * k * sn * dn)))
    assert errors[1] < 1e-3
    assert 3.9 < errors[0] / errors[1] < 4.1


def test_bad_numbers_are_refused():
    with pytest.raises(ValueError, match="rate = 0"):
        DampedFollower(BALL, 0.0)
    with pytest.raises(ValueError, match="input_weight = -1"):
        FarSightedFollower(BALL, RATE, 0.1, input_weight=-1.0)
    with pytest.raises(ValueError, match=r"expected at most radius \* rate = 2.8 \[m/s\]"):
        DampedFollower(BALL, RATE)(BALL.state(), BALL.state(), [3.0, 0.0])
    with pytest.raises(ValueError, match="velocities has shape"):
        FarSightedFollower(BALL, RATE, 0.1).regulator(np.zeros((4, 3)))
