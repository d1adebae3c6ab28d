"""A bad action is refused by a message that names it, and changes nothing."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs.testing.environments import (
    CONTINUOUS,
    actions,
    assert_refused,
    assert_same_bits,
    n_actions,
    rich,
    single,
    vector,
)

pytestmark = pytest.mark.parametrize("env_id", CONTINUOUS)

ENTRIES = {"nan": np.nan, "+inf": np.inf, "-inf": -np.inf, "1e39": 1e39}


def shapeless(m: int) -> dict[str, Any]:
    """Ten values that are no action of length m."""
    return {
        "too long": np.zeros(m + 1, dtype=np.float32),
        "too short": np.zeros(m - 1, dtype=np.float32),
        "(1, m)": np.zeros((1, m), dtype=np.float32),
        "scalar": 0.25,
        "None": None,
        "str": "left",
        "bytes": b"left",
        "object": object(),
        "complex": np.zeros(m, dtype=np.complex64),
        "bool": np.zeros(m, dtype=np.bool_),
    }


def with_entry(m: int, k: int, value: float, dtype: type) -> Any:
    action = np.zeros(m, dtype=np.float64)
    action[k] = value
    with np.errstate(over="ignore"):
        return action.astype(dtype)


@pytest.mark.parametrize("make", [single, gym.make], ids=["unwrapped", "wrapped"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_single_environment_refuses_what_is_not_finite_by_index_and_value(env_id, make, dtype):
    env = make(env_id, **rich(env_id))
    env.reset(seed=0)
    for k in range(n_actions(env_id)):
        for value in ENTRIES.values():
            action = with_entry(n_actions(env_id), k, value, dtype)
            assert_refused(env, action, f"action[{k}] = {action[k]}")
            assert_refused(env, action.tolist(), f"action[{k}]")


@pytest.mark.parametrize("make", [single, gym.make], ids=["unwrapped", "wrapped"])
def test_single_environment_refuses_what_is_no_action(env_id, make):
    env = make(env_id, **rich(env_id))
    env.reset(seed=0)
    m = n_actions(env_id)
    for name, value in shapeless(m).items():
        shown = f"{np.shape(value)}" if name in ("too long", "too short", "(1, m)") else ""
        assert_refused(env, value, shown, f"({m},)")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("num_threads", [1, 2])
def test_vector_environment_refuses_what_is_not_finite_in_any_row(env_id, dtype, num_threads):
    envs = vector(env_id, 7, num_threads=num_threads, **rich(env_id))
    envs.reset(seed=0)
    for row in range(7):
        for k in range(n_actions(env_id)):
            for value in ENTRIES.values():
                batch = actions(env_id, 1, 7)[0].astype(dtype)
                batch[row] = with_entry(n_actions(env_id), k, value, dtype)
                assert_refused(envs, batch, f"action[{row}, {k}] = {batch[row, k]}")


def test_a_bad_row_beyond_the_first_block_advances_no_row(env_id):
    for num_threads in (1, 2):
        envs = vector(env_id, 200, num_threads=num_threads)
        envs.reset(seed=0)
        for row in (0, 63, 64, 127, 128, 199):
            batch = actions(env_id, 1, 200)[0]
            batch[row, -1] = np.nan
            assert_refused(envs, batch, f"action[{row}, {n_actions(env_id) - 1}] = nan")


def test_vector_environment_names_the_row_that_is_no_action(env_id):
    envs = vector(env_id, 7, **rich(env_id))
    envs.reset(seed=0)
    for row in range(7):
        for value in shapeless(n_actions(env_id)).values():
            batch = list(actions(env_id, 1, 7)[0])
            batch[row] = value
            assert_refused(envs, batch, f"action[{row}]")


def test_vector_environment_refuses_batches_of_another_shape_or_kind(env_id):
    envs = vector(env_id, 7, **rich(env_id))
    envs.reset(seed=0)
    good = actions(env_id, 1, 7)[0]
    wrong_shapes = (good[:6], np.vstack([good, good[:1]]), good[None], good[0], good[:, :-1])
    for batch in wrong_shapes:
        assert_refused(envs, batch, str(batch.shape), str(good.shape))
    for batch in (None, 0.5, "left", object(), good.astype(bool), good.astype(complex)):
        assert_refused(envs, batch, str(good.shape))


def test_after_a_refusal_the_episode_goes_on_as_if_nothing_had_happened(env_id):
    disturbed, quiet = vector(env_id, 3, **rich(env_id)), vector(env_id, 3, **rich(env_id))
    assert_same_bits(disturbed.reset(seed=0), quiet.reset(seed=0))
    for batch in actions(env_id, 20, 3):
        bad = batch.copy()
        bad[1, 0] = np.inf
        with pytest.raises(ValueError):
            disturbed.step(bad)
        assert_same_bits(disturbed.step(batch), quiet.step(batch))


def test_kind_of_number_does_not_matter(env_id):
    batch = np.round(actions(env_id, 1, 1)[0, 0])  # exact in every type
    results = []
    for value in (batch, batch.astype(np.float64), batch.astype(np.int64), batch.tolist()):
        env = single(env_id)
        env.reset(seed=0)
        results.append(env.step(value))
    for other in results[1:]:
        assert_same_bits(results[0], other)
