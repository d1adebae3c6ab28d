"""A bad choice is refused by a message that names it, and changes nothing."""

import datetime
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.testing.environments import (
    DISCRETE,
    actions,
    assert_refused,
    assert_same_bits,
    rich,
    single,
    task_of,
    vector,
)

pytestmark = pytest.mark.parametrize("env_id", DISCRETE)


def outside(n: int) -> list[Any]:
    """Integers that are none of n choices."""
    return [-1, n, np.int64(n), np.int8(-1), 10**9, -(2**62), np.uint64(2**63), 2**70, -(2**70)]


def no_choices() -> list[Any]:
    """Values that are no integer, though some would become one."""
    return [
        *(0.0, 1.0, 1.5, np.float32(1.0), np.array(1.0, dtype=np.float32), np.nan, np.inf, 1e39),
        *(True, False, np.True_, np.array(True), None, "1", "left", b"1", 1j, np.complex64(1)),
        *(object(), {}, {0}, [], (), [[0], 1], datetime.timedelta(1), np.datetime64(1, "s")),
    ]


def misshapen() -> list[Any]:
    """Choices of another shape."""
    return [[0], (1,), [0, 1], np.zeros(1, dtype=np.int64), np.zeros((1, 1), int), [[0]]]


def bad(n: int) -> list[tuple[Any, str]]:
    """Values that are refused, each with what the message must say of it."""
    return [
        *((value, f" = {value};") for value in outside(n)),
        *((value, f" = {value!r};") for value in no_choices()),
        *((value, f" has shape {np.shape(value)};") for value in misshapen()),
    ]


@pytest.mark.parametrize("make", [single, gym.make], ids=["unwrapped", "wrapped"])
def test_single_environment_refuses_what_is_no_choice(env_id, make):
    env = make(env_id, **rich(env_id))
    env.reset(seed=0)
    n = task_of(env_id).n_choices
    for value, told in bad(n):
        assert_refused(env, value, f"action{told}", f"expected an integer from 0 to {n - 1}")


@pytest.mark.parametrize("num_threads", [1, 2])
def test_vector_environment_refuses_what_is_no_choice_in_any_row_and_names_it(env_id, num_threads):
    envs = vector(env_id, 7, num_threads=num_threads, **rich(env_id))
    envs.reset(seed=0)
    n = task_of(env_id).n_choices
    for row in range(7):
        for value, told in bad(n):
            batch = list(actions(env_id, 1, 7)[0])
            batch[row] = value
            assert_refused(envs, batch, f"action[{row}]{told}", f"from 0 to {n - 1}")
            assert_refused(envs, tuple(batch), f"action[{row}]{told}")
        for value in (-1, n, 2**62):
            batch = actions(env_id, 1, 7)[0]
            batch[row] = value
            assert_refused(envs, batch, f"action[{row}] = {value}", f"from 0 to {n - 1}")


def test_a_bad_row_beyond_the_first_block_advances_no_row(env_id):
    for num_threads in (1, 2):
        envs = vector(env_id, 200, num_threads=num_threads)
        envs.reset(seed=0)
        for row in (0, 63, 64, 127, 128, 199):
            batch = actions(env_id, 1, 200)[0]
            batch[row] = -1
            assert_refused(envs, batch, f"action[{row}] = -1")


def test_vector_environment_refuses_batches_of_another_shape_or_kind(env_id):
    envs = vector(env_id, 7, **rich(env_id))
    envs.reset(seed=0)
    good = actions(env_id, 1, 7)[0]
    for batch in (good[:6], np.append(good, 0), good[None], good[:, None], good[0], good[:0]):
        assert_refused(envs, batch, str(np.shape(batch)), "(7,)")
    one = np.ones(1, dtype=np.float32)
    for batch in (
        None,
        1,
        0.5,
        "left",
        object(),
        one[0],
        one.reshape(()),
        *map(good.astype, "?fdF"),
    ):
        assert_refused(envs, batch, "(7,)")


def test_after_a_refusal_the_episode_goes_on_as_if_nothing_had_happened(env_id):
    disturbed, quiet = vector(env_id, 3, **rich(env_id)), vector(env_id, 3, **rich(env_id))
    assert_same_bits(disturbed.reset(seed=0), quiet.reset(seed=0))
    for batch in actions(env_id, 20, 3):
        bad = batch.copy()
        bad[1] = -1
        with pytest.raises(ValueError):
            disturbed.step(bad)
        assert_same_bits(disturbed.step(batch), quiet.step(batch))


def test_kind_of_integer_does_not_matter(env_id):
    for choice in range(task_of(env_id).n_choices):
        results = []
        kinds = (int, np.int64, np.int8, np.uint8, np.uint64, np.array)
        for value in (kind(choice) for kind in kinds):
            env = single(env_id)
            env.reset(seed=0)
            results.append(env.step(value))
        for other in results[1:]:
            assert_same_bits(results[0], other)


def test_kind_of_batch_does_not_matter(env_id):
    batch = actions(env_id, 1, 7)[0]
    wide = np.zeros((7, 2), dtype=np.int64)
    wide[:, 1] = batch
    results = []
    for value in (
        batch,
        batch.astype(np.uint8),
        batch.tolist(),
        tuple(batch),
        list(batch),
        wide[:, 1],
    ):
        envs = vector(env_id, 7)
        envs.reset(seed=0)
        results.append(envs.step(value))
    for other in results[1:]:
        assert_same_bits(results[0], other)


def test_every_choice_does_something_else(env_id):
    n = task_of(env_id).n_choices
    envs = vector(env_id, n)
    state = single(env_id)
    state.reset(seed=0)
    envs.reset(seed=0, options={"state": state.y})
    envs.step(np.arange(n))
    assert len(np.unique(envs.y, axis=0)) == n


def test_choices_take_no_noise(env_id):
    with pytest.raises(ValueError, match=r"^config\.action_noise: .*expected"):
        single(env_id, action_noise=0.1)
