"""BallParkDynamic and BallPlate: pushed along plans, held by a regulator, on a table that moves."""

import numpy as np
import pytest

from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.systems.dynamic_ball.references import plate_regulator, pushed
from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import BallParkDynamic, speed_bound
from rigid_envs.systems.dynamic_ball.tasks.ball_plate import BallPlate
from tests.systems.runs import bound, run, still

N = 200


def rows(n, **config):
    # without a time limit
    envs = RigidVectorEnv("rigid_envs.systems.dynamic_ball.tasks:BallParkDynamic", n, **config)
    envs.reset(seed=0)
    return envs


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_plan_that_is_tracked_parks_every_ball_at_rest(noise):
    found = run("BallParkDynamic", bound(pushed), 40, action_noise=noise)
    assert found.success.all()
    assert np.mean(found.steps) < 33
    assert (found.steps < 45).all()


def test_rolling_off_costs_more_than_staying_for_the_whole_episode():
    assert np.min(run("BallParkDynamic", still, N).reward) > -BallParkDynamic().weight_off


@pytest.mark.parametrize("turntable_rate", [0.0, 0.3])
def test_no_ball_becomes_faster_than_the_step_allows_for(turntable_rate):
    config = {"turntable_rate": turntable_rate, "n_substeps": 8}
    envs = rows(N, **config)
    system = envs.systems[0]
    rng, reached = np.random.default_rng(0), np.zeros(N)
    edge = 2.0 * np.sqrt(2.0) + 7.0
    y = np.zeros((N, 13))
    angle = rng.uniform(0.0, 2.0 * np.pi, N)
    y[:, 0], y[:, 4], y[:, 5] = 1.0, 0.99 * edge * np.cos(angle), 0.99 * edge * np.sin(angle)
    envs.reset(options={"state": y})
    # from the edge always onwards, but for the first push, which is inward: a ball that gains most
    inward = -y[:, 4:6] / np.linalg.norm(y[:, 4:6], axis=1, keepdims=True)
    ended = np.zeros(N, dtype=bool)
    for _ in range(150):
        speed = np.linalg.norm(envs.y[:, 6:8], axis=1, keepdims=True)
        onward = np.where(speed > 0.0, envs.y[:, 6:8] / np.maximum(speed, 1e-9), inward)
        _, _, terminated, *_ = envs.step(onward.astype(np.float32))
        ended |= terminated
        rate = np.linalg.norm(system.omega_plate(envs.y), axis=1)
        reached = np.where(ended, reached, np.maximum(reached, rate))
    largest = BallParkDynamic(**config).largest_rate(10.0)
    assert ended.all()
    assert 0.5 * largest < np.max(reached) < largest


def test_the_bound_on_the_speed_solves_its_inequality():
    # w^3 <= 6 w + 1 + 6 kappa in units of reach and push, at the bound w = v - kappa and beyond
    for kappa in (0.0, 0.1, 1.0, 10.0, 1e3):
        v = speed_bound(1.0, 1.0, kappa)
        assert (v - kappa) ** 3 >= 6.0 * (v - kappa) + 1.0 + 6.0 * kappa


@pytest.mark.parametrize("turntable_rate", [0.0, -0.7])
def test_steps_on_the_level_plate_are_those_of_the_system_to_the_bit(turntable_rate):
    envs = rows(70, turntable_rate=turntable_rate, radius=0.7, beta=0.6, n_substeps=15)
    task, rng = envs.task, np.random.default_rng(5)
    y = envs.y
    y[:, 6:9] = rng.uniform(-1.0, 1.0, (70, 3))  # spinning, too
    envs.reset(options={"state": y})
    for _ in range(6):
        action = rng.uniform(-0.7, 0.7, (70, 2)).astype(np.float32)
        assert not envs.step(action)[2].any()
        force = task.force * np.concatenate([action, np.zeros((70, 2))], axis=1)
        y = task.system().advance(y, force, task.dt, task.n_substeps)
        np.testing.assert_array_equal(envs.y, y)


@pytest.mark.parametrize("name", ["tilt", "tilt_rate"])
def test_a_tilted_plate_is_refused(name):
    envs = rows(2)
    with pytest.raises(ValueError, match=rf"{name} = \[0\. +0\.1\]; expected 0"):
        envs.reset(options={"state": {name: [0.0, 0.1]}})


def table_rows(n, **config):
    # without a time limit
    envs = RigidVectorEnv("rigid_envs.systems.dynamic_ball.tasks:BallPlate", n, **config)
    envs.reset(seed=0)
    return envs


@pytest.mark.parametrize("turntable_rate", [0.0, 1.0, -2.0])
def test_the_regulator_holds_every_ball_on_its_point(turntable_rate):
    config = {"turntable_rate": turntable_rate, "n_substeps": 6}
    found = run("BallPlate", bound(plate_regulator), N, **config)
    assert found.success.all()
    assert (found.steps == 200).all()


@pytest.mark.parametrize("n_held", [1, 3, 30])
def test_no_action_tilts_the_table_beyond_its_limit(n_held):
    envs = table_rows(N, tilt_rate=1.5, margin=20.0, n_substeps=30)
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


@pytest.mark.parametrize("turntable_rate", [0.0, 1.0])
def test_no_ball_on_a_table_becomes_faster_than_the_step_allows_for(turntable_rate):
    config = {"turntable_rate": turntable_rate, "n_substeps": 6}
    envs = table_rows(1000, **config)
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
