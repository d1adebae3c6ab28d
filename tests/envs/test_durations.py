"""The time limit in force enters the stability check."""

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.tasks.registry import ENVIRONMENTS

LONG = 1000  # steps; the registered limit of Reorient is 100
FULL = np.ones(3, dtype=np.float32)


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_the_registered_limit_is_within_the_envelope_and_rates_grow_with_the_duration(env_id):
    task = gym.make(env_id).unwrapped.task
    limit = ENVIRONMENTS[env_id].max_episode_steps
    rates = [task.largest_rate(n * task.dt) for n in (0, limit // 2, limit, 10 * limit)]
    assert rates == sorted(rates)
    assert rates[2] * task.dt / task.n_substeps <= task.largest_turn
    assert task.stable_steps() >= limit


def test_a_vector_environment_refuses_a_limit_that_leaves_the_envelope():
    with pytest.raises(ConfigError, match=r"^config\.dt: .*1000 steps .*n_substeps >= \d+$"):
        gym.make_vec("RigidEnvs/Reorient-v0", num_envs=2, max_episode_steps=LONG)
    remedy = {"n_substeps": 20}
    gym.make_vec("RigidEnvs/Reorient-v0", num_envs=2, max_episode_steps=LONG, **remedy)


def test_a_single_environment_refuses_the_step_that_leaves_the_envelope():
    env = gym.make("RigidEnvs/Reorient-v0", max_episode_steps=LONG)
    task = env.unwrapped.task
    stable = task.stable_steps()
    assert 100 < stable < LONG
    env.reset(seed=0)
    for _ in range(stable):
        env.step(FULL)
    before = env.unwrapped.get_state()
    with pytest.raises(ConfigError, match=rf"elapsed = {stable} steps; expected a reset before"):
        env.step(FULL)
    for name, part in env.unwrapped.get_state().items():
        np.testing.assert_array_equal(part, before[name])
    env.reset()
    env.step(FULL)  # a new episode is as long as any


def test_a_clock_that_is_set_counts():
    env = RigidEnv("rigid_envs.systems.free_body.tasks:Reorient")
    env.reset(seed=0)
    state = env.get_state()
    state["clock"][3] = env.task.stable_steps()
    env.set_state(state)
    with pytest.raises(ConfigError, match="expected a reset before"):
        env.step(FULL)


def test_rows_without_a_limit_are_refused_the_same_step():
    envs = RigidVectorEnv("rigid_envs.systems.free_body.tasks:Reorient", 2)
    envs.reset(seed=0)
    stable = envs.task.stable_steps()
    actions = np.ones((2, 3), dtype=np.float32)
    for _ in range(stable):
        envs.step(actions)
    with pytest.raises(ConfigError, match="expected a reset before"):
        envs.step(actions)


def test_the_longest_limit_is_played_to_its_end_and_on():
    longest = RigidEnv("rigid_envs.systems.free_body.tasks:Reorient").task.stable_steps()
    envs = RigidVectorEnv(
        "rigid_envs.systems.free_body.tasks:Reorient", 2, max_episode_steps=longest
    )
    envs.reset(seed=0)
    still = np.zeros((2, 3), dtype=np.float32)
    ends = [envs.step(still)[3].all() for _ in range(longest + 2)]
    assert [k for k, end in enumerate(ends) if end] == [longest - 1]


def test_what_nothing_can_make_faster_goes_on_for_ever():
    env = RigidEnv("rigid_envs.systems.rolling_ball.tasks:BallPark")
    assert env.task.stable_steps() == 2**31
    env.reset(seed=0)
    for _ in range(250):
        env.step(np.zeros(2, dtype=np.float32))


@pytest.mark.parametrize("name", ["IntermediateAxis", "IntermediateAxisRandom", "SleepingTop"])
def test_beyond_the_envelope_of_the_system_the_energy_stays_bounded(name):
    # these tasks allow more than their system: rates of full torque until the end of the episode
    env_id = f"RigidEnvs/{name}-v0"
    envs = gym.make_vec(env_id, num_envs=64, max_episode_steps=2001, n_substeps=1, torque=1e-3)
    task = envs.unwrapped.task
    rate = task.largest_turn / task.dt
    rng = np.random.default_rng(0)
    axes, moments = rng.normal(size=(64, 3)), envs.unwrapped.task.system().moments
    turns = [np.linalg.norm(rates, axis=1) for rates in (axes, axes * moments / moments[1])]
    omega = 0.8 * rate * axes / np.max(turns, axis=0)[:, None]  # drawn moments differ
    envs.reset(seed=0, options={"state": {"omega_body": omega}})
    systems = envs.unwrapped.systems
    states = []
    for _ in range(2000):
        envs.step(np.zeros(envs.action_space.shape, dtype=np.float32))
        states.append(envs.unwrapped.y)
    y = np.array(states)
    energies = np.stack([s.invariants(y[:, k])["energy"] for k, s in enumerate(systems)], axis=1)
    first, last = energies[:200], energies[-200:]
    scale = np.abs(first).mean(axis=0)
    # bounded: what is seen in the first 200 steps is seen in the last 200, and no more
    assert np.max(np.abs(last - first.mean(axis=0)) / scale) < 2 * max(
        np.max(np.abs(first - first.mean(axis=0)) / scale), 1e-6
    )
