"""Dictionaries of goals and numbered choices go through the adapter to the bit."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from rigid_envs.sb3.adapter import GymnasiumVecEnv, NonFiniteError, make_vec_env
from rigid_envs.scores.policies import RandomPolicy

GOAL = "RigidEnvs/BallParkGoal-v0"
GRID = "RigidEnvs/BallGrid-v0"
CART = "CartPole-v1"
N = 3


def native(env_id: str, **kwargs: Any) -> GymnasiumVecEnv:
    return make_vec_env(env_id, N, **kwargs)


def assert_same(mine: Any, theirs: Any) -> None:
    if isinstance(theirs, dict):
        assert set(mine) == set(theirs)
        for key in theirs:
            assert_same(mine[key], theirs[key])
    else:
        np.testing.assert_array_equal(mine, theirs)
        assert np.asarray(mine).dtype == np.asarray(theirs).dtype


def cart_poles() -> GymnasiumVecEnv:
    rows = [lambda: gym.make(CART)] * N
    return GymnasiumVecEnv(SyncVectorEnv(rows, autoreset_mode=AutoresetMode.SAME_STEP))


@pytest.mark.parametrize("env_id", [GOAL, GRID, CART])
def test_rows_are_single_environments_as_sb3_vectorises_them(env_id: str) -> None:
    ours = cart_poles() if env_id == CART else native(env_id)
    theirs = DummyVecEnv([lambda: Monitor(gym.make(env_id))] * N)
    ours.seed(7)
    theirs.seed(7)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert_same(ours.reset(), dict(theirs.reset()) if env_id == GOAL else theirs.reset())
    draw = RandomPolicy(ours.action_space, np.random.default_rng(0))
    ends = 0
    for _ in range(210):
        actions, _ = draw.predict(np.zeros((N, 1)))
        obs, *rest, infos = ours.step(actions)
        other, *others, other_infos = theirs.step(actions)
        assert_same(obs, dict(other) if env_id == GOAL else other)
        assert_same(rest, others)
        for row in np.flatnonzero(rest[1]):
            ends += 1
            mine, his = infos[row], other_infos[row]
            assert_same(mine["terminal_observation"], his["terminal_observation"])
            for key in ("TimeLimit.truncated", "is_success"):
                assert mine.get(key) == his.get(key)
            assert mine["episode"]["l"] == his["episode"]["l"]
            # SB3's Monitor rounds to six digits.
            assert mine["episode"]["r"] == pytest.approx(his["episode"]["r"], abs=5e-7)
    assert ends >= 2 * N


def test_the_last_observation_of_an_episode_is_a_dictionary_of_one_row() -> None:
    env = native(GOAL)
    env.reset()
    assert isinstance(env.observation_space, spaces.Dict)
    before: Any = None
    for _ in range(100):
        obs, _, dones, infos = env.step(np.zeros((N, 2), np.float32))
        assert isinstance(obs, dict)
        if not dones.any():
            before = obs
    assert dones.all()
    for row, info in enumerate(infos):
        last = info["terminal_observation"]
        assert env.observation_space.contains(last)
        for key in last:  # without action nothing moves
            np.testing.assert_array_equal(last[key], before[key][row])
            assert not np.shares_memory(last[key], obs[key])


def followed(obs: Any, dones: Any, infos: Any) -> dict[str, Any]:
    """What a step leads to: where an episode ends, its last observation."""
    following = {key: part.copy() for key, part in obs.items()}
    for row in np.flatnonzero(dones):
        for key, part in infos[row]["terminal_observation"].items():
            following[key][row] = part
    return following


def test_what_a_step_pays_can_be_computed_anew_through_sb3() -> None:
    env = native(GOAL, position_tolerance=1.0, angle_tolerance=2.0)
    env.seed(0)
    env.reset()
    rng = np.random.default_rng(1)
    paid = set()
    for _ in range(250):
        obs, rewards, dones, infos = env.step(rng.uniform(-1, 1, (N, 2)).astype(np.float32))
        assert isinstance(obs, dict)
        following = followed(obs, dones, infos)
        goals = following["achieved_goal"], following["desired_goal"]
        (anew,) = env.env_method("compute_reward", *goals, [{}] * N, indices=[0])
        assert anew.shape == (N,) and anew.dtype == np.float64
        np.testing.assert_array_equal(anew.astype(np.float32), rewards)
        paid |= set(anew.tolist())
    assert paid == {-1.0, 0.0}
    (through,) = VecNormalize(env).env_method("compute_reward", *goals, [{}] * N, indices=[0])
    np.testing.assert_array_equal(through, anew)


def test_hindsight_pays_for_the_goals_that_it_puts_in_place() -> None:
    env = native(GOAL)
    memory = HerReplayBuffer(
        3 * 150, env.observation_space, env.action_space, env, n_envs=N, device="cpu"
    )
    env.seed(0)
    last: Any = env.reset()
    rng = np.random.default_rng(1)
    for _ in range(110):
        actions = rng.uniform(-1, 1, (N, 2)).astype(np.float32)
        obs, rewards, dones, infos = env.step(actions)
        following = followed(obs, dones, infos)
        memory.add(last, following, actions, rewards, dones, infos)
        last = obs
    sample = memory.sample(1000)
    achieved = sample.next_observations["achieved_goal"].numpy().astype(np.float64)
    desired = sample.observations["desired_goal"].numpy().astype(np.float64)
    # Position [m], and the angle from the trace of R^T R' (nine entries each), in double precision.
    near = np.hypot(*(achieved - desired)[:, :2].T) <= 0.1
    turned = (achieved[:, 2:] * desired[:, 2:]).sum(axis=1) >= 1.0 + 2.0 * np.cos(0.15)
    np.testing.assert_array_equal(sample.rewards.numpy()[:, 0] == 0.0, near & turned)
    assert 0.01 < (near & turned).mean() < 0.99
    assert not sample.dones.any()  # the time limit ends no task


def test_a_part_of_a_dictionary_that_is_not_finite_is_named() -> None:
    env = native(GOAL)
    env.reset()
    step = env.venv.step

    def spoilt(actions: Any) -> Any:
        obs, *rest = step(actions)
        obs["observation"] = obs["observation"].copy()
        obs["observation"][2, 0] = np.nan
        return obs, *rest

    env.venv.step = spoilt
    with pytest.raises(NonFiniteError, match="observation of row 2"):
        env.step(np.zeros((N, 2), np.float32))


def test_a_choice_that_is_none_is_refused_and_changes_nothing() -> None:
    env = native(GRID)
    env.seed(0)
    env.reset()
    before = env.venv.get_state()
    for bad in (np.array([0, 1, 4]), np.array([0, -1, 1]), np.array([0.0, 1.0, 2.0])):
        with pytest.raises(ValueError, match="from 0 to 3"):
            env.step(bad)
    assert_same(env.venv.get_state(), before)
