"""Tops that are kept up, led into steady precession, or known to fall."""

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.systems.heavy_top.closed_forms import sleeping_exponents, steady_precession
from rigid_envs.systems.heavy_top.references import (
    asymmetric_balance,
    pivot_balance,
    precession_regulator,
    upright_balance,
)
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.heavy_top.tasks.sleeping_top import SleepingTopRandom
from tests.tasks.runs import at_random, bound, run, still

TOP = {"i_perp": 1.0, "i3": 0.5, "mgl": 1.0}
UPRIGHT = {
    "SleepingTop": upright_balance,
    "SleepingTopRandom": upright_balance,
    "PivotTop": pivot_balance,
    "TopRandom": asymmetric_balance,
}


def goals(envs):
    """Commanded tilts."""
    return envs.auxiliary("goal_tilt")


@pytest.mark.parametrize("name", UPRIGHT)
def test_tops_are_kept_upright_by_linear_feedback_from_every_start(name):
    assert run(name, bound(UPRIGHT[name])).success.all()


@pytest.mark.parametrize("branch", ["slow", "fast"])
def test_linear_feedback_leads_into_steady_precession_from_every_start(branch):
    found = run("TopPrecession", bound(precession_regulator), branch=branch)
    assert found.success.mean() >= 0.99


@pytest.mark.parametrize("policy", [still, at_random()], ids=["zero", "random"])
@pytest.mark.parametrize("name", ["SleepingTopRandom", "PivotTop", "TopPrecession", "TopRandom"])
def test_neither_rest_nor_chance_succeeds(name, policy):
    assert not run(name, policy).success.any()


def largest_tilts(share):
    """How far free tops tilt in 15 s that start 0.001 rad tilted, at a share of the critical spin.

    Each is compared with abs(theta / theta_0) of the linear equation, started without nodding.
    """
    config = {"start_tilt": 1e-3, "start_spin_low": share, "start_spin_high": share}
    y = run("SleepingTop", still, n=20, **config).y
    tilt = HeavyTop().tilt(y)
    a, b = sleeping_exponents(4.0 * share, **TOP)
    t = 0.05 * np.arange(len(y))
    linear = np.abs((a * np.exp(b * t) - b * np.exp(a * t)) / (a - b))
    return np.max(tilt, axis=0) / tilt[0], np.max(linear)


def test_above_the_sleeping_threshold_a_small_tilt_stays_small():
    for share in (1.03, 1.1, 2.0):
        found, linear = largest_tilts(share)
        # the tilt is 1e-3 (1 - 1/4.. 4): what is not linear in it is of the order of its square
        np.testing.assert_allclose(found, linear, rtol=1e-3)
        assert linear < 5.0


def test_below_the_sleeping_threshold_the_smallest_tilt_grows():
    for share in (0.97, 0.9, 0.5):
        found, linear = largest_tilts(share)
        assert linear > 10.0
        assert found.min() > 10.0


def test_steady_precession_needs_no_torque():
    for branch, name in enumerate(("slow", "fast")):
        envs = RigidVectorEnv("rigid_envs.tasks:TopPrecession", 100, branch=name)
        envs.reset(seed=0)
        goal, spin = goals(envs), envs.y[:, 6]
        rate = steady_precession(goal, spin, **TOP)[branch]
        zero = 0.0 * goal
        rates = np.stack([rate, zero, spin - rate * np.cos(goal)], axis=-1)
        angles = np.stack([zero, goal, zero], axis=-1)
        state = {
            "q": rotations.quaternion_from_euler(angles),
            "omega_body": rotations.omega_body_from_euler_rates(angles, rates),
        }
        envs.reset(seed=0, options={"state": state})
        np.testing.assert_allclose(precession_regulator(envs.task)(envs), 0.0, atol=1e-9)
        for _ in range(100):
            observation, *_, infos = envs.step(np.zeros((100, 2), dtype=np.float32))
        assert infos["is_success"].all()
        assert infos["cost"].max() == 0.0
        # float32 observations of angles up to 0.9 rad and rates up to 8 rad/s; the motion itself
        # keeps the root to the truncation error of its steps
        tilt, found, commanded, wanted = observation[:, 3:7].T
        np.testing.assert_allclose(tilt, commanded, rtol=2e-5)
        np.testing.assert_allclose(found, wanted, rtol=2e-5)
        np.testing.assert_allclose(wanted, rate, rtol=1e-6)


