"""A seed fixes a trajectory; neighbouring runs are independent; no global generator is touched."""

import random
from functools import cache

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.testing.environments import (
    actions,
    assert_same_bits,
    pick,
    ranges,
    rich,
    single,
    vector,
)


@cache
def plain(env_id):
    """The default settings; where starts are few, parameters that tell them apart."""
    envs = vector(env_id, 64)
    envs.reset(seed=0)
    return {} if len(np.unique(start_of(envs), axis=0)) == 64 else ranges(env_id)


def start_of(env):
    """What an episode begins with, apart from its random stream: one row, or (N, n)."""
    state = env.get_state()
    return np.concatenate([state[part] for part in ("y", "parameters", "aux") if part in state], -1)


def starts(env_id, seeds):
    """First state of each seed, shape (len(seeds), n)."""
    envs = vector(env_id, len(seeds), **plain(env_id))
    envs.reset(seed=list(seeds))
    return start_of(envs)


def test_seeds_of_numpy_are_those_of_python(env_id):
    env, envs = single(env_id), vector(env_id, 3)
    expected, rows = env.reset(seed=5)[0], envs.reset(seed=5)[0]
    for kind in (np.int64, np.uint32, np.int8):
        assert_same_bits(env.reset(seed=kind(5))[0], expected)
        assert_same_bits(envs.reset(seed=kind(5))[0], rows)
        assert_same_bits(envs.reset(seed=np.array([5, 6, 7], dtype=kind))[0], rows)


def test_starts_of_6400_spawned_seeds_are_distinct(env_id):
    seeds = [
        int(seed)
        for run in range(100)
        for seed in np.random.SeedSequence(run).generate_state(64, np.uint64)
    ]
    assert len(np.unique(starts(env_id, seeds), axis=0)) == 6400


def test_seeds_that_agree_in_their_lower_32_bits_differ(env_id):
    seeds = [s + k * 2**32 for s in range(64) for k in (0, 1, 2, 2**32)]
    assert len(np.unique(starts(env_id, seeds), axis=0)) == len(seeds)


def test_starts_of_neighbouring_seeds_are_independent(env_id):
    y = starts(env_id, range(4096))
    y = y[:, np.ptp(y, axis=0) > 0]
    y = (y - y.mean(axis=0)) / y.std(axis=0)
    for lag in (1, 2, 64):
        correlation = np.mean(y[lag:] * y[:-lag], axis=0)
        # of n independent pairs it is normal with deviation n^(-1/2) = 1/64; beyond 5 of them:
        # one in 10^6
        assert np.abs(correlation).max() < 5 / 64


def test_every_episode_of_a_seed_starts_elsewhere(env_id):
    env = single(env_id, **plain(env_id))
    env.reset(seed=0)
    begun = [start_of(env)]
    for _ in range(99):
        env.reset()
        begun.append(start_of(env))
    assert len(np.unique(begun, axis=0)) == 100


def test_environments_without_a_seed_differ(env_id):
    begun = []
    for _ in range(5):
        envs = vector(env_id, 3, **plain(env_id))
        envs.reset()
        begun.append(start_of(envs))
    assert len(np.unique(np.vstack(begun), axis=0)) == 15


def test_rows_without_a_seed_of_their_own_go_on_in_their_streams(env_id):
    envs, other = vector(env_id, 3), vector(env_id, 3)
    envs.reset(seed=0)
    other.reset(seed=0)
    mixed, unseeded = envs.reset(seed=[None, 50, None])[0], other.reset()[0]
    assert_same_bits(pick(mixed, [0, 2]), pick(unseeded, [0, 2]))
    assert_same_bits(pick(mixed, 1), single(env_id).reset(seed=50)[0])


def test_bad_seeds_are_refused_and_change_nothing(env_id):
    lists = [1, 2], [1, 2, 3, 4], [1, 2, -3], [1, 2, "a"], [1, 2, 0.5]
    for env, seeds in (
        (single(env_id), (-1, 0.5, "a", [1, 2, 3])),
        (vector(env_id, 3), (-1, *lists)),
    ):
        env.reset(seed=0)
        before = env.get_state()
        for seed in seeds:
            with pytest.raises((ValueError, gym.error.Error), match=r"[Ss]eed"):
                env.reset(seed=seed)
            assert_same_bits(env.get_state(), before)


def test_global_generators_are_neither_read_nor_moved(env_id):
    def run():
        env, envs = single(env_id, **rich(env_id)), vector(env_id, 3, **rich(env_id))
        results = [env.reset(seed=0), envs.reset(seed=0)]
        for batch in actions(env_id, 20, 3):
            results += [envs.step(batch), env.reset(), env.step(batch[0])]
        env.reset(options={"state": env.y})
        return results

    random.seed(1)
    np.random.seed(1)  # noqa: NPY002 - the generator that must not be used
    before = random.getstate(), np.random.get_state()  # noqa: NPY002
    first = run()
    after = random.getstate(), np.random.get_state()  # noqa: NPY002
    assert before[0] == after[0]
    assert_same_bits(before[1], after[1])
    random.seed(2)
    np.random.seed(2)  # noqa: NPY002
    assert_same_bits(run(), first)
