"""BallParkDynamic: pushed along a plan, from rest to rest."""

from functools import cache

import numpy as np
import pytest

from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.systems.dynamic_ball.controllers import PushAlong
from rigid_envs.systems.dynamic_ball.references import pushed
from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import BallParkDynamic, speed_bound
from rigid_envs.systems.rolling_ball.controllers import three_rolls
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.tasks.runs import at_random, bound, run, still

N = 200


def rows(n, **config):
    envs = RigidVectorEnv("rigid_envs.tasks:BallParkDynamic", n, **config)  # without a time limit
    envs.reset(seed=0)
    return envs


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_plan_that_is_tracked_parks_every_ball_at_rest(noise):
    found = run("BallParkDynamic", bound(pushed), N, action_noise=noise)
    assert found.success.all()
    assert np.mean(found.steps) < 33
    assert (found.steps < 45).all()


@cache
def plan_of(starts):
    """Plans, made once for all tests that begin alike."""
    task, y = BallParkDynamic(), np.frombuffer(starts).reshape(-1, 13)
    law = PushAlong(task.system(), task.force, task.dt)
    return law, law.plan(y, three_rolls(y[:, :6], RollingBall.state()))


class Blindly:
    """Forces along plans, without looking where the ball is."""

    def __init__(self):
        self.k, self.starts = 0, None

    def __call__(self, envs):
        y = envs.y
        self.starts = self.starts or y.tobytes()
        law, plan = plan_of(self.starts)
        k = min(self.k, len(plan.pushes) - 1)
        self.k += 1
        y[:, 4:6], y[:, 6:8] = plan.positions[k], plan.velocities[k]
        return law(y, plan.pushes[k], plan.positions[k], plan.velocities[k])


def test_a_plan_that_is_not_tracked_fails_in_noise():
    assert run("BallParkDynamic", Blindly(), N).success.all()
    assert np.mean(run("BallParkDynamic", Blindly(), N, action_noise=0.05).success) < 0.1


@pytest.mark.parametrize("policy", [still, at_random()])
def test_without_a_plan_no_ball_is_parked(policy):
    assert not run("BallParkDynamic", policy, N).success.any()


def test_a_pose_that_is_passed_at_speed_does_not_count():
    envs = rows(3)
    y = np.zeros((3, 13))
    y[:, 0], y[:, 6] = 1.0, (0.0, 0.049, 0.051)
    envs.reset(options={"state": y})
    *_, terminated, _, infos = envs.step(np.zeros((3, 2), dtype=np.float32))
    np.testing.assert_array_equal(infos["is_success"], [True, True, False])
    np.testing.assert_array_equal(terminated, [True, True, False])


def test_a_solid_sphere_takes_five_sevenths_of_the_acceleration():
    envs = rows(2, m=3.0, radius=0.7, force=1.5, position_tolerance=1e-6)
    push = np.array([[1.0, 0.0], [0.6, -0.8]], dtype=np.float32)
    before = envs.y[:, 6:8]
    for k in range(1, 11):
        envs.step(push)
        expected = before + 5.0 / 7.0 * 1.5 / 3.0 * 0.2 * k * push.astype(np.float64)
        np.testing.assert_allclose(envs.y[:, 6:8], expected, rtol=1e-13, atol=1e-15)


def test_without_force_the_ball_rolls_on():
    envs = rows(N, margin=1000.0, n_substeps=60)
    for _ in range(10):
        envs.step(np.full((N, 2), 0.5, dtype=np.float32))
    system, velocity = envs.systems[0], envs.y[:, 6:8]
    energy = system.energy(envs.y)
    for _ in range(100):
        envs.step(np.zeros((N, 2), dtype=np.float32))
    np.testing.assert_array_equal(envs.y[:, 6:8], velocity)
    np.testing.assert_allclose(system.energy(envs.y), energy, rtol=1e-15)


def test_the_episode_ends_where_the_plate_does():
    edge = 2.0 * np.sqrt(2.0) + 7.0
    envs = rows(2)
    y = np.zeros((2, 13))
    y[:, 0], y[:, 4] = 1.0, (edge - 0.01, edge + 0.01)
    envs.reset(options={"state": y})
    _, rewards, terminated, _, infos = envs.step(np.zeros((2, 2), dtype=np.float32))
    np.testing.assert_array_equal(terminated, [False, True])
    np.testing.assert_array_equal(infos["reward/off"], [0.0, -1.0])
    assert not infos["is_success"].any()
    assert rewards[1] < -20.0


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


@pytest.mark.parametrize("rate", [-2.0, 1.0, (0.0, 2.0)])
def test_what_is_seen_on_a_turntable_is_in_the_space(rate):
    config = {"frame": "reduced", "turntable_rate": rate, "n_substeps": 30}
    envs = RigidVectorEnv("rigid_envs.tasks:BallParkDynamic", 200, 100, **config)
    observations, _ = envs.reset(seed=0)
    assert (observations[:, 3] < -1.0).any()  # theta_z, which is not mirrored
    envs.action_space.seed(0)
    for _ in range(10):
        assert envs.observation_space.contains(observations)
        observations, *_ = envs.step(envs.action_space.sample())
