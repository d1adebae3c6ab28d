"""BallPlate: a regulator holds the ball; the table moves as it is said to."""

from itertools import pairwise

import numpy as np
import pytest

from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.systems.dynamic_ball.references import plate_regulator
from rigid_envs.systems.dynamic_ball.tasks.ball_plate import BallPlate
from tests.tasks.runs import at_random, bound, run, still

N = 200


def rows(n, **config):
    envs = RigidVectorEnv("rigid_envs.tasks:BallPlate", n, **config)  # without a time limit
    envs.reset(seed=0)
    return envs


@pytest.mark.parametrize("turntable_rate", [0.0, 1.0, -2.0])
def test_the_regulator_holds_every_ball_on_its_point(turntable_rate):
    config = {"turntable_rate": turntable_rate, "n_substeps": 6}
    found = run("BallPlate", bound(plate_regulator), N, **config)
    assert found.success.all()
    assert (found.steps == 200).all()


@pytest.mark.parametrize("policy", [still, at_random()])
def test_without_control_no_ball_is_held(policy):
    assert not run("BallPlate", policy, N).success.any()


@pytest.mark.parametrize(("beta", "part"), [(0.4, 2.0 / 7.0), (2.0 / 3.0, 2.0 / 5.0)])
def test_on_a_turntable_a_free_ball_goes_round_at_two_sevenths_of_its_rate(beta, part):
    table = 1.3
    envs = rows(N, beta=beta, turntable_rate=table, n_substeps=10, margin=6.0)
    place, velocity = np.moveaxis(envs.y[:, 4:8].reshape(N, 2, 2), 1, 0)
    rate = part * table
    # v' = rate n x v: the centre of the circle is at rest
    centre = place + np.stack([-velocity[:, 1], velocity[:, 0]], axis=-1) / rate
    for k in range(1, 101):
        envs.step(np.zeros((N, 2), dtype=np.float32))
        c, s = np.cos(rate * 0.1 * k), np.sin(rate * 0.1 * k)
        turn = np.array([[c, -s], [s, c]])
        # velocities turn exactly; of the way, a step h is off by (rate h)^5 / 1e3 at most
        np.testing.assert_allclose(envs.y[:, 6:8], velocity @ turn.T, rtol=0, atol=1e-13)
        expected = centre + (place - centre) @ turn.T
        np.testing.assert_allclose(envs.y[:, 4:6], expected, rtol=0, atol=1e-10)


def test_tilt_rates_are_reached_within_the_step_and_held():
    envs = rows(3, tilt_limit=0.5, n_substeps=4)
    action = np.array([[0.5, -1.0], [0.0, 0.25], [-1.0, 1.0]], dtype=np.float32)
    angles = [envs.y[:, 9:11]]
    for _ in range(4):
        envs.step(action)
        np.testing.assert_allclose(envs.y[:, 11:13], 0.4 * action.astype(float), rtol=1e-14)
        angles.append(envs.y[:, 9:11])
    # linearly in the first period, constant in the others
    np.testing.assert_allclose(angles[1], 0.5 * 0.1 * 0.4 * action, rtol=1e-6)
    for before, after in pairwise(angles[1:]):
        np.testing.assert_allclose(after - before, 0.1 * 0.4 * action, rtol=1e-6)


@pytest.mark.parametrize("n_held", [1, 3, 30])
def test_no_action_tilts_the_table_beyond_its_limit(n_held):
    envs = rows(N, tilt_rate=1.5, margin=20.0, n_substeps=30)
    rng = np.random.default_rng(n_held)
    limit, dt = envs.task.tilt_limit, envs.task.dt
    for k in range(300):
        if k % n_held == 0:
            action = rng.choice([-1.0, -0.3, 0.0, 1.0], (N, 2)).astype(np.float32)
        angle, rate = envs.y[:, 9:11], envs.y[:, 11:13]
        envs.step(action)
        change = envs.y[:, 11:13] - rate
        # inside a period the angle is a parabola; it is largest where the rate passes through 0
        passes = (rate * envs.y[:, 11:13] < 0.0) & (change != 0.0)
        inside = angle - 0.5 * dt * rate**2 / np.where(passes, change, np.inf)
        largest = np.maximum(np.abs(envs.y[:, 9:11]), np.where(passes, np.abs(inside), 0.0))
        assert np.max(largest) <= limit * (1.0 + 1e-12)
    assert np.max(largest) > 0.9 * limit