def test_leaving_the_arena_ends_the_episode():
    env = gym.make("RigidEnvs/PivotTop-v0").unwrapped
    for x, out in ((4.9, False), (4.99999, True)):
        env.reset(options={"state": {"pivot": (-x, 0.0), "pivot_velocity": (-1.0, 0.0)}})
        _, _, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
        assert terminated == out
        assert not info["is_success"]


def test_a_fall_ends_the_episode():
    env = gym.make("RigidEnvs/PivotTop-v0").unwrapped
    for tilt, fallen in ((0.49, False), (0.51, True)):
        q = rotations.quaternion_from_axis_angle([0.0, 1.0, 0.0], tilt)
        env.reset(options={"state": {"q": q, "omega_body": (0.0, 0.0, 0.0)}})
        _, _, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
        assert terminated == fallen  # within a step the tilt grows by tilt dt^2 / 2, 0.6 mrad
        assert not info["is_success"]


def test_the_centre_pays_an_upright_top_only():
    env = gym.make("RigidEnvs/PivotTop-v0").unwrapped
    paid = []
    for tilt in (0.0, 0.4):
        q = rotations.quaternion_from_axis_angle([0.0, 1.0, 0.0], tilt)
        env.reset(options={"state": {"q": q, "omega_body": (0.0, 0.0, 0.0)}})
        paid.append(env.step(np.zeros(2, dtype=np.float32))[4]["reward/centre"])
    assert paid[0] == 1.0
    np.testing.assert_allclose(paid[1], 1.0 / (1.0 + 10.0 * 0.4), rtol=2e-3)  # 0.5 mrad of falling


def test_accelerating_the_pivot_tilts_the_vertical():
    """In the frame of the pivot gravity is (-a, 0, -g): a top at rest along it stays there."""
    env = RigidEnv("rigid_envs.tasks:PivotTop", push=3.0, arena=1e6)
    lean = np.arctan2(3.0, 9.81)  # forwards, into the acceleration
    q = rotations.quaternion_from_axis_angle([0.0, 1.0, 0.0], lean)
    env.reset(options={"state": {"q": q, "omega_body": (0.0, 0.0, 0.0)}})
    for _ in range(40):
        env.step(np.array([1.0, 0.0], dtype=np.float32))
    # an equilibrium, though not a stable one: roundings grow by exp(2 s * 1/s)
    np.testing.assert_allclose(HeavyTop().tilt(env.y), lean, atol=1e-12)


def lyapunov_exponent(moments, time=150.0, interval=0.5):
    """Mean rate [1/s] at which neighbours of free motions part, by renormalising their distance.

    From 10 starts of the task; Benettin, Galgani, Giorgilli & Strelcyn 1980,
    doi:10.1007/BF02128236.
    """
    envs = RigidVectorEnv("rigid_envs.tasks:TopRandom", 10)
    envs.reset(seed=0)
    top, y, rng = HeavyTop(*moments), envs.y, np.random.default_rng(0)
    off = rng.normal(size=(10, 6))
    off *= 1e-7 / np.linalg.norm(off, axis=1, keepdims=True)
    total = 0.0
    for _ in range(round(time / interval)):
        near = y.copy()
        near[:, :4] = rotations.multiply(y[:, :4], rotations.exp(off[:, :3]))
        near[:, 4:7] += off[:, 3:]
        y, near = np.split(top.advance(np.concatenate([y, near]), None, interval, 20), 2)
        turn = rotations.log(rotations.multiply(rotations.conjugate(y[:, :4]), near[:, :4]))
        off = np.concatenate([turn, near[:, 4:7] - y[:, 4:7]], axis=1)
        size = np.linalg.norm(off, axis=1, keepdims=True)
        total += np.mean(np.log(size / 1e-7))
        off *= 1e-7 / size
    return total / time


def test_the_asymmetric_top_is_chaotic_and_the_symmetric_one_is_not():
    # An exponent of zero is estimated as log(t) / t, 0.03 after 150 s.
    assert lyapunov_exponent((0.925, 1.15, 0.55)) > 0.12
    assert lyapunov_exponent((1.0, 1.0, 0.5)) < 0.06


def test_every_drawn_top_can_be_caught_by_the_torque_there_is():
    """A start is caught if ``m g ell theta sqrt(1 - share^2) < torque`` (see the task)."""
    task = SleepingTopRandom()
    heaviest = task.m[1] * task.g * task.ell[1]
    worst = heaviest * task.start_tilt * np.sqrt(1.0 - task.start_spin_low**2)
    assert worst < 0.85 * task.torque