def test_a_table_that_is_held_at_its_limit_is_at_rest_there():
    envs = rows(2)
    for _ in range(20):
        envs.step(np.array([[1.0, -1.0], [-1.0, 1.0]], dtype=np.float32))
    np.testing.assert_allclose(np.abs(envs.y[:, 9:11]), 0.1, rtol=1e-12)
    np.testing.assert_allclose(envs.y[:, 11:13], 0.0, rtol=0, atol=1e-12)


def test_tilting_carries_the_ball_the_wrong_way_first():
    envs = rows(1)
    envs.reset(options={"state": np.eye(13)[:1]})  # at rest in the middle
    for k in range(10):
        envs.step(np.array([[0.0, 1.0]], dtype=np.float32))
        x, tilt = envs.y[0, 4], envs.y[0, 10]
        assert tilt > 0.0  # towards +X
        if k == 0:
            # X'' = g alpha / (1 + beta) - radius alpha'', and alpha'' = 4 rad/s^2 for 0.1 s
            np.testing.assert_allclose(x, -0.5 * 4.0 * 0.01 + 7.0 * 4.0 * 1e-4 / 24.0, rtol=1e-3)
    assert x > 0.0


def test_the_episode_ends_where_the_table_does():
    envs = rows(2)
    y = np.zeros((2, 13))
    y[:, 0], y[:, 4] = 1.0, (3.99, 4.01)
    envs.reset(options={"state": y})
    *_, terminated, _, infos = envs.step(np.zeros((2, 2), dtype=np.float32))
    np.testing.assert_array_equal(terminated, [False, True])
    assert not infos["is_success"].any()


def test_success_is_two_seconds_near_the_point():
    envs = rows(2)
    state = envs.get_state()
    point = state["aux"][:, :2]
    y = np.zeros((2, 13))
    y[:, 0], y[:, 4:6] = 1.0, point + np.array([[0.049, 0.0], [0.0, 0.051]])
    envs.reset(options={"state": y})
    state = envs.get_state()
    state["aux"][:, :2] = point
    envs.set_state(state)
    for k in range(1, 30):
        *_, infos = envs.step(np.zeros((2, 2), dtype=np.float32))
        np.testing.assert_array_equal(infos["is_success"], [k >= 20, False])


def test_balls_and_points_are_drawn_in_their_discs():
    envs = rows(5000)
    y, point = envs.y, envs.auxiliary("point_X", "point_Y")
    for pair, radius in ((y[:, 4:6], 2.0), (point, 2.0), (y[:, 6:8], 0.5)):
        square = np.sum(pair**2, axis=1) / radius**2
        assert np.max(square) <= 1.0
        # uniform in a disc: its square radius is uniform in [0, 1], of deviation 0.29
        assert abs(np.mean(square) - 0.5) < 4.0 * 0.29 / np.sqrt(5000)
    assert not y[:, 8:].any()


@pytest.mark.parametrize("turntable_rate", [0.0, 1.0])
def test_no_ball_becomes_faster_than_the_step_allows_for(turntable_rate):
    config = {"turntable_rate": turntable_rate, "n_substeps": 6}
    envs = rows(1000, **config)
    system, largest, reached = envs.systems[0], BallPlate(**config).largest_rate(40.0), 0.0
    for k in range(400):
        # downhill along the velocity, by half of the rows; the other half to and fro
        vx, vy = envs.y[:, 6], envs.y[:, 7]
        onward = np.sign(np.stack([-vy, vx], axis=1))
        swing = np.sign(np.sin(0.003 * np.arange(1000)[:, None] * k + np.array([0.0, 1.0])))
        action = np.where(np.arange(1000)[:, None] % 2, onward, swing)
        envs.step(action.astype(np.float32))
        reached = max(reached, np.max(np.linalg.norm(system.omega_plate(envs.y), axis=1)))
    assert 0.25 * largest < reached < largest
